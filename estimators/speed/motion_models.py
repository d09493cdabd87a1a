"""Interacting multiple models of a train's motion with the mismatch of the wheelsets' signals as the only measurement.

Blom and Bar-Shalom 1988. Every model is an extended Kalman filter over the unknowns of `speed.delay`; they differ in
how freely speed and acceleration may change.
"""

from typing import NamedTuple

import numpy as np

from estimators.filters.kalman import correct
from estimators.speed.delay import UNKNOWNS
from railsim.compiled import as_written


class Motion(NamedTuple):
    """Bank of filters.

    Attributes
    ----------
    x, P : states and covariances of the models, shapes (models, 8) and (models, 8, 8).
    weight : probability of each model, shape (models,).
    keep : share of the acceleration kept over a step, shape (models,).
    Q : variance added to each unknown over a step, shape (models, 8).
    switch : probability to leave a model within a step.
    """

    x: np.ndarray
    P: np.ndarray
    weight: np.ndarray
    keep: np.ndarray
    Q: np.ndarray
    switch: float


def filter_bank(relax: np.ndarray, diffusion: np.ndarray, step: float, switch_rate: float) -> Motion:
    """A bank for steps of `step` s.

    Parameters
    ----------
    relax : time constants of the acceleration's decay in s (infinite: none), shape (models,).
    diffusion : growth of each unknown's variance per s, shape (models, 8).
    switch_rate : how often a model is left, 1/s.
    """
    models = len(relax)
    return Motion(
        np.zeros((models, UNKNOWNS)),
        np.zeros((models, UNKNOWNS, UNKNOWNS)),
        np.full(models, 1 / models),
        np.exp(-step / relax),
        diffusion * step,
        switch_rate * step,
    )


@as_written
def start(motion: Motion, x: np.ndarray, variance: np.ndarray) -> None:
    """Begin at `x` with independent variances, every model alike."""
    motion.weight[:] = 1 / len(motion.weight)
    for j in range(len(motion.weight)):
        motion.x[j] = x
        motion.P[j] = np.diag(variance)


@as_written
def mean(motion: Motion) -> np.ndarray:
    """The models' weighted mean."""
    return motion.weight @ motion.x


@as_written
def covariance(motion: Motion, centre: np.ndarray) -> np.ndarray:
    """The mixture's covariance about its mean `centre`."""
    total = np.zeros((UNKNOWNS, UNKNOWNS))
    for j in range(len(motion.weight)):
        _add_part(total, motion.weight[j], motion.P[j], motion.x[j], centre)
    return total


@as_written
def _add_part(total: np.ndarray, weight: float, P: np.ndarray, x: np.ndarray, centre: np.ndarray) -> None:
    """Add a model's share of a mixture's covariance about its mean: loops, which make no arrays."""
    for a in range(UNKNOWNS):
        off = x[a] - centre[a]
        for b in range(UNKNOWNS):
            total[a, b] += weight * (P[a, b] + off * (x[b] - centre[b]))


@as_written
def predict(motion: Motion, step: float, gain: float) -> None:
    """Mix the models and move them on by one step, in which the measured acceleration adds `gain` to the speed."""
    models = len(motion.weight)
    x, P, weight = motion.x.copy(), motion.P.copy(), motion.weight.copy()
    other = motion.switch / (models - 1)
    for j in range(models):
        into = weight * other
        into[j] = weight[j] * (1 - motion.switch)
        motion.weight[j] = into.sum()
        into /= motion.weight[j]
        centre, mixed = motion.x[j], motion.P[j]
        centre[:] = 0.0
        for i in range(models):
            for a in range(UNKNOWNS):
                centre[a] += into[i] * x[i, a]
        mixed[:] = 0.0
        for i in range(models):
            _add_part(mixed, into[i], P[i], x[i], centre)
        _move_on(centre, mixed, step, motion.keep[j])
        centre[0] += gain
        for k in range(UNKNOWNS):
            mixed[k, k] += motion.Q[j, k]


@as_written
def _move_on(x: np.ndarray, P: np.ndarray, step: float, keep: float) -> None:
    """x = F x and P = F P F', with F the unit matrix but for F[0, 1] = step and F[1, 1] = keep."""
    x[0] += step * x[1]
    x[1] *= keep
    for b in range(UNKNOWNS):
        P[0, b] += step * P[1, b]
        P[1, b] *= keep
    for a in range(UNKNOWNS):
        P[a, 0] += step * P[a, 1]
        P[a, 1] *= keep


@as_written
def _product(P: np.ndarray, h: np.ndarray, out: np.ndarray) -> float:
    """out = P h, and h' P h: loops, which cost less than calls for so few numbers."""
    total = 0.0
    for a in range(UNKNOWNS):
        out[a] = 0.0
        for b in range(UNKNOWNS):
            out[a] += P[a, b] * h[b]
        total += h[a] * out[a]
    return total


@as_written
def correct_models(
    motion: Motion, errors: np.ndarray, slopes: np.ndarray, R: float, noise_slope: np.ndarray, real: float
) -> None:
    """Use each model's mismatch (shape (models,)) and its slopes (models, 8).

    R is the variance of the mismatch's noise, `noise_slope` (models, 8) what noise alone gives for slope times
    mismatch, `real` the share of the slopes' power that is not noise (reliability ratio of errors in variables, Fuller
    1987): the noise counts as R / real, and that share of the knowledge is kept which the noisy slopes would then seem
    to give.
    """
    log_weight, gain, moved = np.empty(len(errors)), np.empty(UNKNOWNS), np.empty(UNKNOWNS)
    for j in range(len(errors)):
        S = _product(motion.P[j], slopes[j], gain) + R / real
        limit = 4 * np.sqrt(S)
        error = min(max(errors[j], -limit), limit)
        _product(motion.P[j], noise_slope[j], moved)
        for a in range(UNKNOWNS):
            motion.x[j, a] += moved[a] / S
        correct(motion.x[j], motion.P[j], gain, S / real, -error / real)
        for a in range(UNKNOWNS):
            for b in range(a + 1):
                motion.P[j, a, b] = motion.P[j, b, a] = (motion.P[j, a, b] + motion.P[j, b, a]) / 2
        log_weight[j] = np.log(motion.weight[j]) - error * error / (2 * S) - np.log(S) / 2
    weight = np.exp(log_weight - log_weight.max())
    motion.weight[:] = np.maximum(weight / weight.sum(), 1e-9)
    motion.weight[:] /= motion.weight.sum()
