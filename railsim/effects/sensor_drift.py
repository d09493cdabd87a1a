"""Sensor whose zero moves with time."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._references import INERTIAL
from railsim.effects.interface import CHOSEN, Setup
from railsim.effects.sensor_changes import ChannelEffect
from railsim.spec import quantity


class SensorDrift(ChannelEffect, frozen=True):
    """One channel grows by `rate` times the time since the start."""

    rate: float = quantity(1e-3, unit="unit of the channel per s", source=CHOSEN, ge=-0.1, le=0.1)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"rate": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"rate": 1e-4})
    signature: ClassVar[str] = "a slow ramp in one channel and in no other"
    references: ClassVar[tuple[str, ...]] = (INERTIAL,)

    def install(self, setup: Setup) -> Setup:
        """A ramp."""
        return self.faulty(setup, drift_rate=lambda given: given + self.rate)
