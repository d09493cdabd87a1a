"""Data sheet of a channel's sensor, as about.json states it; what is not stated counts as no error and no delay."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot, pi, sin, sqrt
from typing import Any

import numpy as np

from railsim.measurements import Measurements
from railsim.sensors.errors import low_pass

ORDER = 2
"""Of a Butterworth low-pass whose corner alone is stated."""


@dataclass(frozen=True)
class DataSheet:
    """What is stated of one channel's sensor.

    Attributes
    ----------
    stated : the sensor's entry in about.json; empty where no sensor states the channel.
    """

    stated: Mapping[str, Any]

    @property
    def kind(self) -> str:
        """Kind of the sensor; "" where it is not stated."""
        return str(self.stated.get("kind", ""))

    @property
    def position(self) -> tuple[float, float, float]:
        """Place on the body, m from its centre of gravity, body axes; the centre where it is not stated."""
        position = self.stated.get("position")
        if not isinstance(position, list | tuple) or len(position) != 3:
            return 0.0, 0.0, 0.0
        return float(position[0]), float(position[1]), float(position[2])

    def states(self, name: str) -> bool:
        """Whether a number is given for an error, by its name in `railsim.sensors.errors.SensorErrors`."""
        errors = self.stated.get("errors")
        return isinstance(errors, Mapping) and isinstance(errors.get(name), int | float)

    def error(self, name: str, default: float = 0.0) -> float:
        """An error by its name, unit of `SensorErrors`; `default` where no number is given."""
        return float(self.stated["errors"][name]) if self.states(name) else default

    def density(self, rate: float) -> float:
        """One-sided density of the noise of samples at `rate` Hz, rounding included, unit of the channel / sqrt(Hz)."""
        return hypot(self.error("noise_density"), self.error("resolution") / sqrt(6.0 * rate))

    def variance(self, rate: float) -> float:
        """Variance of a sample at `rate` Hz: noise and rounding, unit of the channel squared."""
        return self.error("noise_density") ** 2 * rate / 2.0 + self.error("resolution") ** 2 / 12.0

    @property
    def delay(self) -> float:
        """Delay of slow signals, s: latency and 1 / (w sin(pi / 2 n)) of a Butterworth low-pass (corner w, order n)."""
        corner, order = self.error("bandwidth"), self.error("bandwidth_order", ORDER)
        filtered = 1.0 / (2.0 * pi * corner * sin(pi / (2.0 * order))) if corner else 0.0
        return self.error("latency") + filtered

    def low_pass(self, omega: np.ndarray) -> np.ndarray:
        """Response of the low-pass at angular frequencies, rad/s, without the latency; 1 where none is stated."""
        corner = self.error("bandwidth")
        if not corner:
            return np.ones_like(omega)
        return low_pass(omega, corner, round(self.error("bandwidth_order", ORDER)))


def data_sheet(about: Mapping[str, Any], channel: str) -> DataSheet:
    """Data sheet of a channel from what about.json holds; an empty one where no sensor states the channel."""
    sheets = (sheet for sheet in about.get("sensors", ()) if channel in sheet.get("channels", ()))
    return DataSheet(next(sheets, {}))


def channels_on(measurements: Measurements, body: str, quantity: str) -> list[str]:
    """Channels whose sensor stands on a body and whose quantity begins with `quantity`, for example "rate_yaw".

    Where no data sheet tells the body, the sensor's name does.
    """
    names = []
    for name in measurements.channels:
        sensor, _, what = name.partition(".")
        if what.startswith(quantity) and data_sheet(measurements.about, name).stated.get("body", sensor) == body:
            names.append(name)
    return names
