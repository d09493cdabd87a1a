"""Contaminated contacts whose creep forces start less steeply than Kalker's theory."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._contact import creep
from railsim.effects._references import POLACH
from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.spec import quantity


class ReducedCreepSlope(Effect, frozen=True):
    """Reduction factors kA and kS of Polach's law by one factor."""

    factor: float = quantity(0.5, unit="-", source=CHOSEN, ge=0.05, le=1.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 0.9})
    signature: ClassVar[str] = "wheelsets are guided less stiffly at small creepage, and hunt otherwise"
    acts_on: ClassVar[str] = "contact"
    family: ClassVar[str] = "adhesion"
    references: ClassVar[tuple[str, ...]] = (
        "Ward et al. (2011), section 4.2",
        POLACH,
    )

    def install(self, setup: Setup) -> Setup:
        """A flatter start of the creep force."""
        return creep(setup, self, self.factor, self.factor)
