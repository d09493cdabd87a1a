"""GNSS receiver: speed and position with noise, slow errors, latency and outages."""

from typing import ClassVar, Self

import numpy as np
import pandas as pd
import pydantic

from railsim.sensors.errors import SensorErrors, gauss_markov, sample
from railsim.sensors.interface import Sensor
from railsim.spec import quantity
from railsim.truth import Truth

_OWN = "illustrative"


class Gnss(Sensor, frozen=True):
    """Speed over ground, m/s, and position, m, east (along the start of the track), north and up from its origin.

    `position` is the antenna's: x and y from the bogie's centre along the path and to its left, z above rail level.
    During an outage the values are NaN. The standard deviations are those of the receiver's data sheet; of `errors`
    only `latency` applies.
    """

    speed_std: float = quantity(0.05, unit="m/s", source=_OWN, ge=0)
    position_std: float = quantity(0.5, unit="m, east and north, each sample", source=_OWN, ge=0)
    height_std: float = quantity(1.0, unit="m, each sample", source=_OWN, ge=0)
    drift_std: float = quantity(1.5, unit="m, slow error in east and north, twice that in height", source=_OWN, ge=0)
    drift_correlation_time: float = quantity(60.0, unit="s", source=_OWN, gt=0)
    outages: tuple[tuple[float, float], ...] = quantity((), unit="s, from and to", source="scenario")

    hidden: ClassVar[frozenset[str]] = frozenset({"outages"})
    without: ClassVar[frozenset[str]] = frozenset(SensorErrors.model_fields) - {"latency"}

    @pydantic.model_validator(mode="after")
    def _forward(self) -> Self:
        if any(first >= last for first, last in self.outages):
            raise ValueError("an outage must end after it begins")
        return self

    def channels(self) -> list[str]:
        """Speed, then position."""
        return [f"{self.name}.speed [m/s]", *(f"{self.name}.position_{axis} [m]" for axis in ("east", "north", "up"))]

    def measure(self, truth: Truth, rng: np.random.Generator) -> pd.DataFrame:
        """Sample the antenna's path and the speed, add noise and drift, blank the outages."""
        self.need(truth, "position.east [m]")
        step = self.step(truth)
        noise = [self.speed_std, self.position_std, self.position_std, self.height_std]
        drift = [0.0, self.drift_std, self.drift_std, 2 * self.drift_std]
        columns = []
        signals = [np.abs(truth["speed [m/s]"]), *_antenna(truth, self.position)]
        for signal, white, slow, stream in zip(signals, noise, drift, rng.spawn(4), strict=True):
            values = sample(signal, step, self.errors.latency * truth.rate)
            first, second = stream.spawn(2)
            values = values + white * first.standard_normal(values.size)
            values += gauss_markov(values.size, self.rate, slow, self.drift_correlation_time, second)
            columns.append(values)
        table = self.table(truth, columns)
        for start, end in self.outages:
            table.loc[table["time [s]"].between(start, end, inclusive="left"), self.channels()] = np.nan
        return table


def _antenna(truth: Truth, position: tuple[float, float, float]) -> list[np.ndarray]:
    """East, north and up of a place carried along the path, m; its direction at a standstill is the one before."""
    east, north, up = (truth[f"position.{axis} [m]"] for axis in ("east", "north", "up"))
    if position[0] or position[1]:
        ahead, aside = np.gradient(east), np.gradient(north)
        length = np.hypot(ahead, aside)
        moving = length > 1e-9
        last = np.maximum.accumulate(np.where(moving, np.arange(length.size), -1))
        first = int(np.argmax(moving)) if moving.any() else 0
        last = np.where(last < 0, first, last)
        divisor = np.where(moving, length, 1.0)
        along = np.where(moving, ahead / divisor, 1.0)[last]
        across = np.where(moving, aside / divisor, 0.0)[last]
        east = east + position[0] * along - position[1] * across
        north = north + position[0] * across + position[1] * along
    return [east, north, up + position[2]]
