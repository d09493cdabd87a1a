"""A patch of low adhesion: leaves, a lubricator, a station."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._contact import less_friction
from railsim.effects._references import POLACH
from railsim.effects.interface import CHOSEN, Effect, Extent, Setup
from railsim.spec import quantity


class LocalLowAdhesion(Effect, frozen=True):
    """Friction by one factor over a stretch of the track, with ends of 2 m."""

    factor: float = quantity(0.15, unit="-", source=CHOSEN, ge=0.03, le=1.0)
    place: float = quantity(40.0, unit="m, where it begins", source=CHOSEN, role="distance", ge=0.0, le=1e5)
    length: float = quantity(30.0, unit="m", source=CHOSEN, role="length", ge=5.0, le=1e4)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 0.5})
    signature: ClassVar[str] = "as low adhesion, within one stretch"
    acts_on: ClassVar[str] = "track"
    extent: ClassVar[Extent] = "stretch"
    references: ClassVar[tuple[str, ...]] = (
        "Ward et al. (2011), section 4.2",
        POLACH,
    )

    def install(self, setup: Setup) -> Setup:
        """Less friction over a stretch."""
        return less_friction(setup, self, self.factor, (self.place, self.length))
