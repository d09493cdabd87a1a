"""Load that stands on one side."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._loads import loaded
from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.spec import quantity


class OffCentreLoad(Effect, frozen=True):
    """Roll moment of what is loaded to the left of the centre line: mass times g times its distance."""

    moment: float = quantity(10e3, unit="N m, left side heavier", source=CHOSEN, ge=-60e3, le=60e3)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"moment": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"moment": 1000.0})
    signature: ClassVar[str] = "the body leans steadily; wheel loads differ from left to right"
    references: ClassVar[tuple[str, ...]] = ("EN 14363: lateral asymmetry of wheel forces",)

    def install(self, setup: Setup) -> Setup:
        """A constant moment on the body."""
        return loaded(setup, self, "body", "roll", -self.moment)
