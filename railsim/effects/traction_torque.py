"""Traction or braking that the nominal scenario does not have."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.constants import GRAVITY
from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.spec import quantity
from railsim.speed import Traction

GRADIENT = 0.01  # a choice: standard deviation of the gradient along a line


class TractionTorque(Effect, frozen=True):
    """The same torque on every wheelset."""

    torque: float = quantity(1500.0, unit="N m on each wheelset, driving +", source=CHOSEN, ge=-8e3, le=8e3)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"torque": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"torque": 100.0})
    signature: ClassVar[str] = "tachometer and speed differ by a steady creepage; the bogie pitches"
    acts_on: ClassVar[str] = "load"
    references: ClassVar[tuple[str, ...]] = ("Ward et al. (2011), section 4.2",)

    @classmethod
    def ordinary(cls, setup: Setup) -> Mapping[str, float]:
        """What holds the vehicle's speed on a line's gradients."""
        model, (wheelset, *others) = setup.model, setup.model.wheelsets
        mass = sum(body.mass for body in model.bodies if "z" in body.free)
        weight = GRAVITY * mass + sum(model.vertical_load.values())
        return {"torque": GRADIENT * weight * wheelset.radius / (1 + len(others))}

    def install(self, setup: Setup) -> Setup:
        """Torques from the start of the run."""
        if self.torque == 0.0:
            return setup
        count = len(setup.model.wheelsets)
        added = tuple(Traction(wheelset=i + 1, time=(0.0,), torque=(self.torque,)) for i in range(count))
        return setup.but(traction=(*setup.traction, *added))
