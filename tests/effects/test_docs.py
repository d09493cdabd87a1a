"""docs/effects.md has every effect with its bounds, and no other."""

import re
from pathlib import Path

from railsim.scenario import effect_kinds

TEXT = (Path(__file__).parents[2] / "docs" / "effects.md").read_text()


def test_every_effect_is_in_the_table():
    assert set(re.findall(r"^\| `(\w+)` \|", TEXT, re.MULTILINE)) == set(effect_kinds())


def test_bounds_and_signatures_are_those_of_the_code():
    for name, kind in effect_kinds().items():
        row = next(line for line in TEXT.splitlines() if line.startswith(f"| `{name}` |"))
        assert kind.signature in row
        for parameter, one in kind.parameters().items():
            if parameter not in kind.held():
                assert f"`{parameter}` {one.low:g} to {one.high:g}" in row, name
