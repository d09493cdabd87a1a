"""Where adhesion changed: two stretches of one level each, and the place between them that short windows like best."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from estimators.adhesion.classifier import LEVELS

STAY = 0.5  # share of a window's length that a level must last to be one
FLOOR = 1e-4  # least probability: one odd window does not decide


class Change(NamedTuple):
    """A change of level; `std` [s] is the spread of the place among short windows' likelihoods."""

    time: float
    std: float
    before: str
    after: str


def find_changes(long: np.ndarray, short: np.ndarray, window: float) -> list[Change]:
    """Changes of level.

    Parameters
    ----------
    long, short : windows that count: time of the middle, s, then the probabilities of `LEVELS`, (n, 5).
    window : length of the long windows, s.
    """
    changes = []
    for (_, last, before), (first, _, after) in pairwise(_stretches(long, window)):
        start, end = last - window / 2.0, first + window / 2.0
        inside = short[(short[:, 0] >= start) & (short[:, 0] <= end)]
        if len(inside) < 2:
            changes.append(Change((last + first) / 2.0, (first - last) / 2.0, LEVELS[before], LEVELS[after]))
            continue
        time, spread = _change_time(inside, before, after)
        changes.append(Change(time, spread, LEVELS[before], LEVELS[after]))
    return changes


def _stretches(long: np.ndarray, window: float) -> list[tuple[float, float, int]]:
    """First and last window and level of every stretch that lasts, neighbours of one level as one."""
    if not len(long):
        return []
    level = long[:, 1:].argmax(axis=1)
    edges = [0, *(np.flatnonzero(np.diff(level)) + 1), len(level)]
    stretches: list[tuple[float, float, int]] = []
    for first, after in pairwise(edges):
        start, end, state = float(long[first, 0]), float(long[after - 1, 0]), int(level[first])
        if end - start < STAY * window and first > 0 and after < len(level):
            continue
        if stretches and stretches[-1][2] == state:
            start = stretches.pop()[0]
        stretches.append((start, end, state))
    return _without_passages(stretches, window)


def _without_passages(stretches: list[tuple[float, float, int]], window: float) -> list[tuple[float, float, int]]:
    """A level between two others that lasts no longer than a window which holds both is none of its own."""
    kept = list(stretches)
    for number in range(len(stretches) - 2, 0, -1):
        start, end, level = kept[number]
        neighbours = sorted((kept[number - 1][2], kept[number + 1][2]))
        if end - start < window and neighbours[0] < level < neighbours[1]:
            del kept[number]
    return kept


def _change_time(inside: np.ndarray, before: int, after: int) -> tuple[float, float]:
    """Time at which the short windows change sides, and its spread: a level each on both sides, likelihoods tempered by
    the overlap of the windows.
    """
    odds = np.log(np.maximum(inside[:, 1 + before], FLOOR)) - np.log(np.maximum(inside[:, 1 + after], FLOOR))
    total = np.concatenate([[0.0], np.cumsum(odds)])
    step = float(np.median(np.diff(inside[:, 0])))
    times = np.concatenate(
        [[inside[0, 0] - step / 2.0], (inside[1:, 0] + inside[:-1, 0]) / 2.0, [inside[-1, 0] + step / 2]]
    )
    weight = np.exp((total - total.max()) * min(1.0, step / 4.0))
    weight /= weight.sum()
    mean = float(np.sum(weight * times))
    return mean, float(np.sqrt(np.sum(weight * (times - mean) ** 2) + step**2 / 12.0))
