"""Sensor with a wrong scale."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._references import INERTIAL
from railsim.effects.interface import CHOSEN, Setup
from railsim.effects.sensor_changes import ChannelEffect
from railsim.spec import quantity


class SensorGain(ChannelEffect, frozen=True):
    """One channel by one factor."""

    factor: float = quantity(1.05, unit="-", source=CHOSEN, ge=0.5, le=1.5)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.01})
    signature: ClassVar[str] = "one channel is larger at all frequencies by the same share, the others stay"
    references: ClassVar[tuple[str, ...]] = (INERTIAL,)

    def install(self, setup: Setup) -> Setup:
        """Another scale."""
        return self.faulty(setup, scale_error=lambda given: (1.0 + given) * self.factor - 1.0)
