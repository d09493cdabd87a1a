"""Condition of secondary dampers and conicity by maximum likelihood over the whole record: the accuracy reference."""

import numpy as np
import pandas as pd
from scipy.optimize import minimize

from estimators._half_vehicle import PARAMETERS
from estimators._suspension import Problem, SuspensionEstimator
from estimators._verdicts import std_name
from estimators.interface import Estimate
from estimators.suspension_rbpf import COLUMNS, report
from railsim.measurements import Measurements
from railsim.spec import quantity

STEP = 0.01  # of the box, for derivatives
REGULAR = 1e-9


class SuspensionMl(SuspensionEstimator, frozen=True):
    """Parameters that are constant over the record, at the largest likelihood of the same Kalman filters.

    The standard deviations are those of the inverse Hessian of the logarithm of the likelihood, which is multiplied by
    the share of independent samples as in `suspension_rbpf`: the Cramer-Rao bound of the model, were it right.
    """

    starts: int = quantity(64, unit="-", source="illustrative: random places of the box, the best begins", ge=1)
    seed: int = quantity(1, unit="-", source="random numbers of the starts", ge=0)

    def estimate(self, measurements: Measurements) -> Estimate:
        """Fit the record.

        Raises
        ------
        InputError : a channel, the speed, the track or a parameter of the vehicle is missing.
        """
        problem = self.prepare(measurements)
        rng = np.random.default_rng(self.seed)
        places = rng.random((self.starts, 3))
        best = places[int(np.argmax(cost_of(problem, places) * -1.0))]
        found = minimize(
            lambda place: float(cost_of(problem, place[None, :])[0]),
            best,
            method="L-BFGS-B",
            jac=lambda place: gradient(problem, place),
            bounds=[(0.0, 1.0)] * 3,
        )
        size = problem.high - problem.low
        mean, std = problem.low + found.x * size, np.sqrt(np.diag(np.abs(covariance(problem, found.x)))) * size
        time = problem.record.time[[0, -1]]
        row = [value for pair in zip(mean, std, strict=True) for value in pair]
        names = [name for pair in ((one, std_name(one)) for one in PARAMETERS) for name in pair]
        rows = [[at, *row, 1.0, 0.0, 1.0] for at in time]
        series = pd.DataFrame(rows, columns=pd.Index(["time [s]", *names, *COLUMNS]))
        return Estimate(self.name, series, report(self, problem, series, []))


def cost_of(problem: Problem, places: np.ndarray) -> np.ndarray:
    """Minus the logarithm of the likelihood at places (p, 3) of the unit cube, for independent samples, shape (p,)."""
    found = problem.likelihood(problem.low + places * (problem.high - problem.low))
    return -problem.trust * np.where(np.isfinite(found), found, -1e12)


def gradient(problem: Problem, place: np.ndarray) -> np.ndarray:
    """Slope of the cost by central differences, shape (3,)."""
    steps = STEP * 0.1 * np.eye(3)
    found = cost_of(problem, np.concatenate([place + steps, place - steps]))
    return (found[:3] - found[3:]) / (STEP * 0.2)


def covariance(problem: Problem, place: np.ndarray) -> np.ndarray:
    """Inverse Hessian of the cost, shape (3, 3), in units of the box."""
    steps = STEP * np.eye(3)
    pairs = [(i, j) for i in range(3) for j in range(3)]
    points = [place + a * steps[i] + b * steps[j] for i, j in pairs for a in (1, -1) for b in (1, -1)]
    values = cost_of(problem, np.array(points)).reshape(3, 3, 4) @ np.array([1.0, -1.0, -1.0, 1.0])
    return np.linalg.pinv(values / (4.0 * STEP**2) + REGULAR * np.eye(3))
