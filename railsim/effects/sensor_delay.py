"""Sensor whose samples come late."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects.interface import CHOSEN, Setup
from railsim.effects.sensor_changes import ChannelEffect
from railsim.spec import quantity


class SensorDelay(ChannelEffect, frozen=True):
    """One channel later than its time stamps by `delay`."""

    delay: float = quantity(0.02, unit="s", source=CHOSEN, ge=0.0, le=0.5)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"delay": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"delay": 0.002})
    signature: ClassVar[str] = "phase of one channel against the others falls in proportion to the frequency"
    references: ClassVar[tuple[str, ...]] = ("IEEE Std 1451: time stamps",)

    def install(self, setup: Setup) -> Setup:
        """More latency."""
        return self.faulty(setup, latency=lambda given: given + self.delay)
