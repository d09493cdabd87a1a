"""Traction or braking that the nominal scenario does not have."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.spec import quantity
from railsim.speed import Traction


class TractionTorque(Effect, frozen=True):
    """The same torque on every wheelset."""

    torque: float = quantity(1500.0, unit="N m on each wheelset, driving +", source=CHOSEN, ge=-8e3, le=8e3)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"torque": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"torque": 100.0})
    signature: ClassVar[str] = "tachometer and speed differ by a steady creepage; the bogie pitches"
    acts_on: ClassVar[str] = "load"
    references: ClassVar[tuple[str, ...]] = ("Ward et al. (2011), section 4.2",)

    def install(self, setup: Setup) -> Setup:
        """Torques from the start of the run."""
        if self.torque == 0.0:
            return setup
        count = len(setup.model.wheelsets)
        added = tuple(Traction(wheelset=i + 1, time=(0.0,), torque=(self.torque,)) for i in range(count))
        return setup.but(traction=(*setup.traction, *added))
