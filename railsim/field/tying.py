"""Clocks of tables that are not one: tied by an event that both have seen, or by the correlation of their motions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import fftconvolve

from railsim.errors import InputError
from railsim.field.channels import numbers
from railsim.field.clock import Clock
from railsim.field.map import TableMap, Tie
from railsim.field.tables import Notes, Table

SLOW = 10.0
"""s, running mean that is taken off: what is slower is drift of sensors rather than motion."""
WINDOW = 10.0
"""s, of the windows whose offsets tell how certain the offset is."""
SHORTEST = 5.0  # s that both must have in common
FEWEST = 4  # windows by the scatter of which the uncertainty is told
POINTS = 1 << 20  # values of a signal in the first search
APART = 1.0
"""s from the highest correlation, or from an event, beyond which another one that is as high makes both doubtful."""
AMBIGUOUS = 0.9  # of the highest correlation
STANDS_OUT = 3.0
"""An event is so many times as large as anything else."""
_REACH = 6  # steps of the first search about which windows are compared


@dataclass(frozen=True)
class Signal:
    """Values over increasing times, all finite, shape (n,) each; s."""

    time: np.ndarray
    values: np.ndarray

    @property
    def step(self) -> float:
        """Usual step, s."""
        return float(np.median(np.diff(self.time)))

    def on(self, grid: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
        """Values on an even grid without what is slower than `SLOW`, and where there are any, shape (k,)."""
        width = _odd(step / self.step)
        smooth = uniform_filter1d(self.values, width, mode="nearest") if width > 1 else self.values
        near = np.searchsorted(self.time, grid).clip(1, self.time.size - 1)
        gap = np.minimum(np.abs(self.time[near] - grid), np.abs(grid - self.time[near - 1]))
        there = (grid >= self.time[0]) & (grid <= self.time[-1]) & (gap <= 2.0 * max(step, self.step))
        found = np.interp(grid, self.time, smooth)
        fast = found - uniform_filter1d(found, _odd(SLOW / step), mode="nearest")
        return np.where(there, fast, 0.0), there.astype(float)


def _odd(width: float) -> int:
    """An odd number of values: a mean over an even one would move the signal by half a step."""
    return 2 * (round(width) // 2) + 1


@dataclass(frozen=True)
class Offset:
    """What is added to a clock.

    Attributes
    ----------
    seconds, deviation : s.
    how : in words, how it was found.
    """

    seconds: float
    deviation: float
    how: str


def tied(mapped: Sequence[TableMap], tables: Sequence[Table], clocks: Sequence[Clock], notes: Notes) -> list[Clock]:
    """The clocks, those of tables with a `tie` moved to that of the table which it names.

    Raises
    ------
    InputError : a channel is not in the table or in none before it, or what both have seen does not tell the offset.
    """
    found = list(clocks)
    for number, one in enumerate(mapped):
        if one.tie is None:
            continue
        other = next((place for place in range(number) if one.tie.to in mapped[place].channels), None)
        if one.tie.channel not in one.channels:
            raise InputError(f"tables.{number}.tie: '{one.tie.channel}' is no channel of this table; name one of it")
        if other is None:
            raise InputError(f"tables.{number}.tie: '{one.tie.to}' is a channel of no table before; name one of those")
        mine, theirs = (
            _signal(mapped[place], tables[place], found[place], name)
            for place, name in ((number, one.tie.channel), (other, one.tie.to))
        )
        start, base = found[number].start, found[other].start
        guess = (start - base).total_seconds() if start and base else 0.0
        try:
            offset = by_event(mine, theirs) if one.tie.kind == "event" else by_motion(mine, theirs, one.tie, guess)
        except InputError as error:
            raise InputError(f"tables.{number}.tie: {error}") from None
        found[number] = Clock(found[number].seconds + offset.seconds, base)
        notes.assume(
            f"clock of table {number + 1} tied to that of table {other + 1} by {offset.how} ('{one.tie.channel}', "
            f"'{one.tie.to}'): {offset.seconds - guess:+.6g} s, standard deviation {1e3 * offset.deviation:.2g} ms"
        )
    return found


def by_motion(mine: Signal, theirs: Signal, tie: Tie, guess: float = 0.0) -> Offset:
    """The offset at which two signals of the same motion are most alike.

    A first search over all offsets allowed is followed by windows of `WINDOW`, each compared near what that found;
    their mean is the offset, their scatter tells its deviation.

    Parameters
    ----------
    mine, theirs : the signal whose clock is moved, and that which stays.
    guess : offset about which `tie.largest` counts, s.

    Raises
    ------
    InputError : they have too little in common, are not alike, or as much so at another offset.
    """
    step = max(mine.step, theirs.step)
    coarse = max(step, *(float(np.ptp(one.time)) / POINTS for one in (mine, theirs)))
    own, own_there = mine.on(np.arange(mine.time[0], mine.time[-1], coarse), coarse)
    other, other_there = theirs.on(np.arange(theirs.time[0], theirs.time[-1], coarse), coarse)
    height = _likeness(other, other_there, own, own_there, SHORTEST / coarse)
    lags = theirs.time[0] - mine.time[0] + coarse * (np.arange(height.size) - (own.size - 1))
    if tie.largest is not None:
        height = np.where(np.abs(lags - guess) <= tie.largest, height, 0.0)
    best = int(np.argmax(np.abs(height)))
    peak = float(height[best])
    if abs(peak) < tie.threshold:
        raise InputError(
            f"the motions are not alike: their correlation is {abs(peak):.2f} at most, below {tie.threshold:g}; name "
            "channels that feel the same motion, or allow a larger offset"
        )
    rest = np.abs(height[np.abs(lags - lags[best]) > APART])
    if rest.size and rest.max() > AMBIGUOUS * abs(peak):
        raise InputError(
            f"the motion repeats itself: a correlation of {rest.max():.2f} stands beside that of {abs(peak):.2f}; name "
            "other channels, or state 'largest'"
        )
    offsets, likeness = _windows(mine, theirs, float(lags[best]), step, _REACH * coarse, tie.threshold)
    against = " with opposite signs" if peak < 0.0 else ""
    if len(offsets) < FEWEST:
        return Offset(float(lags[best]), coarse / 2.0, f"the correlation {abs(peak):.2f} of motions{against}")
    middle = float(np.median(offsets))
    spread = max(1.4826 * float(np.median(np.abs(offsets - middle))), step / np.sqrt(12.0))
    kept = offsets[np.abs(offsets - middle) < 4.0 * spread]
    deviation = float(np.std(kept, ddof=1)) / np.sqrt(len(kept)) if len(kept) > 1 else spread
    how = f"the correlation of motions{against}, {np.median(likeness):.2f} in {len(kept)} windows of {WINDOW:g} s"
    return Offset(float(np.mean(kept)), max(deviation, 1e-2 * step), how)


def by_event(mine: Signal, theirs: Signal) -> Offset:
    """The offset at which the largest jolt of both is one.

    Raises
    ------
    InputError : nothing stands out in one of them.
    """
    (at, wide), (there, broad) = _event(mine), _event(theirs)
    return Offset(there - at, float(np.hypot(wide, broad)), "an event that both have seen")


def _event(signal: Signal) -> tuple[float, float]:
    """Time of the largest jolt, s, and its standard deviation: a quarter of its width at half of its height."""
    width = _odd(1.0 / signal.step)
    size = np.abs(signal.values - uniform_filter1d(signal.values, width, mode="nearest"))
    peak = int(np.argmax(size))
    apart = np.abs(signal.time - signal.time[peak]) > APART
    rest = float(size[apart].max()) if apart.any() else 0.0
    if size[peak] < STANDS_OUT * rest or size[peak] <= 0.0:
        raise InputError(
            f"no event stands out: the largest jolt at {signal.time[peak]:.6g} s is "
            f"{size[peak] / max(rest, 1e-30):.1f} times as large as others, {STANDS_OUT:g} are needed; tie by "
            "'kind: motion'"
        )
    high = size >= 0.5 * size[peak]
    near = high & (np.abs(signal.time - signal.time[peak]) <= APART)
    at = float(np.average(signal.time[near], weights=size[near] ** 2))
    return at, max(0.25 * float(np.ptp(signal.time[near])), signal.step / np.sqrt(12.0))


def _windows(
    mine: Signal, theirs: Signal, lag: float, step: float, reach: float, threshold: float
) -> tuple[np.ndarray, np.ndarray]:
    """(offsets in s, correlations) of windows that are alike near a lag."""
    own, own_there = mine.on(np.arange(mine.time[0], mine.time[-1], step), step)
    other, other_there = theirs.on(np.arange(theirs.time[0], theirs.time[-1], step), step)
    apart = (mine.time[0] + lag - theirs.time[0]) / step  # rows of the other signal at the first row of this one
    whole, count, more = round(apart), round(WINDOW / step), max(3, round(reach / step))
    rows = []
    for first in range(0, own.size - count + 1, count):
        low = first + whole - more
        high = first + whole + count + more
        if low < 0 or high > other.size:
            continue
        one, wide = slice(first, first + count), slice(low, high)
        if own_there[one].mean() < 0.9 or other_there[wide].mean() < 0.9:
            continue
        height = _likeness(other[wide], other_there[wide], own[one], own_there[one], 0.8 * count)
        height = height[count - 1 : count + 2 * more]
        best = int(np.argmax(np.abs(height)))
        if 0 < best < height.size - 1 and abs(height[best]) >= threshold:
            before, peak, after = np.abs(height[best - 1 : best + 2])
            bend = before - 2.0 * peak + after
            fraction = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
            rows.append((lag + (best + fraction - more + whole - apart) * step, float(peak)))
    table = np.array(rows).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def _likeness(
    other: np.ndarray, other_there: np.ndarray, own: np.ndarray, own_there: np.ndarray, least: float
) -> np.ndarray:
    """Normalised correlation at every lag, from where the end of `own` meets the beginning of `other`; 0 where fewer
    than `least` values lie on each other.
    """

    def against(first: np.ndarray, second: np.ndarray) -> np.ndarray:
        return np.asarray(fftconvolve(first, second[::-1]))

    count = against(other_there, own_there)
    power = np.maximum(against(other**2, own_there), 0.0) * np.maximum(against(other_there, own**2), 0.0)
    floor = 1e-12 * float(np.sum(other**2)) * float(np.sum(own**2))
    return np.where(
        (count >= least - 0.5) & (power > floor), against(other, own) / np.sqrt(np.maximum(power, 1e-300)), 0.0
    )


def _signal(mapped: TableMap, table: Table, clock: Clock, name: str) -> Signal:
    """A channel's raw numbers over its table's clock."""
    channel = mapped.channels[name]
    values = numbers(table.columns[channel.column], table, channel.lost, f"of '{name}'")
    good = np.isfinite(clock.seconds) & np.isfinite(values)
    time, values = clock.seconds[good], values[good]
    time, first = np.unique(time, return_index=True)
    if time.size < 16:
        raise InputError(f"tie: '{name}' has {time.size} values, too few to tie a clock by; name a longer channel")
    return Signal(time, values[first])
