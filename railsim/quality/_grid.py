"""The even grid of times that a table's stamps scatter about, and tables brought to it or moved along it."""

import math

import numpy as np
from scipy.interpolate import CubicSpline

from railsim.measurements import TIME, Measurements
from railsim.quality._signals import filled
from railsim.quality.draft import Columns

ROUNDING = 1e-3  # steps
_LOOK = 15  # rows on either side of a wide step, by which a late stamp is told from missing rows
WIDEST = 1.5
"""Steps; a wider one is a gap."""
_WHOLE = 0.15  # steps by which a shift may miss a whole number of samples and is still taken as that


def times(measured: Measurements) -> dict[float, np.ndarray]:
    """Times of each table by rate."""
    return {measured.rate(name): measured.time(name) for name in measured}


def numbers(time: np.ndarray, rate: float) -> np.ndarray:
    """Number of the grid's place of each row, shape (n,); gaps count."""
    at = np.arange(time.size, dtype=float)
    phase = time * rate - at
    for row in np.flatnonzero(np.diff(time) * rate > WIDEST) + 1:
        jump = np.median(phase[row : row + _LOOK]) - np.median(phase[max(0, row - _LOOK) : row])
        jump = round(float(jump)) if jump > 0.75 else 0
        at[row:] += jump
        phase[row:] -= jump
    return at


def gridded(time: np.ndarray, rate: float) -> np.ndarray:
    """The even times, s, that the stamps scatter about: the real clock's rate, robust against scattered stretches."""
    at = numbers(time, rate)
    step = 1.0 / rate
    if at[-1] > 0:
        half = at.size // 2
        slope = float(np.median((time[half:] - time[: at.size - half]) / (at[half:] - at[: at.size - half])))
        step = slope if abs(slope * rate - 1) > ROUNDING / at[-1] else step
    return float(np.median(time - at * step)) + at * step


def shifted(table: Columns, amount: float, latest: float) -> Columns:
    """Values moved to stamps that are `amount` s later, on the times as they are and on as many more as they reach
    until `latest`, s; by whole samples where it is nearly that many, else by cubic splines. Ends and neighbours of lost
    samples are empty.
    """
    step = float(np.median(np.diff(table[TIME])))
    more = max(0, min(math.floor(amount / step), math.floor((latest - float(table[TIME][-1])) / step - 0.5)))
    table = {name: np.concatenate([values, np.full(more, math.nan)]) for name, values in table.items()}
    time = table[TIME]
    time[time.size - more :] = time[time.size - more - 1] + step * np.arange(1, more + 1)
    steps = amount / step
    near = np.arange(time.size) - round(steps)
    inside = (near >= 0) & (near < time.size)
    whole = abs(steps - round(steps)) < _WHOLE
    new: Columns = {TIME: time}
    for name in list(table)[1:]:
        values = table[name]
        source = np.where(inside, values[near.clip(0, time.size - 1)], math.nan)
        if not whole:
            between = CubicSpline(time, filled(values))(np.clip(time - amount, time[0], time[-1]))
            source = np.where(np.isnan(source), math.nan, between)
        new[name] = source
    return new


def stretched(table: Columns, scale: float, first: float, latest: float) -> Columns:
    """Values whose true times are `first` s and (1 + `scale`) times their stamps after the first one, brought to even
    stamps by cubic splines; as many rows as they reach until `latest`, s. Neighbours of lost samples are empty.
    """
    time = table[TIME]
    step = float(np.median(np.diff(time)))
    true = time[0] + first + (time - time[0]) * (1.0 + scale)
    count = max(2, math.floor((min(latest, float(true[-1])) - float(time[0])) / step + 1e-6) + 1)
    even = time[0] + step * np.arange(count)
    inside = (even >= true[0] - step) & (even <= true[-1] + 1e-9)
    near = np.clip(np.searchsorted(true, even), 1, true.size - 1)
    new: Columns = {TIME: even}
    for name in list(table)[1:]:
        values = table[name]
        lost = np.isnan(values)
        known = inside & ~lost[near] & ~lost[near - 1]
        new[name] = np.where(known, CubicSpline(true, filled(values))(np.clip(even, true[0], true[-1])), math.nan)
    return new


def regridded(table: Columns, rate: float) -> Columns:
    """Rows on the even grid, those that are missing empty."""
    rows = numbers(table[TIME], rate).astype(int)
    even = gridded(table[TIME], rate)
    count = int(rows[-1]) + 1
    new: Columns = {TIME: np.interp(np.arange(count), rows, even)}
    for name in list(table)[1:]:
        new[name] = np.full(count, math.nan)
        new[name][rows] = table[name]
    return new
