"""Both axleboxes of one axle: how the centres of its wheels move up and down, over time and over distance."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.signal import resample_poly

from estimators.interface import Estimator, Missing
from estimators.signals.bands import settled
from estimators.signals.channel_health import judge
from estimators.signals.frequency_response import filter_time
from estimators.speed.odometry import Odometry, SpeedSource, missing_speed
from estimators.speed.samples import on_grid
from estimators.vehicle.wheel_on_track import NEEDED
from railsim.data_sheet import DataSheet, data_sheet
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.spec import quantity

SIDES = ("left", "right")
SETTLES = 3.0
"""m around what is lost that is not used either."""
REACH = 2.56
"""Samples of a period up to which a spectrum is used, as analysers do: the rest is the anti-aliasing filter's skirt."""
FINER = 8
"""Times finer before places are interpolated."""
SKIRT = 0.5
"""Share of what the sensor's low-pass takes, in dB, that its data sheet does not tell for sure."""


def channels(axle: int) -> tuple[str, str]:
    """Channels of the vertical accelerations of an axle, left and right."""
    return tuple(f"axlebox{axle}_{side}.acceleration_z [m/s2]" for side in SIDES)  # type: ignore[return-value]


class AxleboxEstimator(Estimator, frozen=True):
    """Base of estimators from both axleboxes of an axle: what they need."""

    speed_source: SpeedSource = quantity("tachometer", unit="-", source="Ward et al. 2011, section 3.1")
    axle: int = quantity(1, unit="number of the axle with the axleboxes", source="scenario", ge=1, le=4)

    requires: ClassVar[tuple[str, ...]] = channels(1)

    def needed(self) -> tuple[str, ...]:
        """Both axleboxes of the axle."""
        return channels(self.axle)

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """What the wheel on its contact needs."""
        return NEEDED

    def missing(self, measurements: Measurements) -> Missing:
        """What is needed and not there, a speed among it."""
        return super().missing(measurements) + missing_speed(measurements, self.speed_source)


class AxleEstimator(AxleboxEstimator, frozen=True):
    """Of these, those that are told how far the track gives way."""

    track_compliance: float = quantity(
        1e-8, unit="m/N of each rail under a wheel", source="50 MN/m and more in service", ge=0.0, le=1e-7
    )
    track_spread: float = quantity(1.0, unit="share of the compliance", source="rigid to twice as soft", ge=0.0, le=1.0)


@dataclass(frozen=True)
class Axle:
    """Vertical accelerations above both contacts of an axle, on an even grid of time.

    Attributes
    ----------
    time : s, shape (n,), delays taken out. rate : Hz.
    acceleration : above the left and right contact, mean taken out, m/s2, shape (2, n).
    good : where samples were measured and lie within the range, shape (n,).
    sheet : of the left sensor.
    noise : density of the noise above a contact, m/s2/sqrt(Hz).
    """

    time: np.ndarray
    rate: float
    acceleration: np.ndarray
    good: np.ndarray
    sheet: DataSheet
    noise: float

    @classmethod
    def of(cls, measurements: Measurements, axle: int) -> "Axle":
        """From the channels of an axle.

        The axle is rigid between its axleboxes: their mean and difference give both contacts' accelerations.

        Raises
        ------
        InputError : both channels have not one rate.
        """
        names = channels(axle)
        rates = {measurements.rate(name) for name in names}
        if len(rates) > 1:
            raise InputError(f"'{names[0]}' and '{names[1]}' have not one rate; resample one of them")
        rate = rates.pop()
        sheets = [data_sheet(measurements.about, name) for name in names]
        found = [on_grid(measurements, name) for name in names]
        count = min(len(values) for values, _ in found)
        left, right = (values[:count] - np.mean(values[:count]) for values, _ in found)
        good = np.logical_and.reduce([there[:count] for _, there in found])
        for (values, _), sheet in zip(found, sheets, strict=True):
            good &= judge(values[:count], rate, sheet)[0]
        apart = sheets[0].position[1] - sheets[1].position[1]
        apart = apart or 2.0 * float(
            measurements.vehicle.get("primary_half_spacing", measurements.vehicle["half_gauge"])
        )
        lever = 2.0 * float(measurements.vehicle["half_gauge"]) / apart
        mean, half = (left + right) / 2.0, (left - right) / 2.0 * lever
        noise = float(np.sqrt((1.0 + lever**2) / 2.0)) * sheets[0].density(rate)
        time = measurements.time(names[0])[0] + np.arange(count) / rate - sheets[0].error("latency")
        return cls(time, rate, np.stack([mean + half, mean - half]), good, sheets[0], noise)

    @property
    def reach(self) -> float:
        """Highest frequency that is used, Hz: where the sensor's low-pass ends, or the samples do."""
        return min(self.sheet.error("bandwidth", np.inf), self.rate / REACH)

    def paths(self, lowest: float) -> np.ndarray:
        """Heights of the wheels' centres above both contacts, m, shape (2, n), from `lowest` Hz up to the reach.

        The acceleration twice integrated, the sensor's low-pass undone as far as the reach.
        """

        def gain(omega: np.ndarray) -> np.ndarray:
            frequency = np.maximum(omega / (2.0 * np.pi), 1e-6)
            low = 1.0 / (1.0 + (lowest / frequency) ** 8)
            high = 0.5 + 0.5 * np.cos(np.pi * np.clip((frequency / self.reach - 1.0) / (0.49 * REACH - 1.0), 0.0, 1.0))
            safe = np.where(high > 0.0, self.sheet.low_pass(omega), 1.0)
            return -low * high / (2.0 * np.pi * frequency) ** 2 / safe

        return np.stack([filter_time(row, self.rate, gain, False) for row in self.acceleration])

    def unsure(self, frequency: np.ndarray) -> np.ndarray:
        """Relative standard deviation of an amplitude by the sensor alone: scale, axes turned, its low-pass."""
        sensor = np.hypot(self.sheet.error("scale_error_std"), self.sheet.error("misalignment_std"))
        skirt = SKIRT * np.abs(np.log(np.abs(self.sheet.low_pass(2.0 * np.pi * frequency))))
        return np.hypot(sensor, skirt)


@dataclass(frozen=True)
class Line:
    """What an axle has passed, on an even grid of distance.

    Attributes
    ----------
    s : distance since the record began, m, shape (m,). spacing : m.
    time : when it was there, s, shape (m,). speed : m/s, shape (m,).
    good : where samples and speed may be used, shape (m,).
    """

    s: np.ndarray
    spacing: float
    time: np.ndarray
    speed: np.ndarray
    good: np.ndarray

    @classmethod
    def of(cls, axle: Axle, odometry: Odometry, spacing: float, reach: float) -> "Line":
        """Grid of an axle's distance; `reach`: m around what is lost or too slow that is not used either."""
        distance = odometry.distance_at(axle.time)
        s = distance[0] + spacing * np.arange(int((distance[-1] - distance[0]) / spacing) + 1)
        moving = np.concatenate([[True], np.diff(distance) > 1e-9])
        time = np.interp(s, distance[moving], axle.time[moving])
        speed = np.interp(time, odometry.knots, odometry.speed_at_knots)
        fast = np.interp(axle.time, odometry.knots, odometry.trusted.astype(float)) > 0.999
        bad = np.interp(s, distance[moving], (~(axle.good & fast)).astype(float)[moving]) > 0.0
        stopped = np.flatnonzero(~moving)
        if stopped.size:
            bad[np.clip(np.searchsorted(s, distance[stopped]), 0, len(s) - 1)] = True
        return cls(s, spacing, time, np.maximum(speed, odometry.slowest), settled(~bad, spacing, reach))

    def at(self, axle: Axle, values: np.ndarray) -> np.ndarray:
        """Values over the axle's time, shape (..., n), at the places of the grid, shape (..., m)."""
        fine = resample_poly(values, FINER, 1, axis=-1)
        time = axle.time[0] + np.arange(fine.shape[-1]) / (FINER * axle.rate)
        return np.stack([np.interp(self.time, time, row) for row in fine])
