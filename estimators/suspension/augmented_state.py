"""State and parameters in one vector, for the Kalman filters that linearise or sample: z = [x; theta].

theta stands in units of the box, so that both filters work on numbers of order one; it walks at random. The vehicle's
matrices at any theta come by polynomials between Chebyshev points, as the particles' gains do.
"""

from abc import abstractmethod
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from estimators.suspension.base import Problem, Situation, SuspensionEstimator
from estimators.suspension.discrete_model import discrete
from estimators.suspension.filter_bank import chebyshev, lagrange
from estimators.suspension.suspension_rbpf import COLUMNS, checked
from estimators.suspension.verdicts import std_name
from estimators.vehicle.affine import INPUTS, PARAMETERS
from railsim.measurements import Measurements
from railsim.spec import quantity

POINTS = 4
START_STATE = 1e-2  # standard deviation of every state at the start, in m, rad, m/s, rad/s (illustrative)


class JointEstimator(SuspensionEstimator, frozen=True):
    """What the filters of state and parameters share: settings, and the run over a record."""

    first: tuple[float, float, float] = quantity(
        (0.6, 0.6, 0.3), unit="- of the box: where the parameters start", source="the middle, nearly"
    )
    first_std: float = quantity(0.2, unit="- of the box", source="illustrative", gt=0.0)
    walk: float = quantity(0.002, unit="- of the box a root second", source="as suspension_rbpf", ge=0.0)
    every: int = quantity(4, unit="samples between two steps", source="64 Hz of 256; the low-pass allows it", ge=1)

    def estimate(self, measurements: Measurements) -> Estimate:
        """Run over the record; raises `InputError` as `suspension_rbpf`."""
        problem = self.prepare(measurements)
        return run(self, problem, self.walk**2 * self.every / problem.record.rate)

    @abstractmethod
    def begin(self, now: "Matrices", mean: np.ndarray, covariance: np.ndarray, walk: float) -> "Joint":
        """The filter at its start.

        Parameters
        ----------
        mean, covariance : of state and parameters, shapes (n + 3,) and (n + 3, n + 3); the filter changes them.
        walk : variance that each parameter gains in a step, in units of the box squared.
        """


@dataclass(frozen=True)
class Matrices:
    """F, G, C, D over the box, and the noise that goes with them; n states, m readings.

    Attributes
    ----------
    table : packed matrices at the Chebyshev points, shape (64, n (n + 16) + m (n + 8)).
    Q, R : shapes (n, n), (m, m).
    """

    table: np.ndarray
    Q: np.ndarray
    R: np.ndarray

    def at(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """[F G] and [C D] at points (p, 3) of the unit cube, shapes (p, n, n + 16) and (p, m, n + 8)."""
        n, m, nodes = len(self.Q), len(self.R), chebyshev(POINTS)
        first, second, third = (lagrange(nodes, 2.0 * point[:, i] - 1.0) for i in range(3))
        packed = np.einsum("pi,pj,pk->pijk", first, second, third).reshape(len(point), -1) @ self.table
        wide, last = n + 2 * len(INPUTS), n + len(INPUTS)
        return packed[:, : n * wide].reshape(-1, n, wide), packed[:, n * wide :].reshape(-1, m, last)

    def slopes(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Change of [F G] and [C D] with each parameter, shapes (3, n, n + 16) and (3, m, n + 8)."""
        steps = 1e-3 * np.eye(3)
        moved, seen = self.at(np.concatenate([point + steps, point - steps]))
        return (moved[:3] - moved[3:]) / 2e-3, (seen[:3] - seen[3:]) / 2e-3


def matrices(problem: Problem, situation: Situation, every: int) -> Matrices:
    """Tables for steps of `every` samples."""
    vehicle, speed, unknowns, plan = problem.system(situation, every)
    nodes = chebyshev(POINTS)
    grid = np.stack(np.meshgrid(nodes, nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 3)
    size = problem.high - problem.low
    rate = problem.record.rate / every
    systems = [discrete(vehicle, problem.low + size * (one + 1) / 2, speed, rate, unknowns, plan) for one in grid]
    packed = [np.concatenate([np.hstack([s.F, s.G]).ravel(), np.hstack([s.C, s.D]).ravel()]) for s in systems]
    middle = systems[len(systems) // 2]
    return Matrices(np.array(packed), middle.Q, middle.R)


class Joint(Protocol):
    """A filter of state and parameters with mean `x` and covariance `P`."""

    x: np.ndarray
    P: np.ndarray

    def move(self, now: Matrices, known: np.ndarray, inputs: np.ndarray, readings: np.ndarray) -> None:
        """A step, with the known track before and after it, and the known track and the readings at its end."""
        ...


def run(estimator: JointEstimator, problem: Problem, walk: float) -> Estimate:
    """Run the estimator's filter over the record; `walk` : as in `begin`."""
    record, every = problem.record, estimator.every
    size, rows = problem.high - problem.low, []
    tables: dict[Situation, Matrices] = {}
    current: Joint | None = None
    point, spread = np.array(estimator.first), np.eye(3) * estimator.first_std**2
    for first, last in problem.stretches:
        situation = problem.situation(first, last)
        if situation is None:
            if current is not None:
                point, spread = _parameters(current)
            current = None
        else:
            if situation not in tables:
                tables[situation] = matrices(problem, situation, every)
            now = tables[situation]
            n = len(now.Q)
            if current is None or len(current.x) != n + 3:
                point, spread = (point, spread) if current is None else _parameters(current)
                P = np.zeros((n + 3, n + 3))
                P[:n, :n], P[n:, n:] = START_STATE**2 * np.eye(n), spread
                current = estimator.begin(now, np.concatenate([np.zeros(n), point]), P, walk)
            inputs, _, readings = problem.samples(first, last, situation[1])
            for k in range(0, last - first - every + 1, every):
                before, after = record.inputs[max(first + k - 1, 0)], inputs[k + every - 1]
                current.move(now, np.concatenate([before, after]), after, readings[k + every - 1])
                current.x[n:] = np.clip(current.x[n:], 0.001, 0.999)
            point, spread = _parameters(current)
        std = np.sqrt(np.maximum(np.diag(spread), 0.0)) * size
        values = [value for pair in zip(problem.low + point * size, std, strict=True) for value in pair]
        rows.append([float(record.time[last - 1]), *values, 1.0, 0.0, float(situation is not None)])
    names = [name for pair in ((one, std_name(one)) for one in PARAMETERS) for name in pair]
    series = pd.DataFrame(rows, columns=pd.Index(["time [s]", *names, *COLUMNS]))
    return checked(estimator, problem, series, series, [])


def _parameters(current: Joint) -> tuple[np.ndarray, np.ndarray]:
    return current.x[-3:].copy(), current.P[-3:, -3:].copy()
