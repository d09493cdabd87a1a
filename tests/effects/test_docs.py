"""docs/effects.md has a row for every effect of the library as the code has it; effects from elsewhere need none."""

import inspect
import re
from pathlib import Path

import pytest

from railsim import effects
from railsim.effects.interface import EFFECTS, Effect, Parameter

TEXT = (Path(__file__).parents[2] / "docs" / "effects.md").read_text()
LIBRARY = Path(str(effects.__file__)).parent
SHIPPED = {name: kind for name, kind in EFFECTS.classes().items() if Path(inspect.getfile(kind)).parent == LIBRARY}


def row(name: str, kind: type[Effect]) -> str:
    """The row that the table has to have."""
    numbers = [_number(field, one) for field, one in kind.parameters().items() if field not in kind.held()]
    return f"| `{name}` | {', '.join(numbers)} | {kind.family or 'own'} |"


def _number(name: str, one: Parameter) -> str:
    unit = one.unit.split(",")[0]
    known = [f"{value:g}" for value in (one.absent, one.smallest) if value is not None]
    sizes = f" ({'; '.join(known)})" if known else ""
    return f"`{name}` {one.low:g} to {one.high:g}{'' if unit.startswith('-') else ' ' + unit}{sizes}"


@pytest.mark.parametrize("name", list(SHIPPED))
def test_effect_has_its_row_and_says_how_it_shows(name: str):
    wanted = row(name, SHIPPED[name])
    assert wanted in TEXT.splitlines(), f"put this row into docs/effects.md:\n{wanted}"
    shown = f"- `{name}`: {SHIPPED[name].signature}."
    assert shown in " ".join(TEXT.split()), f"put this line into docs/effects.md:\n{shown}"


def test_no_row_is_of_an_effect_that_there_is_not():
    assert set(re.findall(r"^\| `(\w+)` \|", TEXT, re.MULTILINE)) <= set(SHIPPED)
