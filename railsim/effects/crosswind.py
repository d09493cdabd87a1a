"""Steady wind from the side."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._loads import wind
from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.spec import quantity


class Crosswind(Effect, frozen=True):
    """Lateral force on the vehicle's body, half of it or whole, at the height of the centre of pressure."""

    force: float = quantity(5e3, unit="N on the body, to the left", source=CHOSEN, ge=-40e3, le=40e3)
    height: float = quantity(2.3, unit="m above the rails", source="illustrative: middle of the side wall", gt=0.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"force": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"force": 300.0})
    signature: ClassVar[str] = "the body leans and shifts steadily, wheels of the lee side press more"
    acts_on: ClassVar[str] = "load"
    family: ClassVar[str] = "steady_lateral"
    references: ClassVar[tuple[str, ...]] = ("EN 14067-6: cross wind assessment",)

    def install(self, setup: Setup) -> Setup:
        """A constant force and its roll moment."""
        return wind(setup, self, [self.force, self.force], 0.0, 1.0, self.height)
