"""Condition of secondary dampers and conicity by maximum likelihood over the whole record: the accuracy reference."""

import numpy as np
import pandas as pd
from scipy.optimize import minimize

from estimators.interface import Estimate
from estimators.suspension.base import Problem, SuspensionEstimator
from estimators.suspension.suspension_rbpf import COLUMNS, checked
from estimators.suspension.verdicts import std_name
from estimators.vehicle.affine import PARAMETERS
from railsim.measurements import Measurements
from railsim.spec import quantity

STEP = 0.01  # of the box, for derivatives
LEVELS = (0.25, 0.5, 1.0, 2.0, 4.0)  # of `track_level`, between which its logarithm is sought
REGULAR = 1e-9


class SuspensionMl(SuspensionEstimator, frozen=True):
    """Lateral and yaw damping and conicity of a half vehicle, by maximum likelihood over the whole record.

    The likelihood is that of the Kalman filters of `suspension_rbpf`. The standard deviations are those of the inverse
    Hessian of the logarithm of the likelihood, which is multiplied by the share of independent samples as in
    `suspension_rbpf`: the Cramer-Rao bound of the model, were it right.
    """

    fit_level: bool = quantity(
        False, unit="-", source="the level of an unknown track by likelihood too; five times the work"
    )
    starts: int = quantity(64, unit="-", source="illustrative: random points of the box, the best begins", ge=1)
    seed: int = quantity(1, unit="-", source="random numbers of the starts", ge=0)

    def estimate(self, measurements: Measurements) -> Estimate:
        """Fit the record.

        Raises
        ------
        InputError : a channel, the speed, the track or a parameter of the vehicle is missing.
        """
        if not (self.fit_level and self.track == "unknown"):
            problem = self.prepare(measurements)
            return self._estimate(problem, *self._fit(problem)[:2], {})
        return self._with_level(measurements)

    def _with_level(self, measurements: Measurements) -> Estimate:
        """The largest likelihood over the level as well: a parabola through the best of `LEVELS` and its neighbours."""
        problems = [self.but(track_level=self.track_level * one).prepare(measurements) for one in LEVELS]
        fits = [self._fit(problem) for problem in problems]
        best = min(max(int(np.argmin([cost for _, _, cost in fits])), 1), len(LEVELS) - 2)
        near = range(best - 1, best + 2)
        logs = np.log([problems[i].settings.track_level for i in near])
        curvature, slope, _ = np.polyfit(logs - logs[1], [fits[i][2] for i in near], 2)
        at = (
            float(np.clip(-slope / (2.0 * curvature), logs[0] - logs[1], logs[2] - logs[1])) if curvature > 0.0 else 0.0
        )
        fitted = self.but(track_level=float(np.exp(logs[1] + at)))
        problem = fitted.prepare(measurements)
        mean, std, _ = fitted._fit(problem)
        drift = (fits[best + 1][0] - fits[best - 1][0]) / (logs[2] - logs[0])
        level_std = 1.0 / np.sqrt(2.0 * curvature) if curvature > 0.0 else np.inf
        about = {"track_level": fitted.track_level, "track_level_log_std": float(level_std)}
        return self._estimate(problem, mean, np.hypot(std, drift * level_std), about)

    def _fit(self, problem: Problem) -> tuple[np.ndarray, np.ndarray, float]:
        """Parameters (3,), their standard deviations, and minus the logarithm of the likelihood there."""
        rng = np.random.default_rng(self.seed)
        points = rng.random((self.starts, 3))
        best = points[int(np.argmin(cost_of(problem, points)))]
        solution = minimize(
            lambda point: float(cost_of(problem, point[None, :])[0]),
            best,
            method="L-BFGS-B",
            jac=lambda point: gradient(problem, point),
            bounds=[(0.0, 1.0)] * 3,
        )
        size = problem.high - problem.low
        variance = np.diag(covariance(problem, solution.x))
        determined = variance > 0.0  # else the cost does not bend up there: as wide as the box
        std = np.sqrt(np.where(determined, variance, 1.0)) * size
        return problem.low + solution.x * size, std, float(solution.fun)

    def _estimate(self, problem: Problem, mean: np.ndarray, std: np.ndarray, about: dict[str, float]) -> Estimate:
        """The same values at the first and last sample."""
        row = [value for pair in zip(mean, std, strict=True) for value in pair]
        names = [name for pair in ((one, std_name(one)) for one in PARAMETERS) for name in pair]
        rows = [[at, *row, 1.0, 0.0, 1.0] for at in problem.record.time[[0, -1]]]
        columns = pd.Index(["time [s]", *names, *COLUMNS])
        series = pd.DataFrame(rows, columns=columns)
        constant = pd.DataFrame([rows[-1]], columns=columns)
        estimate = checked(self, problem, series, constant, [])
        return Estimate(self.name, estimate.series, {**estimate.about, **about})


def cost_of(problem: Problem, points: np.ndarray) -> np.ndarray:
    """Minus the logarithm of the likelihood at points (p, 3) of the unit cube, for independent samples, shape (p,)."""
    found = problem.likelihood(problem.low + points * (problem.high - problem.low))
    return -problem.trust * np.where(np.isfinite(found), found, -1e12)


def gradient(problem: Problem, point: np.ndarray) -> np.ndarray:
    """Slope of the cost by central differences, shape (3,)."""
    steps = STEP * 0.1 * np.eye(3)
    costs = cost_of(problem, np.concatenate([point + steps, point - steps]))
    return (costs[:3] - costs[3:]) / (STEP * 0.2)


def covariance(problem: Problem, point: np.ndarray) -> np.ndarray:
    """Inverse Hessian of the cost, shape (3, 3), in units of the box."""
    steps = STEP * np.eye(3)
    pairs = [(i, j) for i in range(3) for j in range(3)]
    points = [point + a * steps[i] + b * steps[j] for i, j in pairs for a in (1, -1) for b in (1, -1)]
    values = cost_of(problem, np.array(points)).reshape(3, 3, 4) @ np.array([1.0, -1.0, -1.0, 1.0])
    return np.linalg.pinv(values / (4.0 * STEP**2) + REGULAR * np.eye(3))
