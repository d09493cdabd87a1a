"""Sensor whose mount resonates."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from railsim.effects.interface import CHOSEN, Setup
from railsim.effects.sensor_changes import FilterEffect
from railsim.spec import quantity

PERIODS = (0.003, 0.006, 0.01, *np.geomspace(1.0 / 60.0, 0.06, 8))
"""s; resonances beyond the highest frequency that is compared show by their foot only."""
FINE_PERIODS = tuple(np.geomspace(0.003, 0.06, 30).tolist())


class SensorResonance(FilterEffect, frozen=True):
    """One channel through 1 / (1 - (f / frequency)^2 + 2 i damping f / frequency) before its own filter.

    Up to a damping of 0.3, an amplification of 1.7: with 0.7 it has no peak and is a delay of
    damping / (pi frequency), which another effect is.
    """

    period: float = quantity(
        0.01, unit="s, 1 / frequency of the mount", source=CHOSEN, role="period", trials=PERIODS, ge=0.0, le=0.06
    )
    damping: float = quantity(
        0.05, unit="- of critical", source="illustrative", trials=(0.03, 0.07, 0.15, 0.27), gt=0.0, le=0.3
    )

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"period": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"period": 0.003})
    signature: ClassVar[str] = "a peak of one channel at the frequency of the mount, and less beyond"
    probe: ClassVar[Mapping[str, float]] = MappingProxyType({"period": 0.03, "damping": 0.3})
    fine_trials: ClassVar[Mapping[str, tuple[float, ...]]] = MappingProxyType(
        {"period": FINE_PERIODS, "damping": (0.02, 0.04, 0.07, 0.11, 0.16, 0.22, 0.29)}
    )
    references: ClassVar[tuple[str, ...]] = ("ISO 5348: mechanical mounting of accelerometers",)

    def response(self, frequency: np.ndarray) -> np.ndarray:
        """(f,) of what it is over what it would be without it, at frequencies [Hz]."""
        ratio = frequency * self.period
        return 1.0 / (1.0 - ratio**2 + 2.0j * self.damping * ratio)

    def install(self, setup: Setup) -> Setup:
        """A resonator before the sensor."""
        if self.period == 0.0:
            return setup
        return self.faulty(
            setup, resonance=lambda given: 1.0 / self.period, resonance_damping=lambda given: self.damping
        )
