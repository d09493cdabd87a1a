"""Speed from samples of a receiver or of a column: Kalman filter and Rauch-Tung-Striebel smoother.

The speed is an integrated random walk: its acceleration changes as white jerk of unknown density, which is found by
maximum likelihood from the innovations. Between two samples the mean of this model is a cubic (Wahba 1978).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import minimize_scalar

from railsim.compiled import allocating
from railsim.errors import InputError

_DENSITIES = (-8.0, 4.0)
"""Decimal logarithms of the jerk's density over the samples' variance, 1/s5, between which the likelihood is sought."""
_START = 1e3
"""Standard deviations of the samples that speed and acceleration may be off at the start: unknown."""
_FEWEST = 4
_FINEST = 1e-4
"""m/s; a smaller standard deviation of a sample is no data sheet's."""


@dataclass(frozen=True)
class SmoothedSpeed:
    """What the samples say.

    Attributes
    ----------
    time : s, shape (n,).
    speed : m/s, shape (n,).
    speed_std : standard deviation of `speed`, m/s, shape (n,).
    sample_std : standard deviation of the samples, m/s: as stated, or as the samples scatter.
    """

    time: np.ndarray
    speed: np.ndarray
    speed_std: np.ndarray
    sample_std: float


def smooth_speed(
    time: np.ndarray, values: np.ndarray, step: float, longest: float, sample_std: float | None = None
) -> SmoothedSpeed:
    """Speed every `step` s from the first to the last sample.

    Parameters
    ----------
    time, values : of the samples, s and m/s, shape (k,); NaN is lost.
    step : of the result, s; not longer than the samples' is taken.
    longest : gap between samples, s, over which nothing is known: NaN there.
    sample_std : standard deviation of a sample, m/s; None: found from the samples.

    Raises
    ------
    InputError : fewer than four samples.
    """
    good = np.isfinite(values)
    if good.sum() < _FEWEST:
        raise InputError(f"{int(good.sum())} samples of speed are too few; give {_FEWEST} or more")
    time, values = time[good], values[good]
    sample_std = None if sample_std is None else max(sample_std, _FINEST)
    gaps = np.diff(time)

    def scored(exponent: float) -> tuple[float, float]:
        squares, logarithms = _filtered(gaps, values, 10.0**exponent, _START**2)[:2]
        variance = max(squares / len(values), _FINEST**2) if sample_std is None else sample_std**2
        return 0.5 * (squares / variance + logarithms + len(values) * np.log(variance)), variance

    found: Any = minimize_scalar(lambda e: scored(e)[0], bounds=_DENSITIES, method="bounded", options={"xatol": 0.02})
    variance = max(scored(float(found.x))[1], 1e-12)
    _, _, means, spreads = _filtered(gaps, values, 10.0 ** float(found.x), _START**2)
    means, spreads = _backwards(gaps, 10.0 ** float(found.x), means, spreads)
    step = min(step, float(np.median(gaps)))
    fine = time[0] + step * np.arange(int(np.floor((time[-1] - time[0]) / step + 1e-9)) + 1)
    speed = CubicHermiteSpline(time, means[:, 0], means[:, 1])(fine)
    at = np.clip(np.searchsorted(time, fine, side="right") - 1, 0, len(gaps) - 1)
    lost = (gaps[at] > longest) & (fine > time[at] + 1e-9) & (fine < time[at + 1] - 1e-9)
    deviation = np.sqrt(variance * np.interp(fine, time, spreads[:, 0, 0]))
    return SmoothedSpeed(fine, np.where(lost, np.nan, speed), deviation, float(np.sqrt(variance)))


@allocating
def _filtered(
    gaps: np.ndarray, values: np.ndarray, density: float, start: float
) -> tuple[float, float, np.ndarray, np.ndarray]:
    """Squares and logarithms of the innovations, means (k, 2) and covariances (k, 2, 2) by the samples so far; unit
    variance of a sample.
    """
    count = len(values)
    means, spreads = np.empty((count, 2)), np.empty((count, 2, 2))
    v, a = values[0], 0.0
    p, c, q = start, 0.0, start
    squares, logarithms = 0.0, 0.0
    for i in range(count):
        if i > 0:
            h = gaps[i - 1]
            v += h * a
            p += 2.0 * h * c + h * h * q + density * h**3 / 3.0
            c += h * q + density * h * h / 2.0
            q += density * h
        s = p + 1.0
        off = values[i] - v
        squares += off * off / s
        logarithms += np.log(s)
        first, second = p / s, c / s
        v += first * off
        a += second * off
        p, c, q = p - first * p, c - first * c, q - second * c
        means[i, 0], means[i, 1] = v, a
        spreads[i, 0, 0], spreads[i, 0, 1], spreads[i, 1, 0], spreads[i, 1, 1] = p, c, c, q
    return squares, logarithms, means, spreads


@allocating
def _backwards(
    gaps: np.ndarray, density: float, means: np.ndarray, spreads: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Means and covariances by all samples (Rauch, Tung and Striebel 1965)."""
    smooth, spread = means.copy(), spreads.copy()
    for i in range(len(gaps) - 1, -1, -1):
        h = gaps[i]
        p, c, q = spreads[i, 0, 0], spreads[i, 0, 1], spreads[i, 1, 1]
        a, b, d = p + 2 * h * c + h * h * q + density * h**3 / 3, c + h * q + density * h * h / 2, q + density * h
        det = a * d - b * b
        # gain = P F' / (F P F' + Q)
        top, low = p + h * c, c + h * q
        g00, g01 = (top * d - c * b) / det, (c * a - top * b) / det
        g10, g11 = (low * d - q * b) / det, (q * a - low * b) / det
        e0 = smooth[i + 1, 0] - (means[i, 0] + h * means[i, 1])
        e1 = smooth[i + 1, 1] - means[i, 1]
        smooth[i, 0] += g00 * e0 + g01 * e1
        smooth[i, 1] += g10 * e0 + g11 * e1
        da, db, dd = spread[i + 1, 0, 0] - a, spread[i + 1, 0, 1] - b, spread[i + 1, 1, 1] - d
        spread[i, 0, 0] = p + g00 * g00 * da + 2 * g00 * g01 * db + g01 * g01 * dd
        spread[i, 0, 1] = c + g00 * g10 * da + (g00 * g11 + g01 * g10) * db + g01 * g11 * dd
        spread[i, 1, 0] = spread[i, 0, 1]
        spread[i, 1, 1] = q + g10 * g10 * da + 2 * g10 * g11 * db + g11 * g11 * dd
    return smooth, spread
