"""What the suspension estimators read of a recording: readings, known track and speed on one grid of time.

Readings and the known track pass the same band-pass: what is constant (bias, tilted mounting) goes, and what is faster
than the model can be trusted. Because the model is linear and does not change, its equations hold for what is left.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfilt, sosfilt_zi

from estimators.signals.channel_health import Health, channel_health, runs
from estimators.speed.odometry import Odometry, integrate_speed
from estimators.vehicle.affine import INPUTS
from railsim.data_sheet import data_sheet
from railsim.errors import InputError
from railsim.measurements import Measurements

EAST, NORTH = "gnss.position_east [m]", "gnss.position_north [m]"
ASIDE = 1.0  # m; on a path that has left its first line by so much, way and easting differ by 2 cm at most (R >= 400 m)
POSITION_ERROR = 0.2  # m; with a larger one the known track stands wrong under the wheels
NO_PLACE = (
    f"a measured track and the place on it to 0.2 m: add track.csv and an RTK receiver ('{EAST}') or --start M; or take"
    " --set track=unknown"
)
"""What is missing where the track is used and the place on it is not known, and how to give it."""
LONGEST_BRIDGE = 0.03  # s of bad samples that leave nothing behind in the band-pass (illustrative)
AFTER = 2.0  # s after a longer one in which a channel is left out (chosen on suspension.yaml with gaps)
LONGEST_GAP = 30.0  # s; a longer gap counts as this long: the filters have forgotten everything by then


@dataclass(frozen=True)
class SuspensionRecord:
    """Samples on a grid of time without gaps.

    Attributes
    ----------
    time : s, shape (n,). rate : Hz.
    channels : names of the readings.
    readings : after the band-pass, shape (n, m). good : which of them may be used, shape (n, m).
    noise : standard deviation of a sample by its data sheet, shape (m,).
    speed : m/s, NaN where it is not known, shape (n,).
    inputs : known track as `vehicle.affine.INPUTS`, after the band-pass, zero where nothing is known, shape (n, 8);
        for w wheelsets in place of two, shape (n, 4 w).
    later : the same, a sample later.
    health : what was left out, and why.
    """

    time: np.ndarray
    rate: float
    channels: tuple[str, ...]
    readings: np.ndarray
    good: np.ndarray
    noise: np.ndarray
    speed: np.ndarray
    inputs: np.ndarray
    later: np.ndarray
    health: Health


def read(
    measurements: Measurements,
    channels: Sequence[str],
    band: tuple[float, float],
    known_track: bool,
    start: float | None,
    every: int = 1,
    ahead: Sequence[float] | None = None,
) -> SuspensionRecord:
    """Read a recording.

    Parameters
    ----------
    channels : those that are wanted; what is missing or dead is left out.
    band : corners of the band-pass, Hz.
    known_track : whether the recording's track is used.
    start : distance of the bogie's centre at the first sample, m; None: by GNSS.
    every : one of so many samples is kept, after the band-pass.
    ahead : of wheelsets before the bogie's centre, m; the two of the leading bogie where None.

    Raises
    ------
    InputError : none of the channels can be used, their rates differ, no speed, or no track or place where needed.
    """
    health = channel_health(measurements, channels)
    used = tuple(health.channels)
    if not used:
        raise InputError(f"none of the channels {', '.join(channels)} can be used; check the sensors")
    rates = {measurements.rate(name) for name in used}
    if len(rates) > 1:
        raise InputError(f"'{used[0]}' and others differ in sample rate ({sorted(rates)} Hz); resample them to one")
    rate = rates.pop()
    stamps = measurements.time(used[0])
    steps = np.clip(np.rint(np.diff(stamps) * rate), 1, LONGEST_GAP * rate).astype(np.int64)
    rows = np.concatenate([[0], np.cumsum(steps)])
    time = np.interp(np.arange(rows[-1] + 1), rows, stamps)
    raw, good = np.full((len(time), len(used)), np.nan), np.zeros((len(time), len(used)), dtype=bool)
    for column, name in enumerate(used):
        good[rows, column] = health.good[name]
        raw[rows, column] = measurements[name]
    late = float(np.mean([data_sheet(measurements.about, name).delay for name in used]))
    odometry = integrate_speed(measurements)
    inputs = np.zeros((len(time), len(INPUTS) if ahead is None else 4 * len(ahead)))
    if known_track:
        arm = float(measurements.vehicle["semi_wheelbase"])
        distance = _distance(measurements, odometry, time - late, start)
        inputs = _rails(measurements, distance, rate, (arm, -arm) if ahead is None else ahead)
    sections = np.asarray(butter(2, band, btype="bandpass", fs=rate, output="sos"))
    noise = np.array([_noise(measurements, name, rate) for name in used])
    settled = np.column_stack([_settled(one, rate) for one in good.T])
    health = _with_settling(health, used, good & ~settled, time)
    filtered = np.column_stack([_filtered(sections, raw[:, j], good[:, j]) for j in range(len(used))])
    inputs = np.column_stack([_filtered(sections, one, np.ones(len(time), dtype=bool)) for one in inputs.T])
    trusted = np.interp(time, odometry.knots, odometry.trusted.astype(float)) > 0.99
    speed = np.where(trusted, np.interp(time, odometry.knots, odometry.speed_at_knots), np.nan)
    whole = len(time) // every * every
    good = np.asarray(settled[:whole].reshape(whole // every, every, -1).all(axis=1))
    time, filtered, speed, inputs = (one[:whole:every] for one in (time, filtered, speed, inputs))
    later = np.concatenate([inputs[1:], inputs[-1:]])
    return SuspensionRecord(
        time, rate / every, used, filtered, good, noise / np.sqrt(every), speed, inputs, later, health
    )


def can_locate(measurements: Measurements) -> bool:
    """Whether the track is measured, and the place on it to centimetres (RTK), by what about.json says."""
    if measurements.track is None or EAST not in measurements:
        return False
    sheet = measurements.sensor(EAST)
    return float(np.hypot(sheet.get("position_std", 1.0), sheet.get("drift_std", 1.0))) <= POSITION_ERROR


def straight_positions(measurements: Measurements) -> np.ndarray:
    """Positions that tell the way along the track: those on its first straight line, which goes east, shape (n,)."""
    east = measurements[EAST]
    north = measurements[NORTH] if NORTH in measurements else np.zeros(len(east))
    finite = np.isfinite(east) & np.isfinite(north)
    left = np.flatnonzero(finite & (np.abs(north) > ASIDE))
    return finite & (np.arange(len(east)) < (left[0] if len(left) else len(east)))


def _noise(measurements: Measurements, name: str, rate: float) -> float:
    return math.sqrt(data_sheet(measurements.about, name).variance(rate))


def _distance(measurements: Measurements, odometry: Odometry, time: np.ndarray, start: float | None) -> np.ndarray:
    """Distance of the bogie's centre along the track, m, shape (n,)."""
    travelled = odometry.distance_at(time)
    if start is not None:
        return start + travelled
    if EAST not in measurements:
        raise InputError(f"the place on the track is not known; add '{EAST}', or give the distance 'start' in m")
    east, at = measurements[EAST], measurements.time(EAST)
    straight = straight_positions(measurements)
    if straight.sum() < 2:
        raise InputError(f"'{EAST}' has fewer than two samples on straight track; give the distance 'start' in m")
    scale, offset = np.polyfit(odometry.distance_at(at[straight]), east[straight], 1)
    return offset - data_sheet(measurements.about, EAST).position[0] + scale * travelled


def _rails(measurements: Measurements, distance: np.ndarray, rate: float, ahead: Sequence[float]) -> np.ndarray:
    """The known track under w wheelsets, shape (n, 4 w)."""
    track = measurements.track
    if track is None:
        raise InputError("the recording has no measured track; set track to 'unknown'")
    half = float(measurements.vehicle["half_gauge"])
    s = track["s [m]"].to_numpy(dtype=float)
    side = CubicSpline(s, _column(track, "lateral", "left_lateral", "right_lateral", 0.5, 0.5))
    roll = CubicSpline(
        s,
        (_column(track, "", "left_vertical", "right_vertical", 1.0, -1.0) - _column(track, "cross_level"))
        / (2.0 * half),
    )
    rates = roll.derivative(), side.derivative()
    speed = np.gradient(distance) * rate
    ends = [np.clip(distance + one, s[0], s[-1]) for one in ahead]
    values, changes = (
        [one(end) for one in (side, roll) for end in ends],
        [speed * one(end) for one in rates for end in ends],
    )
    return np.column_stack([*values, *changes])


def _column(
    track: pd.DataFrame, whole: str, left: str = "", right: str = "", share: float = 0.0, other: float = 0.0
) -> np.ndarray:
    total = np.zeros(len(track))
    for name, factor in ((whole, 1.0), (left, share), (right, other)):
        if name and f"{name} [m]" in track.columns:
            total += factor * track[f"{name} [m]"].to_numpy(dtype=float)
    return total


def _filtered(sections: np.ndarray, values: np.ndarray, good: np.ndarray) -> np.ndarray:
    """Band-pass, at rest at the first good value; a straight line takes the place of bad samples."""
    if not good.any():
        return np.zeros(len(values))
    at = np.arange(len(values))
    bridged = np.interp(at, at[good], values[good])
    return sosfilt(sections, bridged, zi=sosfilt_zi(sections) * bridged[0])[0]


def _settled(good: np.ndarray, rate: float) -> np.ndarray:
    """Samples that are good and were for a while: for so long the band-pass shows what a bridge of bad ones was not."""
    long = np.zeros(len(good), dtype=bool)
    for first, end in runs(~good):
        long[first:end] = end - first > LONGEST_BRIDGE * rate and first > 0
    return good & ~_spread_after(long, round(AFTER * rate))


def _with_settling(health: Health, used: Sequence[str], marks: np.ndarray, time: np.ndarray) -> Health:
    """What else was left out while the band-pass settled, said like the rest."""
    settling = [
        {
            "channel": name,
            "reason": "settling after that",
            "start [s]": round(float(time[first]), 6),
            "end [s]": round(float(time[end - 1] + time[1] - time[0]), 6),
        }
        for column, name in enumerate(used)
        for first, end in runs(marks[:, column])
    ]
    return Health(health.good, [*health.left_out, *settling])


def _spread_after(marks: np.ndarray, count: int) -> np.ndarray:
    """Flags that are true for `count` samples after a true one."""
    at = np.arange(len(marks))
    last = np.maximum.accumulate(np.where(marks, at, -count - 1))
    return at - last <= count
