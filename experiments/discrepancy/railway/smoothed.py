"""Waves that a track file has lost: measuring systems and their software smooth (EN 13848-1: D1 begins at 3 m).

Spectra of tracks in print fall by the power 0 to 4 of the wave number (ERRI B176 and FRA: `railsim/track/spectra.py`),
and white errors do not fall at all. Where the power of a file falls much faster, it was smoothed, its errors with it.
"""

import numpy as np
from scipy.optimize import minimize

SLOPES = (-4.0, 4.0)  # powers of the wave number: to fall as those in print, to rise as corrugation may
BENT = 2.0  # deviation of the change of a spectrum's slope (log by log) over an octave; illustrative
LOST = 0.5  # share of the expected power: a wave is lost where an octave has less; a choice
SKIRT = 0.6  # a filter begins before waves are lost: so near to them, as a ratio, a line must have WHOLE; a choice
WHOLE = 0.8  # share of the expected power over the third of an octave below the line, and LOST at the line; a choice
FEWEST = 32  # lines of an octave: by chance 32 have less than half of their mean once in 3600
BIN = 1.0 / 16.0  # of an octave, whose lines count by their mean
LEAST = 1e-300  # of a power


def told(power: np.ndarray, error: float) -> np.ndarray:
    """(lines,) of which waves a file tells that has this power, lines evenly from the first wave number on. `error` is
    the mean power of its errors as stated: where a file is as loud as they are, it was not smoothed after them.

    The power that is expected is a broken line in logs, a knot an octave, of the greatest likelihood of the lines that
    are not lost (Whittle 1953, Ark. Mat. 2), with slopes that tracks and white errors have.
    """
    lines = np.arange(1, len(power) + 1)
    enough = (lines >= FEWEST) & (lines <= len(power) - FEWEST)
    octave, lost, sure = np.log2(lines), np.zeros(len(power), bool), np.ones(len(power), bool)
    if not enough.any() or not power.any():
        return sure
    faint = enough & (_over(power - LOST * error, 1.0, 2.0) < 0.0)
    begins = np.flatnonzero(np.diff(np.floor(octave / BIN), prepend=-1.0))
    count = np.diff(np.append(begins, len(power)))
    mean, at = (np.add.reduceat(one, begins) / count for one in (power, octave))
    knots = np.arange(np.ceil(octave[-1]) + 1.0)
    falls = np.tril(np.ones((len(knots), len(knots))))  # of logs at the knots, by the first one and the slopes
    hats, whole = (np.stack([np.interp(one, knots, hat) for hat in np.eye(len(knots))], axis=1) @ falls
                   for one in (at, octave))  # fmt: skip
    bend = np.diff(np.eye(len(knots)), 2, axis=0) @ falls / BENT
    held = bend.T @ bend + 1e-9 * np.eye(len(knots))
    bounds = np.log(2.0) * np.tile(SLOPES, (len(knots), 1))
    bounds[0] = np.log([LEAST, power.max() + LEAST])
    found = np.full(len(knots), -2.0 * np.log(2.0))
    found[0] = np.log(mean[:4].mean() + LEAST)

    def cost(logs: np.ndarray) -> tuple[float, np.ndarray]:
        track, weight = hats @ logs, count * sure[begins]
        ratio = mean * np.exp(np.minimum(-track, -np.log(LEAST)))
        return float(weight @ (track + ratio) + 0.5 * logs @ held @ logs), hats.T @ (
            weight * (1.0 - ratio)
        ) + held @ logs

    while True:
        found = minimize(cost, found, jac=True, method="L-BFGS-B", bounds=bounds).x
        expected = np.exp(whole @ found)
        now = lost | (faint & (_over(power - LOST * expected, 1.0, 2.0) < 0.0))
        if np.array_equal(now, lost):
            here = _over(power - LOST * expected, 2.0 ** (-0.5 * BIN), 2.0 ** (0.5 * BIN)) >= 0.0
            below = _over(power - WHOLE * expected, 2.0 ** (-1.0 / 3.0), 1.0) >= 0.0
            return (here & below) | (_over(lost.astype(float), SKIRT, 1.0 / SKIRT) == 0.0)
        lost, sure = now, ~now


def shortest(kept: np.ndarray) -> int | None:
    """Number of the line from which on most of an octave is lost, or None."""
    lines, lost = np.arange(1, len(kept) + 1), _over((~kept).astype(float), 1.0, 2.0)
    found = np.flatnonzero(~kept & (2.0 * lost > np.minimum(2 * lines, len(kept)) - lines) & (lines >= FEWEST))
    return int(lines[found[0]]) if len(found) else None


def _over(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """(lines,) sum over the lines from `low` to `high` times each."""
    lines, total = np.arange(1, len(values) + 1), np.append(0.0, np.cumsum(values))
    return (
        total[np.minimum(np.floor(high * lines).astype(int), len(values))] - total[np.ceil(low * lines).astype(int) - 1]
    )
