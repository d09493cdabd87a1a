"""Which samples of a channel may be believed: not lost, not stuck, not saturated; for estimators that carry on without.

A sample is judged with at most twice `WINDOW` seconds of what follows it, so that an estimator that runs beside the
vehicle needs to lag behind by no more than that. `railsim inspect` judges whole records, with more kinds of fault.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.data_sheet import DataSheet, data_sheet
from railsim.measurements import Measurements

WINDOW = 0.25  # s without any change: stuck (illustrative)
FEWEST = 12  # samples, the same for slow channels (illustrative)
COARSE = 8.0  # times longer where the resolution hides the noise (illustrative)
CLOSE = 0.999  # of the range by the data sheet
GUARD = 0.02  # s around saturated samples, in which the sensor's filter still shows them (illustrative)
WORST = 0.2  # share of bad samples within a second around, above which all are bad (illustrative)
GAP = 2.5  # steps between two samples, above which some are missing
DEAD = 0.1  # share of good samples below which a channel counts as absent (illustrative)


@dataclass(frozen=True)
class Health:
    """Judgement of some channels.

    Attributes
    ----------
    good : by channel, one flag for each of its samples; the channels that count as absent are not in it.
    left_out : what was left out or is missing, for `about["left_out"]`: "channel", "reason", "start [s]", "end [s]".
    """

    good: dict[str, np.ndarray]
    left_out: list[dict[str, Any]]

    @property
    def channels(self) -> list[str]:
        """Names of the channels that are there, in the order in which they were asked for."""
        return list(self.good)

    def warnings(self) -> list[str]:
        """One line for each channel of which something was left out."""
        messages = []
        for name in dict.fromkeys(str(entry["channel"]) for entry in self.left_out):
            spans = [entry for entry in self.left_out if entry["channel"] == name]
            reasons = " and ".join(dict.fromkeys(str(entry["reason"]) for entry in spans))
            total = sum(float(entry["end [s]"]) - float(entry["start [s]"]) for entry in spans)
            what = f"{total:.2f} s" if name in self.good else "all"
            messages.append(f"'{name}' is {reasons}: {what} of it is left out; the rest of the record is used")
        return messages


def channel_health(measurements: Measurements, names: Iterable[str]) -> Health:
    """Judge channels; a name that the recording has not is passed over, as if nothing of it could be used."""
    good: dict[str, np.ndarray] = {}
    left_out: list[dict[str, Any]] = []
    for name in names:
        if name not in measurements:
            continue
        time, rate = measurements.time(name), measurements.rate(name)
        flags, faults = judge(measurements[name], rate, data_sheet(measurements.about, name))
        if float(np.mean(flags)) < DEAD:
            reason = max(faults, key=lambda key: int(faults[key].sum()))
            left_out.append(_span(name, reason, time, 0, len(time)))
            continue
        good[name] = flags
        left_out += _gaps(name, time, rate)
        for reason, marks in faults.items():
            left_out += [_span(name, reason, time, first, last) for first, last in runs(marks)]
    return Health(good, left_out)


def judge(values: np.ndarray, rate: float, sheet: DataSheet) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Flags of the good samples, and those of the bad ones by reason, all of shape (n,).

    Parameters
    ----------
    values : samples, NaN where lost.
    rate : Hz.
    sheet : of the sensor; "range", "resolution" and "noise_density" are used where they are given.
    """
    lost = ~np.isfinite(values)
    noise = sheet.error("noise_density") * np.sqrt(rate / 2.0)
    coarse = sheet.error("resolution") > 2.0 * noise > 0.0
    count = max(FEWEST, round(WINDOW * rate * (COARSE if coarse else 1.0)))
    faults = {"lost": lost, "stuck": _stuck(values, count), "saturated": np.zeros(len(values), dtype=bool)}
    limit = sheet.error("range")
    if limit:
        over = np.abs(np.where(lost, 0.0, values)) >= CLOSE * limit
        faults["saturated"] = spread(over, round(GUARD * rate)) & ~lost & ~faults["stuck"]
    bad = np.logical_or.reduce(list(faults.values()))
    crowded = _crowded(bad, max(1, round(rate)))
    for marks in faults.values():  # between many bad ones nothing is believed: the reason is that of the neighbours
        marks |= crowded & ~bad & spread(marks, round(rate))
    return ~(bad | crowded), faults


def runs(marks: np.ndarray) -> list[tuple[int, int]]:
    """First index and the one after the last of every run of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], marks.astype(np.int8), [0]])))
    return [(int(first), int(last)) for first, last in edges.reshape(-1, 2)]


def spread(marks: np.ndarray, count: int) -> np.ndarray:
    """Flags that are true within `count` samples of a true one."""
    if count <= 0 or not marks.any():
        return marks.copy()
    total = np.concatenate([[0], np.cumsum(marks)])
    at = np.arange(len(marks))
    return total[np.minimum(at + count + 1, len(marks))] > total[np.maximum(at - count, 0)]


def _stuck(values: np.ndarray, count: int) -> np.ndarray:
    """Runs of at least `count` equal samples; lost ones between equal ones do not end a run."""
    finite = np.flatnonzero(np.isfinite(values))
    marks = np.zeros(len(values), dtype=bool)
    same = values[finite][1:] == values[finite][:-1]
    for first, last in runs(same):
        if last - first + 1 >= count:
            marks[finite[first : last + 1]] = True
    return marks


def _crowded(bad: np.ndarray, width: int) -> np.ndarray:
    """Where more than `WORST` of the samples of the last `width` and the next `WINDOW` are bad."""
    ahead = max(1, round(WINDOW * width))
    total = np.concatenate([[0], np.cumsum(bad)])
    at = np.arange(len(bad))
    first, last = np.maximum(at - width, 0), np.minimum(at + ahead + 1, len(bad))
    return (total[last] - total[first]) > WORST * (last - first)


def _gaps(name: str, time: np.ndarray, rate: float) -> list[dict[str, Any]]:
    """Times without any sample, which no flag can mark."""
    ends = np.flatnonzero(np.diff(time) * rate > GAP)
    return [
        {
            "channel": name,
            "reason": "missing",
            "start [s]": round(float(time[at]) + 1.0 / rate, 6),
            "end [s]": round(float(time[at + 1]), 6),
        }
        for at in ends
    ]


def _span(name: str, reason: str, time: np.ndarray, first: int, last: int) -> dict[str, Any]:
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    return {
        "channel": name,
        "reason": reason,
        "start [s]": round(float(time[first]), 6),
        "end [s]": round(float(time[last - 1]) + step, 6),
    }
