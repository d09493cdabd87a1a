"""Repeated passes over one track: laid on each other by correlation, and what has changed between them.

Odometers of different wheels drift apart by a per cent, so one shift for all does not do: windows of one pass are found
again in the other one after the other, each search starting where the drift so far lets it be expected.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d
from scipy.signal import correlate

from estimators.signals.bands import stretches

WINDOW, STRIDE = 60.0, 15.0  # m; length of a window (several waves of D1), and how far they lie apart
FIRST_REACH, NEXT_REACH = 3.0, 0.6  # m; search around the expected place, in the first round and in the second
STEADY = 180.0  # m; odometers drift more slowly than this, and a change of the track is shorter
ALIKE = 0.8  # correlation above which a window counts as found
APART = 12.0  # m; changes closer than this are one
MAD = 1.4826  # standard deviation over median absolute deviation of a normal distribution


@dataclass(frozen=True)
class Match:
    """Where the windows of a reference pass lie in another one.

    Attributes
    ----------
    distance : centre of each window that was found, m on the reference's grid, increasing, shape (w,).
    lag : distance in the other pass minus distance in the reference, m, shape (w,).
    correlation : of each window, shape (w,).
    """

    distance: np.ndarray
    lag: np.ndarray
    correlation: np.ndarray

    def other_distance(self, distance: np.ndarray) -> np.ndarray:
        """Distances in the other pass of `distance` in the reference, m; drift goes on at both ends as in the whole."""
        if len(self.distance) < 2:
            return distance + (self.lag[0] if len(self.lag) else np.nan)
        slope = np.polyfit(self.distance, self.lag, 1)[0]
        lag = np.interp(distance, self.distance, self.lag)
        lag += slope * (np.minimum(distance - self.distance[0], 0.0) + np.maximum(distance - self.distance[-1], 0.0))
        return distance + lag


def match(reference: np.ndarray, other: np.ndarray, spacing: float) -> Match:
    """Find a pass in another one.

    Parameters
    ----------
    reference, other : the same quantity of both, best a short-wave band, on grids of `spacing` m; NaN where not valid.

    Returns
    -------
    Windows found in two rounds: in the second, the other pass is stretched by what the first found.
    """
    first = _windows(reference, other, spacing, FIRST_REACH, None)
    if len(first.distance) < 2:
        return first
    grid = spacing * np.arange(len(reference))
    stretched = laid_on(other, spacing, first, grid)
    second = _windows(reference, stretched, spacing, NEXT_REACH, 0.0)
    if len(second.distance) < 2:
        return first
    lag = first.other_distance(second.distance + second.lag) - second.distance
    return Match(second.distance, _steady(second.distance, lag), second.correlation)


def laid_on(other: np.ndarray, spacing: float, pairing: Match, distance: np.ndarray) -> np.ndarray:
    """Values of the other pass at `distance` of the reference, m; NaN where it has none."""
    grid = spacing * np.arange(len(other))
    at = pairing.other_distance(distance)
    values = np.interp(at, grid, np.where(np.isfinite(other), other, 0.0), np.nan, np.nan)
    missing = np.interp(at, grid, ~np.isfinite(other), 1.0, 1.0) > 0.0
    return np.where(missing, np.nan, values)


def changes(
    reference: np.ndarray, later: np.ndarray, spacing: float, least: float | np.ndarray = 0.3e-3, factor: float = 6.0
) -> list[dict[str, Any]]:
    """Places at which two passes on one grid differ.

    Parameters
    ----------
    least : smallest difference that is reported, m (0.3 mm: what passes must agree to); one, or one for each place.
    factor : and at least so many standard deviations of the differences (by their median absolute deviation, which few
        real changes do not move).

    Returns
    -------
    Events: "kind", "s [m]" (on the grid), "change [m]" (signed), "length [m]".
    """
    difference = later - reference
    known = np.isfinite(difference)
    if not known.any():
        return []
    spread = MAD * float(np.median(np.abs(difference[known] - np.median(difference[known]))))
    threshold = np.maximum(least, factor * spread)
    beyond = np.flatnonzero(np.abs(np.where(known, difference, 0.0)) > threshold)
    if not beyond.size:
        return []
    near = np.zeros(len(difference), dtype=bool)
    for first, second in zip(beyond[:-1], beyond[1:], strict=True):
        if (second - first) * spacing <= APART:
            near[first : second + 1] = True
    near[beyond] = True
    events = []
    for begin, end in stretches(near):
        peak = begin + int(np.nanargmax(np.abs(difference[begin:end])))
        events.append(
            {
                "kind": "change",
                "s [m]": peak * spacing,
                "change [m]": float(difference[peak]),
                "length [m]": (end - begin) * spacing,
            }
        )
    return events


def _steady(distance: np.ndarray, lag: np.ndarray) -> np.ndarray:
    """The lags as an odometer can drift: a line, and what is left of it smoothed over `STEADY`.

    A change of the track pulls at every window that holds it; the median over more windows than these drops that.
    """
    line = np.polyval(np.polyfit(distance, lag, 1), distance)
    count = 2 * round(STEADY / STRIDE / 2) + 1
    left = median_filter(lag - line, count, mode="nearest")
    return line + np.asarray(uniform_filter1d(left, count // 2 + 1, mode="nearest"))


def _windows(reference: np.ndarray, other: np.ndarray, spacing: float, reach: float, expected: float | None) -> Match:
    """One round of searches; `expected`: lag of the first window in m, None: it may be anywhere."""
    size, stride = round(WINDOW / spacing), round(STRIDE / spacing)
    rows: list[tuple[float, float, float]] = []
    for start in range(0, len(reference) - size + 1, stride):
        window = reference[start : start + size]
        if not np.isfinite(window).all():
            continue
        centre = spacing * (start + (size - 1) / 2)
        guess = _expected(rows, centre, expected)
        low, high = (0, len(other)) if guess is None else _range(start, size, guess, reach, spacing)
        low, high = max(low, 0), min(high, len(other))
        if high - low < size:
            continue
        lag, likeness = _best(window, other[low:high])
        if likeness >= ALIKE:
            rows.append((centre, (low + lag - start) * spacing, likeness))
    table = np.array(rows).reshape(-1, 3)
    return Match(table[:, 0], table[:, 1], table[:, 2])


def _expected(rows: list[tuple[float, float, float]], centre: float, first: float | None) -> float | None:
    if first is not None:
        return first
    if not rows:
        return None
    recent = rows[-6:]
    if len(recent) < 4:
        return recent[-1][1]
    slope, offset = np.polyfit([row[0] for row in recent], [row[1] for row in recent], 1)
    return float(offset + np.clip(slope, -0.03, 0.03) * centre) if abs(slope) <= 0.03 else recent[-1][1]


def _range(start: int, size: int, guess: float, reach: float, spacing: float) -> tuple[int, int]:
    low = start + round((guess - reach) / spacing)
    return low, low + size + 2 * round(reach / spacing)


def _best(window: np.ndarray, stretch: np.ndarray) -> tuple[float, float]:
    """Offset (samples, with a fraction) of the window in the stretch, and the normalised correlation there."""
    filled = np.where(np.isfinite(stretch), stretch, 0.0)
    product = correlate(filled, window, mode="valid")
    energy = np.cumsum(np.concatenate([[0.0], filled**2]))
    local = energy[len(window) :] - energy[: -len(window)]
    likeness = product / np.sqrt(np.maximum(local, 1e-30) * float(window @ window) + 1e-30)
    peak = int(np.argmax(likeness))
    if 0 < peak < len(likeness) - 1:
        before, here, after = likeness[peak - 1 : peak + 2]
        curvature = before - 2.0 * here + after
        return peak + (0.5 * (before - after) / curvature if curvature < 0.0 else 0.0), float(here)
    return float(peak), float(likeness[peak])
