"""Brake of one wheelset that does not come off."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import WheelsetNumber, wheelset_field, wheelset_place
from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.spec import quantity
from railsim.speed import Traction


class DraggingBrake(Effect, frozen=True):
    """Friction brake on one wheelset, against its rotation."""

    torque: float = quantity(800.0, unit="N m", source=CHOSEN, ge=0.0, le=8e3)
    wheelset: WheelsetNumber = wheelset_field()

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"torque": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"torque": 100.0})
    signature: ClassVar[str] = "one wheelset turns slower by its creepage; the bogie pitches a little"
    acts_on: ClassVar[str] = "load"
    references: ClassVar[tuple[str, ...]] = ("Ward et al. (2011), section 4.2",)

    def install(self, setup: Setup) -> Setup:
        """A brake from the start of the run."""
        wheelset_place(setup, self, self.wheelset)
        if self.torque == 0.0:
            return setup
        added = Traction(wheelset=self.wheelset, time=(0.0,), brake=(self.torque,))
        return setup.but(traction=(*setup.traction, added))
