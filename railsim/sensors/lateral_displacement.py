"""Displacement transducer that measures how far one body stands to the left of another."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

import numpy as np
import pandas as pd

from railsim.sensors.displacement import TRANSDUCER
from railsim.sensors.errors import SensorErrors
from railsim.sensors.interface import Sensor
from railsim.spec import quantity
from railsim.truth import Truth


class LateralDisplacement(Sensor, frozen=True):
    """y of `body` less y of `other`, both in the track frame, m; positive where `body` stands to the left.

    On a vehicle whose bodies are at different distances (half vehicle) `arm` is where the transducer stands before
    the centre of `body`: its yaw counts there.
    """

    body: str = quantity("body", unit="-", source="scenario")
    other: str = quantity("wheelset1", unit="-", source="scenario")
    arm: float = quantity(0.0, unit="m before the centre of `body`", source="scenario")

    presets: ClassVar[Mapping[str, SensorErrors]] = MappingProxyType({"transducer": TRANSDUCER})
    without: ClassVar[frozenset[str]] = frozenset({"misalignment", "misalignment_std"})

    def channels(self) -> list[str]:
        """One column."""
        return [f"{self.name}.displacement [m]"]

    def measure(self, truth: Truth, rng: np.random.Generator) -> pd.DataFrame:
        """Pass the difference through the error model."""
        own, other = f"{self.body}.y [m]", f"{self.other}.y [m]"
        self.need(truth, own)
        self.need(truth, other)
        apart = truth[own] - truth[other]
        if self.arm:
            apart = apart + self.arm * truth[f"{self.body}.yaw [rad]"]
        instants = self.instants(truth, rng)
        return self.table(truth, [self.errors.apply(apart, truth.rate, self.step(truth), rng, instants)])
