"""Stretches of a record in which one linear vehicle may be fitted, as Fourier coefficients of readings and track.

A stretch is left out, and said to be, where the model does not hold or nothing is known: speed lost (standstill, wheel
slide, gaps) or under `SLOWEST`, and curves. A curve counts as one where a wheelset on the nominal cones needs a shift
of more than 3 mm (`LARGEST_SHIFT`) to roll round it: y = r l / (lambda R) (Redtenbacher 1855; Wickens 2003, 2.6).
"""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d
from scipy.signal import butter, sosfreqz

from estimators.signals.channel_health import runs
from estimators.suspension.observations import SuspensionRecord
from estimators.vehicle.parameters import Parameters
from railsim.measurements import Measurements

LARGEST_SHIFT = 0.003  # m, the shift over which conicity is stated (EN 15302)
YAW_RATE = "bogie.rate_yaw [rad/s]"
CURVE_WINDOW = 3.0  # s, over which the yaw rate is averaged: longer than bogies yaw by themselves (choice)
SLOWEST = 5.0  # m/s, as of the other estimators
SHORTEST = 8.0  # s; shorter, the width of a spectral line reaches that of the body's lateral modes (choice)
LONGEST = 60.0  # s
VARYING = 0.15  # of the speed within a stretch, where it can be halved for it (choice)
MOST_VARYING = 0.5  # of the speed within a stretch; with more it is left out (choice)
SLOW, CURVE, CHANGING, SHORT = (
    "speed under 5 m/s or not known",
    "curve too tight for the linear vehicle",
    "speed changes too fast",
    "too short",
)


class Stretch(NamedTuple):
    """A stretch of the record in the frequency domain; k frequencies, m readings, w motions of rails.

    Attributes
    ----------
    ends : first time and last, s. speed : mean, m/s. used : indices of the channels, m of them.
    frequency : Hz, shape (k,). readings, rails : one-sided amplitudes per root Hz, shapes (k, m), (k, w).
    """

    ends: tuple[float, float]
    speed: float
    used: tuple[int, ...]
    frequency: np.ndarray
    readings: np.ndarray
    rails: np.ndarray


class Gate(NamedTuple):
    """A reason why samples are left out.

    Attributes
    ----------
    reason : in words. where : shape (n,).
    """

    reason: str
    where: np.ndarray


def gates(measurements: Measurements, record: SuspensionRecord, p: Parameters) -> list[Gate]:
    """What no model holds for, from the recording itself."""
    slow = ~(np.nan_to_num(record.speed, nan=0.0) >= SLOWEST)
    limit = p["design_conicity"] * LARGEST_SHIFT / (p["half_gauge"] * p["wheel_radius"])
    time, rate = measurements.time(YAW_RATE), measurements[YAW_RATE]
    known = np.isfinite(rate)
    if not known.any():
        return [Gate(SLOW, slow)]
    count = max(1, round(CURVE_WINDOW * record.rate))
    turning = np.interp(record.time, time[known], rate[known])
    turning = uniform_filter1d(turning, count, mode="nearest")
    bent = np.abs(turning) > limit * np.where(slow, np.inf, record.speed)
    wide = maximum_filter1d(bent.astype(float), 2 * count + 1, mode="nearest") > 0.0
    return [Gate(SLOW, slow), Gate(CURVE, wide & ~slow)]


def used_channels(record: SuspensionRecord, open_: np.ndarray) -> tuple[int, ...]:
    """Channels whose gaps do not cost more of the record than half of what all of them leave."""
    used = list(range(len(record.channels)))
    while len(used) > 1:
        left = _length(record, open_, used)
        without = [_length(record, open_, [one for one in used if one != other]) for other in used]
        best = int(np.argmax(without))
        if without[best] < 2 * left or without[best] == 0:
            break
        del used[best]
    return tuple(used)


def stretches(
    record: SuspensionRecord, closed: Sequence[Gate], band: tuple[float, float], passed: tuple[float, float]
) -> tuple[list[Stretch], list[dict[str, Any]]]:
    """Stretches, and what was left out, as `about["left_out"]` states it.

    Parameters
    ----------
    band : frequencies that are fitted, Hz. passed : corners of the band-pass that the record went through, Hz.
    """
    open_ = ~np.any([gate.where for gate in closed], axis=0)
    used = used_channels(record, open_)
    good = open_ & record.good[:, list(used)].all(axis=1)
    left_out = [_out(record, gate.reason, *ends) for gate in closed for ends in runs(gate.where)]
    found = []
    for first, last in runs(good):
        for ends in _parts(record, first, last):
            reason = _refused(record, *ends)
            if reason:
                left_out.append(_out(record, reason, *ends))
            else:
                found.append(transformed(record, used, *ends, band, passed))
    return found, left_out


def _length(record: SuspensionRecord, open_: np.ndarray, used: Sequence[int]) -> int:
    """Samples in runs that are long enough."""
    good = open_ & record.good[:, list(used)].all(axis=1)
    return sum(last - first for first, last in runs(good) if last - first >= SHORTEST * record.rate)


def _parts(record: SuspensionRecord, first: int, last: int) -> Iterable[tuple[int, int]]:
    """Halves of halves, until the speed is steady enough in each and none is too long."""
    seconds = (last - first) / record.rate
    if seconds > LONGEST or (seconds >= 2 * SHORTEST and _variation(record, first, last) > VARYING):
        middle = (first + last) // 2
        yield from _parts(record, first, middle)
        yield from _parts(record, middle, last)
    else:
        yield first, last


def _variation(record: SuspensionRecord, first: int, last: int) -> float:
    speed = record.speed[first:last]
    return float((speed.max() - speed.min()) / speed.mean())


def _refused(record: SuspensionRecord, first: int, last: int) -> str:
    if last - first < SHORTEST * record.rate:
        return SHORT
    return CHANGING if _variation(record, first, last) > MOST_VARYING else ""


def _out(record: SuspensionRecord, reason: str, first: int, last: int) -> dict[str, Any]:
    start, end = float(record.time[first]), float(record.time[last - 1]) + 1.0 / record.rate
    return {"channel": "all", "reason": reason, "start [s]": round(start, 3), "end [s]": round(end, 3)}


def transformed(
    record: SuspensionRecord,
    used: tuple[int, ...],
    first: int,
    last: int,
    band: tuple[float, float],
    passed: tuple[float, float],
) -> Stretch:
    """Under a Hann window; the band-pass that readings and track went through is taken out again."""
    count = last - first
    window = np.hanning(count)
    frequency = np.fft.rfftfreq(count, 1.0 / record.rate)
    chosen = (frequency >= band[0]) & (frequency <= band[1])
    sections = np.asarray(butter(2, passed, btype="bandpass", fs=record.rate, output="sos"))
    through = np.asarray(sosfreqz(sections, frequency[chosen], fs=record.rate)[1])
    scale = np.sqrt(2.0 / record.rate / np.sum(window**2))

    def amplitude(values: np.ndarray) -> np.ndarray:
        values = (values - values.mean(axis=0)) * window[:, None]
        return np.fft.rfft(values, axis=0)[chosen] * scale / through[:, None]

    rails = record.inputs[first:last, : record.inputs.shape[1] // 2]
    ends = float(record.time[first]), float(record.time[last - 1])
    speed = float(record.speed[first:last].mean())
    readings = amplitude(record.readings[first:last][:, list(used)])
    return Stretch(ends, speed, used, frequency[chosen], readings, amplitude(rails))
