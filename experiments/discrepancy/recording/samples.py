"""Samples as the workflow wants them: every channel on an even grid from one common instant, lost ones marked."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from railsim.measurements import Measurements
from railsim.sensors.interface import Sensor

MOST_GAP = 0.5  # share of lost samples beyond which a channel is left out
STUCK = 1.0  # s of one and the same value, from which the sensor is taken as dead there
SLOWEST = 40.0  # Hz; slower channels would narrow the band that all are compared in
ON_GRID = 0.02  # of a sample interval that times may be off an even grid
SHORTFALL = 1.0  # s that a channel may end before most others; one that ends earlier ends in lost samples
PASSED = 0.4  # of the new rate, where a faster channel is cut off


@dataclass(frozen=True)
class Samples:
    """What was measured.

    Attributes
    ----------
    begin : s, the recording's own time of the common first sample. values : channel to (n,), NaN where lost. rates :
    channel to Hz, each divides the model's. slowest : Hz, of the slowest channel as it was measured. left_out : what
    is not used, with the reason.
    """

    begin: float
    values: dict[str, np.ndarray]
    rates: dict[str, float]
    slowest: float
    left_out: tuple[str, ...]

    @property
    def duration(self) -> float:
        """Length of the common grid [s]."""
        return min(len(one) / self.rates[name] for name, one in self.values.items())


def sampled(measured: Measurements, sensors: Sequence[Sensor], model_rate: float) -> Samples:
    """The channels of some sensors that can be compared with a model that gives `model_rate` rows a second.

    Sensors that stand still or miss half of their samples are left out, dead stretches count as lost. Times that are
    not on an even grid of a rate that divides the model's are interpolated (cubic spline, not across gaps).
    """
    names = [name for sensor in sensors for name in sensor.channels() if name in measured]
    left_out: list[str] = []
    usable = []
    for name in names:
        reason = _useless(measured[name], measured.rate(name))
        left_out += [f"{name}: {reason}"] if reason else []
        usable += [] if reason else [name]
    if not usable:
        return Samples(0.0, {}, {}, 0.0, tuple(left_out))
    begin = max(float(measured.time(name)[0]) for name in usable)
    ends = sorted(float(measured.time(name)[-1]) + 1.0 / measured.rate(name) for name in usable)
    usual = ends[len(ends) // 2]
    duration = min(end for end in ends if end > usual - SHORTFALL) - begin
    values, rates = {}, {}
    for name in usable:
        rate = grid_rate(measured.rate(name), model_rate)
        one = even(measured.time(name) - begin, _alive(measured[name], measured.rate(name)), measured.rate(name), rate)
        one = _cut(one, int(duration * rate))
        if np.isfinite(one).mean() <= 1.0 - MOST_GAP:
            left_out.append(f"{name}: more than half of its samples are lost")
            continue
        values[name], rates[name] = one, rate
    slowest = min((measured.rate(name) for name in values), default=0.0)
    return Samples(begin, values, rates, slowest, tuple(left_out))


def _useless(values: np.ndarray, rate: float) -> str:
    """Why a channel says nothing; empty where it does."""
    good = values[np.isfinite(values)]
    if good.size <= (1.0 - MOST_GAP) * values.size:
        return "more than half of its samples are lost"
    if np.ptp(good) <= 0.0:
        return "it always gives the same value"
    return f"{rate:g} Hz are too slow ({SLOWEST:g} Hz are the least)" if rate < SLOWEST else ""


def _alive(values: np.ndarray, rate: float) -> np.ndarray:
    """The samples with stretches of one and the same value marked as lost."""
    edges = np.flatnonzero(np.concatenate([[True], np.diff(values) != 0.0, [True]]))
    long = np.diff(edges) >= max(2.0, STUCK * rate)
    out = values.astype(float)
    for first, last in zip(edges[:-1][long], edges[1:][long], strict=True):
        out[first:last] = np.nan
    return out


def grid_rate(rate: float, model_rate: float) -> float:
    """The lowest rate [Hz] that divides the model's and is not below a channel's own; else the model's."""
    ratio = model_rate / rate
    if ratio > 0.5 and abs(ratio - round(ratio)) < 1e-6:
        return rate
    steps = range(max(1, int(ratio)), 0, -1)
    return model_rate / next((step for step in steps if (model_rate / step).is_integer()), 1)


def even(time: np.ndarray, values: np.ndarray, rate: float, wanted: float) -> np.ndarray:
    """Samples at the instants i / wanted from time 0 on; NaN where the next true sample is more than one interval off.

    Parameters
    ----------
    time : (n,) s. values : (n,), NaN where lost. rate : Hz, of the samples. wanted : Hz.
    """
    first = round(-time[0] * rate)
    if wanted == rate and np.abs((time[first:] - np.arange(len(time) - first) / rate) * rate).max() < ON_GRID:
        return values[first:]
    instants = np.arange(0.0, time[-1] + 0.5 / wanted, 1.0 / wanted)
    good = np.isfinite(values)
    have, what = time[good], values[good]
    if wanted < rate:
        grid = np.arange(have[0], have[-1], 1.0 / rate)
        sections = butter(8, PASSED * wanted, fs=rate, output="sos")
        have, what = grid, sosfiltfilt(sections, np.interp(grid, have, what))
    out = CubicSpline(have, what)(np.clip(instants, have[0], have[-1]))
    place = np.clip(np.searchsorted(time[good], instants), 1, int(good.sum()) - 1)
    before, after = time[good][place - 1], time[good][place]
    out[(after - before > 1.5 / rate) & (instants > before + 1e-9) & (instants < after - 1e-9)] = np.nan
    out[(instants < time[good][0] - 1e-9) | (instants > time[good][-1] + 0.5 / rate)] = np.nan
    return out


def _cut(values: np.ndarray, count: int) -> np.ndarray:
    """(count,) samples: cut, or with lost ones at the end."""
    short = max(0, count - len(values))
    return np.concatenate([values[:count], np.full(short, np.nan)]) if short else values[:count]
