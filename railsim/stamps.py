"""Step of a clock whose stamps are rounded, jitter or have gaps."""

from dataclasses import dataclass

import numpy as np

WIDEST = 1.5
"""Steps; a wider one is a gap."""

_LOOK = 15  # rows on either side of a wide step, by which a late stamp is told from missing rows
_MOST_WIDE = 20_000  # wide steps that are looked at one by one
_FEWEST = 4  # wide steps that follow each other evenly, by which rounding is told from lost rows
_ALIKE = 0.8  # share of the distances between them that are alike to a row; the rest may be lost rows
_MANY = 20  # wide steps from which their scatter tells the same
_ROUNDING_SPREAD = 0.5  # of the resolution; stamps that are only rounded scatter by 1 / sqrt(12) = 0.29
_SAMPLE = 20_000  # stamps by which the resolution is found
_DIGITS = 10  # decimal places that are tried for the resolution
_EVEN = 1e-9  # of a step; less is rounding of floating-point numbers


@dataclass(frozen=True)
class Step:
    """Usual distance of a clock's stamps.

    Attributes
    ----------
    size : s (or m).
    uncertain : by which `size` may be off, as the stamps are rounded, s (or m).
    resolution : decimal step to which the stamps are rounded, s (or m); 0 where none is seen.
    numbers : of the rows, gaps counted, shape (n,).
    """

    size: float
    uncertain: float
    resolution: float
    numbers: np.ndarray

    def fits(self, stated: float, share: float) -> bool:
        """Whether a stated distance is the usual one, to `share` of it or to what the stamps' rounding leaves open."""
        return abs(self.size - stated) <= max(share * stated, min(self.uncertain, 0.2 * stated))


def usual_step(stamps: np.ndarray) -> Step:
    """(Last - first) / number of steps, with gaps counted and late stamps told from missing rows.

    Parameters
    ----------
    stamps : increasing, at least two, shape (n,).
    """
    steps = np.diff(stamps)
    resolution = resolution_of(stamps)
    median = float(np.median(steps))
    rounded = _rounded(stamps, steps, median, resolution)
    longest = median + 1.001 * resolution if rounded else 0.0
    usual = steps[steps <= max(WIDEST * median, longest)]
    size = median if np.ptp(usual) <= _EVEN * median else float(usual.mean())
    numbers = row_numbers(stamps, size, max(WIDEST * size, longest))
    if size != median:
        size = _slope(numbers, stamps, size)
    uncertain = resolution / float(numbers[-1])
    return Step(size, uncertain, resolution, numbers)


def row_numbers(stamps: np.ndarray, step: float, longest: float = 0.0) -> np.ndarray:
    """Number of each row on a grid of `step`, shape (n,); rows that are missing in gaps count.

    Parameters
    ----------
    stamps : increasing, shape (n,).
    step : their usual distance.
    longest : step that rounding of the stamps makes, where it makes any that are longer than `WIDEST` steps.
    """
    numbers = np.arange(stamps.size, dtype=float)
    steps = np.diff(stamps)
    wide = np.flatnonzero(steps > WIDEST * step) + 1
    if wide.size > _MOST_WIDE:
        return np.concatenate([[0.0], np.cumsum(np.maximum(1.0, np.rint(steps / step)))])
    ends = np.concatenate([[0], wide[steps[wide - 1] > longest], [stamps.size]])
    phase = (stamps - stamps[0]) / step - numbers
    jumps = np.zeros(stamps.size)
    for row in wide:
        place = int(np.searchsorted(ends, row))
        first = max(ends[place - 1], row - _LOOK)
        last = min(ends[place + 1] if ends[place] == row else ends[place], row + _LOOK)
        made = np.cumsum(jumps[first:row])
        jump = float(np.median(phase[row:last]) - np.median(phase[first:row] + made[-1] - made))
        jumps[row] = round(jump) if jump > 0.75 else 0.0
    return numbers + np.cumsum(jumps) if jumps.any() else numbers


def resolution_of(stamps: np.ndarray) -> float:
    """Largest power of ten (at most 1) of which all stamps are multiples; 0 where there is none down to 1e-10."""
    sample = stamps[:: max(1, stamps.size // _SAMPLE)]
    sample = np.concatenate([stamps[: min(stamps.size, 1000)], sample])
    largest = float(np.abs(sample).max())
    for digits in range(_DIGITS + 1):
        scaled = sample * 10.0**digits
        slack = 4 * np.finfo(float).eps * largest * 10.0**digits
        if slack > 0.01:
            return 0.0
        if np.abs(scaled - np.rint(scaled)).max() <= max(slack, 1e-9):
            return 10.0**-digits
    return 0.0


def _rounded(stamps: np.ndarray, steps: np.ndarray, median: float, resolution: float) -> bool:
    """Whether steps that are longer than the others by the resolution come from rounding, not from lost rows.

    Rounded stamps of an even clock are long at places that are evenly spread, to a row.
    """
    limit = 1.001 * resolution
    if not resolution or median > 2 * limit:
        return False
    gaps = steps > median + limit
    long = np.flatnonzero((steps > WIDEST * median) & ~gaps)
    if long.size < _FEWEST:
        return False
    part = np.cumsum(gaps)[long]
    spacing = np.diff(long)[np.diff(part) == 0]
    if spacing.size >= _FEWEST - 1 and np.mean(np.abs(spacing - np.median(spacing)) <= 1) >= _ALIKE:
        return True
    if long.size < _MANY:
        return False
    run = max(np.split(stamps, np.flatnonzero(gaps) + 1), key=len)
    rows = np.arange(run.size)
    line = np.polyfit(rows - rows.mean(), run, 1)
    return bool(np.std(run - np.polyval(line, rows - rows.mean())) < _ROUNDING_SPREAD * resolution)


def _slope(numbers: np.ndarray, stamps: np.ndarray, size: float) -> float:
    """Least squares of stamps over row numbers; outliers among them are few and not far off."""
    middle, start = numbers.mean(), stamps.mean()
    spread = float(np.sum((numbers - middle) ** 2))
    if stamps.size < 3 or not spread:
        return size
    return float(np.sum((numbers - middle) * (stamps - start)) / spread)
