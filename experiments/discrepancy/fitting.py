"""Fit: maximum of the posterior of nuisances, and of an effect's parameters, by Gauss-Newton with re-linearisation."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from experiments.discrepancy.evidence import Evidence
from experiments.discrepancy.forward import Forward, Prediction
from experiments.discrepancy.frames import REDUNDANCY, Frames, stack
from experiments.discrepancy.noise import (
    PERTURBED,
    Whitener,
    covariance_of,
    perturbed_tracks,
    propagated_track_error,
    whitener,
)
from experiments.discrepancy.parallel import in_parallel
from railsim.effects.interface import Effect

STEP = 0.3  # standard deviations of the prior, of the differences
SEED = 20110901  # of the perturbed tracks: the same in every run, so that evidence can be compared
SHORTENED = (1.0, 0.4, 0.1)  # shares of a step that are tried
TOLERATED = 3.0  # standard deviations of its prior within which a nuisance stays: more is no tolerance but an effect
STRONG = 20.0  # information of the data on a nuisance, in that of its prior, from which its column is made again
WEIGHT = 1.0 / np.sqrt(REDUNDANCY)


@dataclass(frozen=True)
class Problem:
    """Measured coefficients, how to predict them, and the noise.

    Attributes
    ----------
    measured : (k, f, c). train, test : (k,) masks of frames. white : noise at the last point that it was made for.
    """

    forward: Forward
    frames: Frames
    measured: np.ndarray
    train: np.ndarray
    test: np.ndarray
    white: Whitener | None = None

    @property
    def evidence(self) -> Evidence:
        """What was measured."""
        return self.forward.evidence

    def but(self, **changes: Any) -> "Problem":
        """A copy with some parts changed."""
        return replace(self, **changes)

    def stacked(self, prediction: Prediction) -> np.ndarray:
        """(k, f, c) of a prediction."""
        return stack(self.frames, self.evidence.channels, prediction, self.evidence.rates)

    def whitened(self, coefficients: np.ndarray) -> np.ndarray:
        """(k, f, 2 c) in standard deviations of the noise; raises where no noise was stated yet."""
        if self.white is None:
            raise ValueError("state the noise first")
        return self.white(coefficients)

    def residual(self, prediction: Prediction) -> np.ndarray:
        """(k, f, 2 c) whitened measured minus predicted."""
        return self.whitened(self.measured - self.stacked(prediction))

    def whitened_columns(self, columns: np.ndarray) -> np.ndarray:
        """(n, k, f, 2 c) of the derivatives (n, k, f, c) of coefficients."""
        return np.stack([self.whitened(one).astype(np.float32) for one in columns])

    def with_noise(self, z: np.ndarray, effects: Sequence[Effect] = (), runs: int = PERTURBED) -> "Problem":
        """The problem with its noise propagated through the model at z by so many runs on perturbed tracks."""
        base = self.forward.predict(z, effects)
        tracks = perturbed_tracks(self.evidence, SEED, runs)
        passed = propagated_track_error(self.forward, self.frames, z, effects, base, tracks)
        covariance = covariance_of(self.evidence, self.frames, self.stacked(base), passed)
        return self.but(white=whitener(covariance, self.measured))


@dataclass(frozen=True)
class Fit:
    """A point with its residual and linearisation.

    Attributes
    ----------
    z : scores of the nuisances. effects : with their fitted parameters. residual : (k, f, 2 c). columns :
    (nuisances, k, f, c) derivatives of the predicted coefficients. jacobian : the same, whitened. prediction : by
    channel.
    """

    z: np.ndarray
    effects: tuple[Effect, ...]
    residual: np.ndarray
    columns: np.ndarray
    jacobian: np.ndarray
    prediction: Prediction

    def cost(self, frames: np.ndarray) -> float:
        """Half the sum of squares over some frames, plus the nuisances' prior."""
        return cost(self.residual, self.z, frames)


def cost(residual: np.ndarray, z: np.ndarray, frames: np.ndarray) -> float:
    """Negative logarithm of the posterior but for constants."""
    return 0.5 * float(np.sum((WEIGHT * residual[frames]) ** 2)) + 0.5 * float(z @ z)


def nuisance_jacobian(
    problem: Problem, z: np.ndarray, effects: Sequence[Effect], old: np.ndarray | None = None
) -> tuple[np.ndarray, Prediction]:
    """(nuisances, k, f, c) derivative of the predicted coefficients by every nuisance, and the prediction.

    Of an `old` one only the columns are made again of which the data say much.
    """
    forward = problem.forward
    setup, truth = forward.run(z, effects)
    base = forward.observe(setup, truth, z)
    stacked = problem.stacked(base)

    def column(number: int) -> np.ndarray:
        if old is not None and np.sum((WEIGHT * problem.whitened(old[number])[problem.train]) ** 2) < STRONG:
            return old[number]
        step = -STEP if z[number] > 0.0 else STEP
        moved = z.copy()
        moved[number] += step
        if forward.nuisances[number].of_sensor:
            prediction = forward.observe(setup, truth, moved)
        else:
            prediction = forward.predict(moved, effects)
        return ((problem.stacked(prediction) - stacked) / step).astype(np.complex64)

    return np.stack(in_parallel(column, range(len(z)))), base


def normal_equations(jacobian: np.ndarray, residual: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """J^T J and J^T r over some frames."""
    flat = (WEIGHT * jacobian[:, frames]).reshape(len(jacobian), -1).astype(np.float64)
    return flat @ flat.T, flat @ (WEIGHT * residual[frames]).ravel()


def fit_nuisances(
    problem: Problem,
    z: np.ndarray | None = None,
    effects: Sequence[Effect] = (),
    rounds: int = 2,
    columns: np.ndarray | None = None,
    tell: Callable[[str], None] = lambda text: None,
) -> Fit:
    """Nuisances alone, the effects held; each round re-linearises and takes up to three steps with it.

    With `columns` the first round goes without linearising.
    """
    z = np.zeros(len(problem.forward.nuisances)) if z is None else z
    if columns is None:
        columns, prediction = nuisance_jacobian(problem, z, effects)
    else:
        prediction = problem.forward.predict(z, effects)
    jacobian = problem.whitened_columns(columns)
    residual = problem.residual(prediction)
    for number in range(rounds):
        if number:
            columns, prediction = nuisance_jacobian(problem, z, effects, columns)
            jacobian = problem.whitened_columns(columns)
        for _ in range(3):
            z_new, residual_new, prediction_new = _step(problem, z, effects, residual, jacobian)
            gain = cost(residual, z, problem.train) - cost(residual_new, z_new, problem.train)
            if gain <= 0.0:
                break
            z, residual, prediction = z_new, residual_new, prediction_new
            if gain < 0.5:
                break
        tell(f"nuisances, linearised {number + 1} times: cost {cost(residual, z, problem.train):.0f}")
    return Fit(z, tuple(effects), residual, columns, jacobian, prediction)


def _step(
    problem: Problem, z: np.ndarray, effects: Sequence[Effect], residual: np.ndarray, jacobian: np.ndarray
) -> tuple[np.ndarray, np.ndarray, Prediction]:
    normal, gradient = normal_equations(jacobian, residual, problem.train)
    now = cost(residual, z, problem.train)
    trial = z, residual, {}
    for share in SHORTENED:
        at = bounded_step(normal + np.eye(len(z)), gradient - z, z, share)
        prediction = problem.forward.predict(at, effects)
        trial = at, problem.residual(prediction), prediction
        if cost(trial[1], at, problem.train) < now:
            break
    return trial


def bounded_step(matrix: np.ndarray, slope: np.ndarray, z: np.ndarray, share: float) -> np.ndarray:
    """z after a share of a Newton step that keeps every score within `TOLERATED`; scores at their bounds stay there
    while the step would leave them.
    """
    free = np.ones(len(z), bool)
    move = np.zeros(len(z))
    for _ in range(4):
        move[:] = 0.0
        move[free] = np.linalg.solve(matrix[np.ix_(free, free)], slope[free])
        leaving = free & (np.abs(z) >= TOLERATED - 1e-9) & (z * move > 0.0)
        if not leaving.any():
            break
        free &= ~leaving
    return np.clip(z + share * move, -TOLERATED, TOLERATED)


def at_bound(z: np.ndarray) -> np.ndarray:
    """Which nuisances stand at the edge of their tolerance."""
    return np.abs(z) >= TOLERATED - 1e-9
