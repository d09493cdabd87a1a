"""Wheelset that is not square to the bogie: bent guides, wrong shims."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import WheelsetNumber, wheelset_field
from railsim.effects._elements import misaligned
from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.spec import quantity


class WheelsetMisalignment(Effect, frozen=True):
    """The primary suspension of one wheelset is at rest at a yaw angle."""

    angle: float = quantity(1e-3, unit="rad, to the left", source=CHOSEN, ge=-5e-3, le=5e-3)
    wheelset: WheelsetNumber = wheelset_field()

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"angle": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"angle": 1e-4})
    signature: ClassVar[str] = "wheelsets and bogie are steadily shifted and turned on straight track"
    references: ClassVar[tuple[str, ...]] = ("Wickens (2003), Fundamentals of Rail Vehicle Dynamics, chapter 2",)

    def install(self, setup: Setup) -> Setup:
        """A constant yaw moment between bogie and wheelset: its yaw stiffness times the angle."""
        return misaligned(setup, self, self.wheelset, self.angle)
