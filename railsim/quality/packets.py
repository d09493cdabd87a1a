"""What checks of packets share: channels of one sensor, rows that appear twice, how roughly rows follow each other."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from railsim.measurements import Measurements
from railsim.quality._signals import chance, filled, kind_of, runs, sheet, whitened

_MIX = np.uint64(0x9E3779B97F4A7C15)  # odd number of Fibonacci hashing (Knuth, volume 3, section 6.4)
_LONGEST = 256  # rows, from which on a window is not looked for
_SHORTEST = 6  # rows
_FREEDOM = 4.0  # of Student's t, illustrative: the least with a finite kurtosis beyond it
_PROBABILITY = 1e-6  # of a false alarm a sensor


def sensors(measured: Measurements) -> list[list[str]]:
    """Channels of each inertial sensor and transducer; a packet holds all of one."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for name in measured:
        if kind_of(measured, name) in ("accelerometer", "gyro", "displacement"):
            key = tuple(sheet(measured, name).get("channels", (name,)))
            groups.setdefault(key, []).append(name)
    return list(groups.values())


def copies(rows: np.ndarray) -> list[tuple[int, int, int]]:
    """First row, one past the last and first row of the original of each stretch of rows that appears twice.

    Sums over windows of rows, each row a pseudorandom number, are sorted, so that equal windows meet: n log n.

    Parameters
    ----------
    rows : channels of one sensor, NaN where lost, shape (c, n).
    """
    count = rows.shape[1]
    width = _window(rows)
    if not _SHORTEST <= width <= _LONGEST or count < 2 * width:
        return []
    numbers = _numbers(rows)
    total = np.zeros(count - width + 1, dtype=np.uint64)
    for at in range(width):
        total = total * _MIX + numbers[at : at + total.size]
    order = np.argsort(total, kind="stable")
    same = np.flatnonzero(total[order][1:] == total[order][:-1])
    lag = np.zeros(total.size, dtype=int)
    lag[order[same + 1]] = order[same + 1] - order[same]
    found = []
    for first, last in runs(lag > 0):
        for part in np.split(np.arange(first, last), np.flatnonzero(np.diff(lag[first:last])) + 1):
            begin, back = int(part[0]), int(lag[part[0]])
            end = min(int(part[-1]) + width, begin + back)  # more than a packet is chance, or a third copy
            if end - begin >= _window(rows[:, begin:end], count):
                found.append((begin, end, begin - back))
    return found


def _numbers(rows: np.ndarray) -> np.ndarray:
    """A pseudorandom number for each row, the same for the same values; one of its own for a row with a lost sample."""
    mixed = np.zeros(rows.shape[1], dtype=np.uint64)
    for values in rows:
        bits = np.ascontiguousarray(values).view(np.uint64)
        mixed = (mixed ^ bits) * _MIX
        mixed ^= mixed >> np.uint64(29)
    lost = np.isnan(rows).any(axis=0)
    mixed[lost] = np.arange(1, 1 + int(lost.sum()), dtype=np.uint64) * _MIX
    return mixed


def _window(rows: np.ndarray, count: int = 0) -> int:
    """Rows of a window that no two places share by chance (Renyi's collision entropy of the differences)."""
    alike = min(max(_collision(np.diff(one)), _collision(np.diff(one, 2))) for one in rows)
    if not 0.0 < alike < 1.0:
        return _SHORTEST if alike == 0.0 else _LONGEST + 1
    places = max(count, rows.shape[1], 2)
    return max(_SHORTEST, 2 + math.ceil(math.log(_PROBABILITY / places**2) / math.log(alike)))


def _collision(steps: np.ndarray) -> float:
    """Probability that two of the values are the same; differences are compared to nine digits."""
    known = steps[np.isfinite(steps)]
    if known.size < 2:
        return 1.0
    scale = float(np.abs(known).max()) or 1.0
    counts = np.unique(np.rint(known / scale * 1e9), return_counts=True)[1].astype(float)
    return float(np.sum(counts * (counts - 1.0)) / (known.size * (known.size - 1.0)))


@dataclass(frozen=True)
class Joins:
    """How well rows of one sensor go on from those before them.

    Attributes
    ----------
    filters : prediction-error filter by channel. scales : standard deviation of its innovations, shape (n,).
    rows : the channels, lost samples interpolated and means taken off, shape (n,).
    surprise : sum over all channels of `unlikely` innovations in each row, as they are, shape (n,).
    """

    filters: Mapping[str, np.ndarray]
    scales: Mapping[str, np.ndarray]
    rows: Mapping[str, np.ndarray]
    surprise: np.ndarray

    def now(self, after: int) -> np.ndarray:
        """Sum of `surprise` in `after` rows from each row on, shape (n,)."""
        total = np.concatenate([[0.0], np.cumsum(self.surprise)])
        last = np.minimum(np.arange(self.surprise.size) + after, self.surprise.size)
        return total[last] - total[:-1]

    def near(self, first: int, last: int) -> np.ndarray:
        """Numbers of the rows between two places, and of as many before and after as the models look back to."""
        reach = max(taps.size for taps in self.filters.values())
        return np.arange(max(0, first - reach), min(last + reach, self.surprise.size))

    def cost(self, order: np.ndarray, places: np.ndarray, after: int) -> float:
        """Sum of `costs` over all channels."""
        return float(self.costs(order, places, after).sum())

    def costs(self, order: np.ndarray, places: np.ndarray, after: int) -> np.ndarray:
        """Sum of `unlikely` innovations in `after` rows from each place on, rows taken in `order`, by channel, (c,)."""
        total = np.zeros(len(self.rows))
        for number, (name, values) in enumerate(self.rows.items()):
            taps = self.filters[name]
            for place in places:
                at = np.arange(place, min(place + after, order.size))
                back = at[:, None] - np.arange(taps.size)[None, :]
                past = values[order[np.maximum(back, 0)]]
                total[number] += float(np.sum(unlikely(past @ taps / self.scales[name][order[at]])))
        return total


def joins(measured: Measurements, names: list[str]) -> Joins | None:
    """Autoregressive models of a sensor's channels; None where no channel changes."""
    filters, scales, rows = {}, {}, {}
    surprise = np.zeros(measured[names[0]].size)
    for name in names:
        values = measured[name]
        white = whitened(values, measured.rate(name))
        if white is not None:
            filters[name], scales[name] = white.filter, white.scale
            surprise += unlikely(white.innovations)
            known = filled(values)
            rows[name] = known - np.median(known)
    return Joins(filters, scales, rows, surprise) if rows else None


def unlikely(innovations: np.ndarray) -> np.ndarray:
    """Minus the logarithm of the likelihood of innovations, up to a constant: Student's t, for shocks have heavy tails.

    With normal ones, a few hundredths of a shock's energy would outweigh what a join shows.
    """
    return 0.5 * (_FREEDOM + 1.0) * np.log1p(np.square(innovations) / _FREEDOM)


def odds(count: int) -> float:
    """Nepers of likelihood against as many places: as `chance`."""
    return 0.5 * chance(count) ** 2
