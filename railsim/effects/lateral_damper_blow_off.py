"""Lateral damper whose valves open: less force beyond a velocity."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import LATERAL_DAMPERS, BogieEffect
from railsim.effects._elements import blow_off
from railsim.effects._references import BRUNI
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class LateralDamperBlowOff(BogieEffect, frozen=True):
    """Both lateral dampers: damping beyond the blow-off velocity is `share` of that before."""

    velocity: float = quantity(0.02, unit="m/s", source=CHOSEN, ge=0.002, le=2.0)
    share: float = quantity(0.1, unit="-", source="illustrative: of the damping before", ge=0.0, le=1.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"velocity": 2.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"velocity": 0.03})
    signature: ClassVar[str] = (
        "as a weak lateral damper, but the more the rougher the track; as nominal on smooth track"
    )
    references: ClassVar[tuple[str, ...]] = (BRUNI,)

    def install(self, setup: Setup) -> Setup:
        """The force grows less beyond the velocity."""
        return blow_off(setup, self, LATERAL_DAMPERS, self.velocity, self.share)
