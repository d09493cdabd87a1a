"""Rails or gauge at equal steps of distance, predicted from their own last positions: what their spectrum says.

A process with the one-sided spectrum q^2 / ((W^2 + a^2) (W^2 + b^2)) up to the shortest wave that a track's spectrum
describes, and less beyond: without that end a model with steps of 0.3 m expects two fifths of its band to be filled
which are empty, and takes their emptiness for a flat wheel or even rails. Durbin and Levinson's recursion makes the
best linear prediction of every order from the autocovariance (Brockwell and Davis 1991, proposition 5.2.1).
"""

from typing import NamedTuple

import numpy as np

ORDER = 6
"""Of the prediction: 1.8 m; the deviation of what is left falls by less than 4 % from there on."""
STEEP = 8  # power of the wave number with which the spectrum falls beyond its end, besides its own
DENSE, LONGEST = 4096, 4000.0  # points of the integral; longest wave in it, m
FLOOR = 1e-4  # white share of the variance left, for the recursion's arithmetic


class Corners(NamedTuple):
    """Corners of the spectrum (rad/m) and its shortest wave (m)."""

    slow: float
    fast: float
    shortest: float


class Process(NamedTuple):
    """Prediction of a position from `ORDER` or fewer before it.

    weights : (ORDER + 1, ORDER), row m those of the last m positions, the newest first. shares : (ORDER + 1,), variance
    of what is left over q^2, m^3. level : q, m^-0.5 of the driving noise.
    """

    weights: np.ndarray
    shares: np.ndarray
    level: float


def process(corners: Corners, level: float, length: float) -> Process:
    """Of steps of `length` m."""
    last = np.pi / length
    waves = np.concatenate([[0.0], np.geomspace(2.0 * np.pi / LONGEST, 3.0 * last, DENSE)])
    density = 1.0 / ((waves**2 + corners.slow**2) * (waves**2 + corners.fast**2))
    density /= 1.0 + (waves * corners.shortest / (2.0 * np.pi)) ** STEEP
    lags = length * np.arange(ORDER + 1)
    covariance: np.ndarray = np.asarray(np.trapezoid(density * np.cos(lags[:, None] * waves), waves, axis=1)) / np.pi
    plain = length**3 / 3.0  # of the second integral of white noise over a step
    covariance[0] += FLOOR * plain
    weights, shares = np.zeros((ORDER + 1, ORDER)), np.empty(ORDER + 1)
    shares[0] = covariance[0]
    for order in range(1, ORDER + 1):
        before = weights[order - 1, : order - 1]
        partial = (covariance[order] - before @ covariance[order - 1 : 0 : -1]) / shares[order - 1]
        weights[order, : order - 1] = before - partial * before[::-1]
        weights[order, order - 1] = partial
        shares[order] = shares[order - 1] * (1.0 - partial**2)
    return Process(weights, shares, level)
