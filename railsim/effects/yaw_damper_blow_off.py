"""Yaw damper whose valves open: less force beyond a velocity."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import YAW_DAMPERS, BogieEffect
from railsim.effects._elements import blow_off
from railsim.effects._references import BRUNI
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class YawDamperBlowOff(BogieEffect, frozen=True):
    """Both yaw dampers: damping beyond the blow-off velocity of the damper is `share` of that before."""

    velocity: float = quantity(0.003, unit="m/s", source=CHOSEN, ge=0.0005, le=1.0)
    share: float = quantity(0.1, unit="-", source="illustrative: of the damping before", ge=0.0, le=1.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"velocity": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"velocity": 0.008})
    signature: ClassVar[str] = "as a weak yaw damper, but the more the rougher the track; as nominal on smooth track"
    references: ClassVar[tuple[str, ...]] = (BRUNI,)

    def install(self, setup: Setup) -> Setup:
        """The force grows less beyond the velocity."""
        return blow_off(setup, self, YAW_DAMPERS, self.velocity, self.share)
