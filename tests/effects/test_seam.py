"""What must be known of an effect stands on it: the workflow and the scores know none by its name."""

import ast
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import ClassVar

import pytest

import experiments
from experiments.discrepancy.railway.library import large, prior, starts
from railsim.effects.interface import EFFECTS, Effect, Setup
from railsim.spec import quantity

ROOT = Path(str(experiments.__file__)).parent
SEEKERS = [path for room in ("discrepancy", "scoring", "commands") for path in sorted((ROOT / room).rglob("*.py"))]


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


def test_an_effect_from_outside_is_known_by_what_it_says_of_itself():
    numbers = Knock.parameters()
    blow = prior("blow", numbers["blow"])
    assert (blow.mean, blow.spread, blow.unit) == (1.0, 0.5, "N")
    assert large(numbers) == pytest.approx(10.0**0.5)  # the geometric mean of the usual size and the bound
    assert [one[0] for one in starts(numbers)] == pytest.approx([1.0, 10.0**0.5])
