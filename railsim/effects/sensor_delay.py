"""Sensor whose samples come late."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from railsim.effects.interface import CHOSEN, Setup
from railsim.effects.sensor_changes import FilterEffect
from railsim.spec import quantity

TRIALS = (*np.geomspace(0.001, 0.02, 10), *np.arange(0.025, 1.0, 0.01))
"""s; a channel is like itself a little later only within a part of a turn of its loudest wave."""


class SensorDelay(FilterEffect, frozen=True):
    """One channel later than its time stamps by `delay`."""

    delay: float = quantity(0.02, unit="s", source=CHOSEN, trials=TRIALS, ge=0.0, le=0.5)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"delay": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"delay": 0.002})
    signature: ClassVar[str] = "phase of one channel against the others falls in proportion to the frequency"
    probe: ClassVar[Mapping[str, float]] = MappingProxyType({"delay": 0.002})
    references: ClassVar[tuple[str, ...]] = ("IEEE Std 1451: time stamps",)

    def response(self, frequency: np.ndarray) -> np.ndarray:
        """(f,) of what it is over what it would be without it, at frequencies [Hz]."""
        return np.exp(-2j * np.pi * frequency * self.delay)

    def install(self, setup: Setup) -> Setup:
        """More latency."""
        return self.faulty(setup, latency=lambda given: given + self.delay)
