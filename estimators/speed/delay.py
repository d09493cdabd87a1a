"""Mismatch of the trailing wheelset's signal with the leading one's a delay earlier; its slopes in every unknown.

Unknowns x = (V, a, alpha, beta, gamma, epsilon, delta, eta): speed, acceleration, and small errors of the inverse that
let one wheelset's movement leak into the other's: bogie mass over stiffness, pitch inertia over stiffness, gain of the
pitch rate against the acceleration (all relative), lead of the pitch rate before the acceleration (s), primary damping
over stiffness (s), secondary damping over primary stiffness (s; R = S - P is the acceleration itself in the band).
With halved sum S and difference D of the wheelsets' signals, their inertial shares P, Q (see `speed.wheelset_filters`):

    S_x = S + alpha P - delta P' + eta R',   D_x = (1 + gamma) D + beta Q + epsilon D' - delta Q'
    w_1'' = S_x + D_x,   w_2'' = S_x - D_x
    e(x) = w_2''(t) - w_1''(t - T),   2 Lb = V T - a T^2 / 2

At the true x the mismatch of noise-free signals is zero for every stretch of signal, however short: there is no window
and no bias from its ends.
"""

import numpy as np

from railsim.compiled import as_written, kernel

UNKNOWNS = 8
REACH = 3  # samples on either side that interpolation and derivatives need


@kernel
def travel_time(wheelbase: float, speed: float, acceleration: float) -> float:
    """Time T that the last `wheelbase` metres took; solves 2 Lb = V T - a T^2 / 2 (s)."""
    root = speed * speed - 2 * acceleration * wheelbase
    return 2 * wheelbase / (speed + np.sqrt(max(root, 0.0)))


@as_written
def mismatch(
    signals: np.ndarray, now: int, rate: float, wheelbase: float, x: np.ndarray, slopes: np.ndarray
) -> tuple[float, float]:
    """The mismatch e and the power (w_1^2 + w_2^2) / 2; fills `slopes` with de/dx.

    Parameters
    ----------
    signals : S, D, P, Q, shape (4, samples).
    now : index of time t; `REACH` samples on either side of t and t - T must exist.
    """
    lag = travel_time(wheelbase, x[0], x[1])
    back = now - lag * rate
    whole = int(np.floor(back))
    weights, slants = _lagrange(back - whole)
    here, here_slope = np.empty(4), np.empty(4)
    there, there_slope = np.zeros(4), np.zeros(4)
    for row in range(4):
        line = signals[row]
        here[row] = line[now]
        here_slope[row] = (8 * (line[now + 1] - line[now - 1]) - (line[now + 2] - line[now - 2])) * rate / 12
        for k in range(6):
            there[row] += weights[k] * line[whole - 2 + k]
            there_slope[row] += slants[k] * line[whole - 2 + k] * rate
    sum_here, difference_here = _corrected(here, here_slope, x)
    sum_there, difference_there = _corrected(there, there_slope, x)
    second, first = sum_here - difference_here, sum_there + difference_there
    second_slope = here_slope[0] + x[2] * here_slope[2] - (1 + x[4]) * here_slope[1] - x[3] * here_slope[3]
    first_slope = there_slope[0] + x[2] * there_slope[2] + (1 + x[4]) * there_slope[1] + x[3] * there_slope[3]
    per_lag = (first_slope + second_slope) / 2
    ahead = max(x[0] - x[1] * lag, 0.1)
    slopes[0] = -per_lag * lag / ahead
    slopes[1] = per_lag * lag * lag / (2 * ahead)
    slopes[2] = here[2] - there[2]
    slopes[3] = -here[3] - there[3]
    slopes[4] = -here[1] - there[1]
    slopes[5] = -here_slope[1] - there_slope[1]
    slopes[6] = -here_slope[2] + here_slope[3] + there_slope[2] + there_slope[3]
    slopes[7] = here_slope[0] - here_slope[2] - there_slope[0] + there_slope[2]
    return second - first, (first * first + second * second) / 2


@as_written
def _corrected(value: np.ndarray, slope: np.ndarray, x: np.ndarray) -> tuple[float, float]:
    """Halved sum and difference of the wheelsets' signals with the errors of the inverse taken out."""
    total = value[0] + x[2] * value[2] - x[6] * slope[2] + x[7] * (slope[0] - slope[2])
    difference = (1 + x[4]) * value[1] + x[3] * value[3] + x[5] * slope[1] - x[6] * slope[3]
    return total, difference


@as_written
def _lagrange(fraction: float) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the six samples -2 ... 3 for the value and the derivative (per sample) at `fraction` in 0 ... 1."""
    weights, slants = np.empty(6), np.empty(6)
    for k in range(6):
        product, slope, scale = 1.0, 0.0, 1.0
        for j in range(6):
            if j != k:
                distance = fraction - (j - 2)
                slope = slope * distance + product
                product *= distance
                scale *= k - j
        weights[k] = product / scale
        slants[k] = slope / scale
    return weights, slants
