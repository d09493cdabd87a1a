"""Laws from outside the library can be run, act where they say, and a wrong file is refused in one line."""

from pathlib import Path

import pytest

from experiments.discrepancy.blind.blind_cases import read_laws
from experiments.discrepancy.blind.oracle import acting
from railsim import load_scenario
from railsim.errors import InputError

LAWS = Path(__file__).parents[1] / "foreign_laws.yaml"


def test_each_law_acts_between_its_bodies():
    setup = load_scenario("yaw_dampers").setup
    laws = read_laws(str(LAWS))
    assert len(laws) >= 6
    for law in laws:
        assert acting(setup, law) == [sorted((getattr(law, "upper"), getattr(law, "lower")))]  # noqa: B009


@pytest.mark.parametrize("text", ["{", "- {kind: nothing_like_it}", "3"])
def test_a_wrong_file_is_refused(tmp_path: Path, text: str):
    path = tmp_path / "laws.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match="--laws"):
        read_laws(str(path))
