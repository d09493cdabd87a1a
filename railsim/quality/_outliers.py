"""Additive outliers and level shifts in an autoregressive series (Chen and Liu 1993, J. Am. Stat. Assoc. 88, 284-297).

A wrong sample (additive outlier) leaves the prediction-error filter's taps in the innovations, a step of the zero
leaves their running sums. A real impact leaves neither: it is what drives the series, and its innovations do not go
away when either is taken out.
"""

import numpy as np

from railsim.quality._signals import Whitened

REACH = 64
"""Innovations over which a step is looked for."""


def significance(white: Whitened, pattern: np.ndarray) -> np.ndarray:
    """Normal deviate of `pattern`, shape (k,), beginning at each innovation, shape (n,)."""
    reach = np.concatenate([white.innovations, np.zeros(pattern.size - 1)])
    return np.correlate(reach, pattern, mode="valid") / float(np.sqrt(pattern @ pattern))


def step_pattern(taps: np.ndarray) -> np.ndarray:
    """Innovations after a step of the zero, shape (REACH,)."""
    return np.cumsum(np.concatenate([taps, np.zeros(max(0, REACH - taps.size))]))[:REACH]


def fitted(
    white: Whitened, pattern: np.ndarray, positions: list[int], window: slice | None = None
) -> tuple[float, float, np.ndarray]:
    """Mean square of the innovations about `positions` without and with `pattern` beginning at each of them, fitted by
    least squares, and the fitted sizes in innovations' standard deviations, shape (positions,).
    """
    near = window or slice(max(0, positions[0] - 4), positions[-1] + pattern.size)
    first, last = near.start, min(white.innovations.size, near.stop)
    seen = white.innovations[first:last]
    columns = np.zeros((last - first, len(positions)))
    for column, at in enumerate(positions):
        part = pattern[: max(0, last - at)]
        columns[at - first : at - first + part.size, column] = part
    sizes = np.linalg.lstsq(columns, seen, rcond=None)[0]
    rest = seen - columns @ sizes
    return float(np.mean(seen**2)), float(np.mean(rest**2)), sizes


def peaks(deviate: np.ndarray, threshold: float, apart: int) -> list[int]:
    """Indices of the largest deviates above a threshold, each the largest within `apart` samples, in order."""
    size = np.abs(deviate)
    kept: list[int] = []
    for at in np.flatnonzero(size > threshold)[np.argsort(-size[size > threshold])][:2000]:
        if not apart or all(abs(int(at) - other) > apart for other in kept):
            kept.append(int(at))
        if apart and len(kept) >= 200:
            break
    return sorted(kept)
