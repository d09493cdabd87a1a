"""Wheels of one side larger than those of the other."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.effects.wheel_changes import radius_difference
from railsim.spec import quantity


class WheelRadiusDifference(Effect, frozen=True):
    """Rolling radii left larger by half of it, right smaller by half of it, all wheelsets."""

    difference: float = quantity(5e-4, unit="m, left minus right", source=CHOSEN, ge=-3e-3, le=3e-3)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"difference": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"difference": 2e-5})
    signature: ClassVar[str] = "wheelsets run steadily off centre, towards the smaller wheel"
    acts_on: ClassVar[str] = "wheel"
    references: ClassVar[tuple[str, ...]] = ("Wickens (2003), Fundamentals of Rail Vehicle Dynamics, chapter 2",)

    def install(self, setup: Setup) -> Setup:
        """Rolling radii of both sides differ."""
        return radius_difference(setup, self.difference)
