"""What must be known of an effect stands on it: the workflow and the scores know none by its name."""

import ast
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import ClassVar

import pytest

import experiments
from experiments.discrepancy.fit.candidates import Candidate, Context, candidates, fitted_names
from railsim.effects.interface import EFFECTS, Effect, Setup
from railsim.spec import quantity

ROOT = Path(str(experiments.__file__)).parent
SEEKERS = [path for room in ("discrepancy", "scoring", "commands") for path in sorted((ROOT / room).rglob("*.py"))]
CONTEXT = Context(("bogie.rate_yaw",), (50.0, 900.0), (1.0, 30.0), ((300.0, 10.0),), tones=((10.0, 2.0),))


@pytest.mark.parametrize("path", SEEKERS, ids=lambda path: path.stem)
def test_no_effect_is_known_by_name(path: Path):
    texts = {node.value for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Constant)}
    assert texts & set(EFFECTS.classes()) == set()


class Knock(Effect, frozen=True):
    """An effect that nobody has told the workflow of, with fields under names of its own."""

    blow: float = quantity(1.0, unit="N", source="illustrative", ge=0.0, le=10.0)
    chainage: float = quantity(0.0, unit="m", source="illustrative", role="distance", ge=0.0, le=1e5)
    crest: float = quantity(2.0, unit="m", source="illustrative", role="wavelength", ge=0.5, le=100.0)
    roundness: float = quantity(0.1, unit="-", source="illustrative", trials=(0.6, 0.9), ge=0.0, le=1.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"blow": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"blow": 0.1})

    def install(self, setup: Setup) -> Setup:
        """Nothing."""
        return setup


def test_an_effect_from_outside_is_a_candidate_by_what_it_says_of_itself():
    one = Candidate(Knock, CONTEXT)
    assert one.local and one.linear and not (one.short or one.stretch or one.gust or one.sharp or one.uneven)
    assert one.number("distance") == "chainage" and one.number("wavelength") == "crest"
    assert (one.parameters["chainage"].low, one.parameters["chainage"].high) == CONTEXT.distance
    middle = next(iter(one.sizes()))
    assert {values["roundness"] for values in one.banked()} == {0.1, 0.6, 0.9}
    assert [values["chainage"] for values in one.variants_of(middle)] == [300.0]
    assert {values["crest"] for values in one.at_tones()} == {2.0}
    assert one.build(middle).settings()["blow"] == middle["blow"]


def test_a_fit_looks_for_all_that_have_a_name_and_that_the_registration_does_not_find():
    assert set(EFFECTS.classes()) - set(fitted_names()) == {"empirical_force", "odometer_scale", "speed_scale"}
    assert {one.name for one in candidates(CONTEXT)} == set(fitted_names())
