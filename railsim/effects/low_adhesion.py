"""Wet, greasy or leaf-covered rails all along."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._contact import less_friction
from railsim.effects._references import POLACH
from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.spec import quantity


class LowAdhesion(Effect, frozen=True):
    """Friction of all contacts by one factor, on top of what the track states."""

    factor: float = quantity(0.2, unit="-", source=CHOSEN, ge=0.03, le=1.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 0.6})
    signature: ClassVar[str] = "creep forces saturate: wheelsets steer and guide less, and slide when braked"
    acts_on: ClassVar[str] = "contact"
    family: ClassVar[str] = "adhesion"
    references: ClassVar[tuple[str, ...]] = (
        "Ward et al. (2011), section 4.2",
        POLACH,
    )

    def install(self, setup: Setup) -> Setup:
        """Less friction everywhere."""
        return less_friction(setup, self, self.factor)
