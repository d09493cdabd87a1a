"""Channels of a recording as the creep force filter takes them: one grid, high-passed alike, the bad ones left out.

Every signal goes through the same second-order high-pass. Filter and model are linear, so that the forces come out as
the same high-pass leaves them: without the sensors' biases, and without what a curve adds over seconds.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.signal import bilinear, lfilter

from estimators.adhesion.bogie_place import HALF, BogiePlace
from estimators.adhesion.creep_model import BODIES, COUNT, ROLL_BODIES, Floating
from estimators.speed.odometry import LONGEST_STEP, SpeedSource, integrate_speed
from railsim.constants import GRAVITY
from railsim.data_sheet import data_sheet
from railsim.errors import InputError
from railsim.measurements import Measurements

RATE = 256.0  # Hz, of the grid
WHEELSETS = ("wheelset1", "wheelset2")
ACCELERATION, YAW, ROLL = "acceleration_y", "rate_yaw", "rate_roll"
ACCELERATION_ERROR = 0.01  # m/s2: what the plan view leaves out (illustrative)
RATE_ERROR = 1e-4  # rad/s, as above
UNKNOWN_ROLL = 2e-3  # rad: roll of a body without roll gyro

Good = Mapping[str, np.ndarray]
"""By channel that is there: which of its samples may be believed, shape as the channel."""


class SensorPlacement(NamedTuple):
    """Body of a sensor, whether it shows yaw rate or else lateral acceleration, and how far before the centre, m."""

    body: str
    turning: bool
    ahead: float


@dataclass(frozen=True)
class LateralRecord:
    """What the filter takes.

    Attributes
    ----------
    time : of the grid, s, (n,). speed : m/s, (n,), NaN where it is not measured or too low.
    names : channels in use, (c,). placements : where they are, (c,).
    samples : high-passed, NaN where left out, (n, c). R : variances, (c,).
    inputs : rolls of the bodies, then their rates, high-passed, (n, 8).
    place : the bogie. corner : of the high-pass, Hz.
    """

    time: np.ndarray
    speed: np.ndarray
    names: tuple[str, ...]
    placements: tuple[SensorPlacement, ...]
    samples: np.ndarray
    R: np.ndarray
    inputs: np.ndarray
    place: BogiePlace = HALF
    corner: float = 0.3

    def observation(self, model: Floating) -> tuple[np.ndarray, np.ndarray]:
        """What the channels show of the states (c, states) and of the inputs (c, 8)."""
        H = np.zeros((len(self.placements), len(model.A)))
        D = np.zeros((len(self.placements), self.inputs.shape[1]))
        for row, (body, turning, ahead) in enumerate(self.placements):
            y, yaw = BODIES[body]
            if not turning:
                H[row], D[row] = model.acceleration[y], model.acceleration_input[y]
            if yaw is not None and turning:
                H[row, COUNT + yaw] = 1.0
            elif yaw is not None:
                H[row] += ahead * model.acceleration[yaw]
                D[row] += ahead * model.acceleration_input[yaw]
        return H, D


def used_channels(measurements: Measurements, bodies: Sequence[str], place: BogiePlace = HALF) -> list[str]:
    """Every lateral accelerometer, yaw and roll gyro on these bodies of a bogie."""
    quantities = {body: (ACCELERATION, ROLL) if body == "body" else (ACCELERATION, YAW, ROLL) for body in bodies}
    return [
        name
        for body in bodies
        for quantity in quantities[body]
        for name in place.channels(measurements, body, quantity)
    ]


def has_all(measurements: Measurements, names: Iterable[str], bodies: Sequence[str], place: BogiePlace = HALF) -> bool:
    """Whether each of these bodies has a lateral accelerometer, and but for the car body a yaw and a roll gyro."""
    there = set(names)
    return all(
        there & set(place.channels(measurements, body, quantity))
        for body in bodies
        for quantity in ((ACCELERATION,) if body == "body" else (ACCELERATION, YAW, ROLL))
    )


def read(
    measurements: Measurements,
    bodies: Sequence[str],
    good: Good,
    corner: float,
    source: SpeedSource,
    place: BogiePlace = HALF,
    time: np.ndarray | None = None,
) -> LateralRecord:
    """The record of one bogie on a grid of 256 Hz.

    Parameters
    ----------
    bodies : whose sensors are used, of `BODIES`.
    good : samples that may be believed; a channel that is not in it is left out.
    corner : of the high-pass, Hz. source : of the speed.
    place : the bogie. time : the grid, s; by `grid` of these channels where None.

    Raises
    ------
    InputError : less than two seconds of record, no speed, no channel that can be used.
    """
    names = [name for name in used_channels(measurements, bodies, place) if name in good]
    if not names:
        raise InputError(
            f"no lateral accelerometer or gyro on {', '.join(place.bodies[one] for one in bodies)}; add one"
        )
    time = grid(measurements, names) if time is None else time
    odometry = integrate_speed(measurements, source)
    speed = np.interp(time, odometry.knots, np.where(odometry.trusted, odometry.speed_at_knots, np.nan))
    usable = Usable(measurements, {name: good[name] for name in names}, place, time, corner)
    inputs, known = _rolls(usable, bodies)
    rows: list[tuple[str, np.ndarray, SensorPlacement, float]] = []
    for body in bodies:
        spin = np.gradient(inputs[:, len(ROLL_BODIES) + ROLL_BODIES.index(body)], 1.0 / RATE)
        error = float(np.hypot(ACCELERATION_ERROR, 0.0 if known[body] else GRAVITY * UNKNOWN_ROLL))
        for name in usable.on(body, ACCELERATION):
            values = usable.filtered(name)
            ahead, _, above = data_sheet(measurements.about, name).position
            rows.append(
                (name, values + above * spin, SensorPlacement(body, False, ahead), _variance(measurements, name, error))
            )
        for name in usable.on(body, YAW) if body != "body" else []:
            values = usable.filtered(name)
            rows.append((name, values, SensorPlacement(body, True, 0.0), _variance(measurements, name, RATE_ERROR)))
    kept, samples, placements, variances = zip(*rows, strict=True)
    stacked = np.ascontiguousarray(np.stack(samples, axis=1))
    return LateralRecord(
        time, speed, tuple(kept), tuple(placements), stacked, np.array(variances), inputs, place, corner
    )


@dataclass(frozen=True)
class Usable:
    """Channels of a bogie that can be used.

    Attributes
    ----------
    good : their samples that may be believed. time : of the grid, s, (n,). corner : of the high-pass, Hz.
    """

    measurements: Measurements
    good: Good
    place: BogiePlace
    time: np.ndarray
    corner: float

    def on(self, body: str, quantity: str) -> list[str]:
        """Channels on one of the filter's bodies."""
        return [name for name in self.place.channels(self.measurements, body, quantity) if name in self.good]

    def filtered(self, name: str, integrate: bool = False) -> np.ndarray:
        """On the grid and high-passed; what is lost is bridged for the high-pass and is NaN after it."""
        values = _resampled(self.measurements, name, self.good, self.time)
        there = np.isfinite(values)
        if not there.any():
            return values
        bridged = np.interp(self.time, self.time[there], values[there])
        return np.where(there, high_pass(bridged, self.corner, integrate), np.nan)


def high_pass(values: np.ndarray, corner: float, integrate: bool = False, rate: float = RATE) -> np.ndarray:
    """s^2 / (s^2 + sqrt(2) w s + w^2) of the samples, or of their integral; at rest at the first value."""
    b, a = _designed(corner, integrate, rate)
    return np.asarray(lfilter(b, a, values - values[0]))


@lru_cache(maxsize=16)
def _designed(corner: float, integrate: bool, rate: float) -> tuple[np.ndarray, np.ndarray]:
    w = 2.0 * np.pi * corner
    b, a = bilinear([1.0, 0.0] if integrate else [1.0, 0.0, 0.0], [1.0, np.sqrt(2.0) * w, w * w], rate)
    return np.asarray(b), np.asarray(a)


def grid(measurements: Measurements, names: Sequence[str]) -> np.ndarray:
    """Times of 256 Hz that all of these channels have in common, s.

    Raises
    ------
    InputError : they are less than two seconds.
    """
    start = max(float(measurements.time(name)[0]) for name in names if len(measurements.time(name)))
    end = min(float(measurements.time(name)[-1]) for name in names if len(measurements.time(name)))
    if not end - start >= 2.0:
        raise InputError(f"the channels have {max(end - start, 0.0):.2f} s in common; give at least 2 s of record")
    return start + np.arange(int((end - start) * RATE) + 1) / RATE


def _resampled(measurements: Measurements, name: str, good: Good, time: np.ndarray) -> np.ndarray:
    """The channel on the grid without the delay of its filter, NaN where it is lost or bad."""
    own, values = measurements.time(name) - data_sheet(measurements.about, name).delay, np.asarray(measurements[name])
    trusted = np.isfinite(values) & np.asarray(good[name])
    if trusted.sum() < 2:
        return np.full(len(time), np.nan)
    step = 1.0 / measurements.rate(name)
    filled = np.interp(own, own[trusted], values[trusted])
    if step < 0.75 / RATE:  # mean over a cell of the grid, against aliasing
        total = np.concatenate([[0.0], np.cumsum((filled[1:] + filled[:-1]) / 2 * np.diff(own))])
        half = 0.5 / RATE
        resampled = (np.interp(time + half, own, total) - np.interp(time - half, own, total)) * RATE
    else:
        resampled = np.interp(time, own, filled)
    apart = np.diff(own[trusted], prepend=own[trusted][0])
    late = np.searchsorted(own[trusted], time).clip(1, len(apart) - 1)
    longest = max(2.5 * step, 1.5 / RATE)
    lost = (apart[late] > longest) | (time < own[trusted][0] - LONGEST_STEP) | (time > own[trusted][-1] + LONGEST_STEP)
    return np.where(lost, np.nan, resampled)


def _rolls(usable: Usable, bodies: Sequence[str]) -> tuple[np.ndarray, dict[str, bool]]:
    """Rolls and roll rates of all bodies (n, 8), where a body's own is lost the bogie's, and who has a gyro at all."""
    count = len(usable.time)
    rolls = np.zeros((count, 2 * len(ROLL_BODIES)))
    known = {}
    spare = np.zeros((count, 2))
    for body in sorted(ROLL_BODIES, key=lambda one: one != "bogie"):
        values = np.full((count, 2), np.nan)
        for name in usable.on(body, ROLL) if body in bodies else []:
            pair = [usable.filtered(name, integrate) for integrate in (True, False)]
            values = np.where(np.isfinite(values), values, np.stack(pair, axis=1))
        known[body] = bool(np.isfinite(values).any())
        values = np.where(np.isfinite(values), values, spare if body != "bogie" else 0.0)
        spare = values if body == "bogie" else spare
        column = ROLL_BODIES.index(body)
        rolls[:, column], rolls[:, len(ROLL_BODIES) + column] = values[:, 0], values[:, 1]
    return rolls, known


def _variance(measurements: Measurements, name: str, error: float) -> float:
    """Of a sample on the grid: noise by the data sheet, and what the model leaves out."""
    return data_sheet(measurements.about, name).variance(min(RATE, measurements.rate(name))) + error**2
