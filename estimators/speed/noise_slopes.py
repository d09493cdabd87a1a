"""Bias by sensor noise of the unknowns of `speed.delay`: slopes and mismatch share their noise (errors in variables).

Least squares on the mismatch would shrink whatever passes most noise. The expectation of slope times mismatch from
noise alone, relative to the mismatch's noise power, depends only on the filters, the travel time and the ratio of the
two sensors' noise densities; it is tabulated here and taken out of every correction.
"""

import numpy as np
from scipy import signal

from estimators.signals.remembered import remembered
from estimators.speed.wheelset_filters import Chain


@remembered
def noise_slope(filters: Chain, rate: float, longest: float, densities: tuple[float, float]) -> np.ndarray:
    """E[slope * mismatch] / E[mismatch^2] from noise alone by travel time, and E[slope^2] / E[mismatch^2].

    Parameters
    ----------
    rate : sample rate in Hz.
    longest : largest travel time in s.
    densities : of acceleration (m/s2) and pitch rate (rad/s) per square root of Hz; only their ratio matters.

    Returns
    -------
    Shape (lags, 8), row = travel time in samples. First column: slope in the travel time itself (1/s), then the errors
    of the inverse in the order of `speed.delay`; last E[slope^2] / E[mismatch^2] of the travel time (1/s^2).
    """
    frequency = np.linspace(0, min(rate / 2, 100.0), 1001)[1:]
    s = 2j * np.pi * frequency
    response = [signal.sosfreqz(one, frequency, fs=rate)[1] for one in filters.sections[:4]]
    total, share = (densities[0] * one for one in (response[0], response[2]))
    difference, pitch_share = (densities[1] * one for one in (response[1], response[3]))
    lags = np.arange(int(np.ceil(longest * rate)) + 2)
    late = np.exp(-np.outer(lags / rate, s))
    minus, plus = 1 - late, 1 + late
    by_acceleration, by_rate = minus * total, -plus * difference
    none = np.zeros_like(minus)
    slopes = [
        (s / 2 * plus * total, -s / 2 * minus * difference),
        (minus * share, none),
        (none, -plus * pitch_share),
        (none, -plus * difference),
        (none, -s * plus * difference),
        (-s * minus * share, s * plus * pitch_share),
        (s * minus * (total - share), none),
    ]
    power = np.maximum(np.sum(np.abs(by_acceleration) ** 2 + np.abs(by_rate) ** 2, axis=1), 1e-300)
    columns = [np.sum((by_acceleration.conj() * a + by_rate.conj() * q).real, axis=1) / power for a, q in slopes]
    columns.append(np.sum(np.abs(slopes[0][0]) ** 2 + np.abs(slopes[0][1]) ** 2, axis=1) / power)
    return np.ascontiguousarray(np.stack(columns, axis=1))


@remembered
def power(filters: Chain, rate: float, densities: tuple[float, float]) -> float:
    """Power of the sensors' noise in each wheelset's signal, (m/s2)^2; arguments as of `noise_slope`."""
    frequency = np.linspace(0, rate / 2, 4001)[1:]
    seen = [np.abs(signal.sosfreqz(one, frequency, fs=rate)[1]) ** 2 for one in filters.sections[:2]]
    return float(sum(density**2 * np.trapezoid(one, frequency) for density, one in zip(densities, seen, strict=True)))
