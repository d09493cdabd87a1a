"""Sensor that shows a constant too much."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._references import INERTIAL
from railsim.effects.interface import CHOSEN, Setup
from railsim.effects.sensor_changes import ChannelEffect
from railsim.spec import quantity


class SensorBias(ChannelEffect, frozen=True):
    """Constant added to one channel."""

    bias: float = quantity(0.05, unit="unit of the channel", source=CHOSEN, ge=-1.0, le=1.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"bias": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"bias": 0.005})
    signature: ClassVar[str] = (
        "a constant in one channel and in no other; with a lateral accelerometer like a steady lateral force"
    )
    family: ClassVar[str] = "steady_lateral"
    references: ClassVar[tuple[str, ...]] = (INERTIAL,)

    def install(self, setup: Setup) -> Setup:
        """More bias."""
        return self.faulty(setup, bias=lambda given: given + self.bias)
