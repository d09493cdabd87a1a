"""Displacement transducer across a suspension element."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

import numpy as np
import pandas as pd

from railsim.errors import InputError
from railsim.sensors.errors import SensorErrors
from railsim.sensors.interface import Sensor
from railsim.spec import quantity
from railsim.truth import Truth

ENDING = ".displacement [m]"
"""Of a channel's name, after the element."""

TRANSDUCER = SensorErrors(
    range=0.05,  # illustrative: stroke of 100 mm
    resolution=1.5e-6,  # illustrative: 16 bits over the stroke
    noise_density=1e-6,  # illustrative
    bias_std=2e-4,  # illustrative: zero set by hand
    scale_error_std=0.0025,  # illustrative: linearity 0.25 %
    bandwidth=100.0,  # illustrative, for samples at 256 Hz
)


class Displacement(Sensor, frozen=True):
    """Change of length of a suspension element, m, 0 at static rest, extension positive."""

    body: str = quantity("bogie", unit="-", source="scenario")
    across: str | None = quantity(None, unit="element; the sensor's name if not given", source="scenario")

    presets: ClassVar[Mapping[str, SensorErrors]] = MappingProxyType({"transducer": TRANSDUCER})
    without: ClassVar[frozenset[str]] = frozenset({"misalignment", "misalignment_std"})

    @property
    def element(self) -> str:
        """Across which it is."""
        return self.across or self.name

    @property
    def channel(self) -> str:
        """What it measures, as the truth names it."""
        return self.element + ENDING

    def channels(self) -> list[str]:
        """One column."""
        return [self.name + ENDING]

    def measure(self, truth: Truth, rng: np.random.Generator) -> pd.DataFrame:
        """Pass the element's change of length through the error model."""
        if self.channel not in truth:
            known = ", ".join(name.removesuffix(ENDING) for name in truth.columns if name.endswith(ENDING))
            raise InputError(
                f"sensor '{self.name}': the run has no element '{self.element}'; "
                f'give "across", one of: {known or "none"}'
            )
        self.need(truth, self.channel)
        instants = self.instants(truth, rng)
        return self.table(truth, [self.errors.apply(truth[self.channel], truth.rate, self.step(truth), rng, instants)])
