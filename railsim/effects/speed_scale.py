"""Vehicle that runs faster or slower than the scenario says."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.spec import quantity
from railsim.speed import Profile


class SpeedScale(Effect, frozen=True):
    """Prescribed speed by one factor (with forces alone: the speed at the start)."""

    factor: float = quantity(1.01, unit="-", source=CHOSEN, ge=0.95, le=1.05)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.001})
    signature: ClassVar[str] = "waves of the track show at other frequencies, and places come too early or too late"
    acts_on: ClassVar[str] = "speed"
    family: ClassVar[str] = "speed_scale"
    by_registration: ClassVar[bool] = True
    references: ClassVar[tuple[str, ...]] = ("Ward et al. (2011), section 5",)

    def install(self, setup: Setup) -> Setup:
        """Another speed."""
        if self.factor == 1.0:
            return setup
        given = setup.speed
        if isinstance(given, Profile):
            return setup.but(speed=given.but(speed=tuple(self.factor * v for v in given.speed)))
        return setup.but(speed=given.but(speed=self.factor * given.speed))
