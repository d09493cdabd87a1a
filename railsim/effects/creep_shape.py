"""Creep forces that bend away from Kalker's line in another way than the nominal law."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._contact import creep_shape
from railsim.effects._references import POLACH
from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.spec import quantity


class CreepShape(Effect, frozen=True):
    """Reduction factor kS (area of slip) of Polach's law by one factor, kA so that the slope at zero creepage stays."""

    factor: float = quantity(1.5, unit="-", source=CHOSEN, ge=1.0, le=1.75)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.2})
    signature: ClassVar[str] = "as nominal at small creepage, other forces at middle creepage (curves, traction)"
    acts_on: ClassVar[str] = "contact"
    family: ClassVar[str] = "adhesion"
    references: ClassVar[tuple[str, ...]] = (POLACH,)

    def install(self, setup: Setup) -> Setup:
        """Another bend of the creep curve."""
        return creep_shape(setup, self, self.factor)
