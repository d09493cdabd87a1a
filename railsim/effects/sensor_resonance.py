"""Sensor whose mount resonates."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects.interface import CHOSEN, Setup
from railsim.effects.sensor_changes import ChannelEffect
from railsim.spec import quantity


class SensorResonance(ChannelEffect, frozen=True):
    """One channel through 1 / (1 - (f / frequency)^2 + 2 i damping f / frequency) before its own filter.

    Up to a damping of 0.3, an amplification of 1.7: with 0.7 it has no peak and is a delay of
    damping / (pi frequency), which another effect is.
    """

    period: float = quantity(0.01, unit="s, 1 / frequency of the mount", source=CHOSEN, role="period", ge=0.0, le=0.06)
    damping: float = quantity(0.05, unit="- of critical", source="illustrative", gt=0.0, le=0.3)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"period": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"period": 0.003})
    signature: ClassVar[str] = "a peak of one channel at the frequency of the mount, and less beyond"
    references: ClassVar[tuple[str, ...]] = ("ISO 5348: mechanical mounting of accelerometers",)

    def install(self, setup: Setup) -> Setup:
        """A resonator before the sensor."""
        if self.period == 0.0:
            return setup
        return self.faulty(
            setup, resonance=lambda given: 1.0 / self.period, resonance_damping=lambda given: self.damping
        )
