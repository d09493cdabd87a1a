"""Most likely wheel with rails and varying gauge integrated out by particles, and how sure it is.

Fisher scoring climbs with the same random numbers all the way, under a noise of D that falls in stages: with little of
it no particle finds a path for a wheel that is far off. What the record says least of is the gauge's mean: a wheel
F(u - c) on a gauge wider by 2 c is the same, and only that g has mean zero tells them apart. The climb hardly moves
along c; so the likelihood is profiled over c, the rest climbing at each, and a parabola is laid through it. What the
rest is known to comes from scores of independent random numbers (`independent`).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from estimators.wheel_rail.gauge_kernel import EVERY, particles
from estimators.wheel_rail.rail_process import Process
from estimators.wheel_rail.wheel_basis import SPACING, Basis
from railsim.analysis.statistics import root_mean_square

# Settings of the search, not physics: chosen on runs of seeds 7600 to 7605 and from 7700 on.
STAGES = ((0.5, 6), (0.2, 8), (0.08, 16))
"""Noise of D as a share of its rms, the last one being what smoothed sensors leave, and iterations."""
CONES = (0.5, 0.7, 0.85, 1.0, 1.2, 1.5)
"""Of the new wheels' conicity, among which the search starts."""
MERGED = 3  # blocks of the gradient taken as one, 18 m: longer than what hangs together
LARGEST, SLACK, ENOUGH = 0.15, 10.0, 0.01  # step of a parameter; loss of log posterior by chance; smallest step
STIFF = 100.0
ROWS = 400  # of random numbers
SHIFTS = 2e-4 * np.arange(-4, 5)  # m, of the profile
RELAXED, REPEATS = 3, 2  # iterations at each, and likelihoods averaged
POLISHING, INDEPENDENT = 12, 3.0  # steps, and how many of the later ones are as good as independent
MANY = 4  # times as many particles for the likelihood's profile and for the paths
WIDTH = 5e-4  # m about the best, in which the parabola is laid


class Rails(NamedTuple):
    """Processes of the rails and the gauge, with the levels expected; spread of the logarithms of these levels."""

    rail: Process
    gauge: Process
    spread: tuple[float, float]


@dataclass(frozen=True)
class Wheel:
    """Found: coefficients and two logarithms of levels, their basis, covariance of the conicity's function."""

    parameters: np.ndarray
    basis: Basis
    covariance: np.ndarray

    @property
    def conicity(self) -> np.ndarray:
        """At `basis.shift`, for nominal gauge."""
        return self.basis.conicity @ self.parameters[:-2]


class GaugeLikelihood:
    """Of D and y (n,), m, at the steps of `rails`."""

    def __init__(
        self, D: np.ndarray, y: np.ndarray, rails: Rails, basis: Basis, conicity: float,
        roughness: float, spread: float, rng: np.random.Generator, count: int,
    ) -> None:  # fmt: skip
        self.D, self.y, self.rails, self.basis = D, y, rails, basis
        self.scale = root_mean_square(D)
        self.mean = np.append(conicity * basis.cone, np.log([rails.rail.level, rails.gauge.level]))
        self.precision = np.zeros((len(self.mean), len(self.mean)))
        curvature = basis.curvature / roughness
        self.precision[:-2, :-2] = curvature.T @ curvature + np.eye(len(basis.cone)) / spread**2
        self.precision[[-2, -1], [-2, -1]] = np.array(rails.spread) ** -2.0
        self.normals, self.uniforms = rng.standard_normal((ROWS, count, 3)), rng.random(len(D))
        self.more = rng.standard_normal((ROWS, MANY * count, 3))

    def objective(
        self, parameters: np.ndarray, basis: Basis, share: float, replica: int = 0, blocks: bool = True
    ) -> tuple[float, np.ndarray, np.ndarray]:
        """Minus log posterior, gradient of the log likelihood by blocks (blocks, parameters), moments of x and g.

        replica : other random numbers. blocks : whether gradient and moments are wanted; else there are more particles.
        """
        table = basis.radius @ parameters[:-2]
        levels = np.exp(parameters[-2:])
        rail, gauge = (one._replace(level=float(level)) for one, level in zip(self.rails[:2], levels, strict=True))
        score = np.zeros((len(self.D) // EVERY + 1 if blocks else 0, len(table) + 2))
        smoothed = np.full((len(self.D) if blocks else 0, 4), 0.0)
        normals = self.normals if blocks else self.more
        normals = np.roll(normals, replica * ROWS // 17, axis=0)
        log_likelihood = particles(
            self.D, self.y, table, SPACING, rail, gauge, share * self.scale, normals,
            np.roll(self.uniforms, 13 * replica), score, smoothed,
        )  # fmt: skip
        apart = parameters - self.mean
        value = -log_likelihood + 0.5 * float(apart @ self.precision @ apart)
        score = np.hstack([score[:, :-2] @ basis.radius, score[:, -2:]])
        return value if np.isfinite(value) else np.inf, score, smoothed

    def climb(self, parameters: np.ndarray, basis: Basis, share: float, most: int) -> np.ndarray:
        """Parameters, by steps that the blocks' scores scale (Berndt, Hall, Hall and Hausman 1974)."""
        value, score, _ = self.objective(parameters, basis, share)
        damping = 0.0
        for _ in range(most):
            gradient = -score.sum(axis=0) + self.precision @ (parameters - self.mean)
            precision = self._information(score) + self.precision
            change = -np.linalg.solve(precision + damping * np.diag(np.diag(precision)), gradient)
            size = float(np.abs(change).max())
            moved = parameters + change * min(1.0, LARGEST / max(size, 1e-300))
            other = self.objective(moved, basis, share)
            if other[0] < value + SLACK:
                parameters, (value, score, _) = moved, other
                damping = damping / 4.0 if damping > 0.02 else 0.0
            else:
                damping = max(4.0 * damping, 0.1)
            if size < ENOUGH or damping > STIFF:
                break
        return parameters

    def polish(self, parameters: np.ndarray, basis: Basis, share: float) -> tuple[np.ndarray, np.ndarray]:
        """Mean of the parameters that steps with ever other random numbers reach (Polyak), and covariance.

        The information is the mean product of scores by different random numbers: their noise is independent and falls
        out, where the outer product of each with itself, and still that of the mean, would take it for information.
        """
        iterates, scores = [], []
        for replica in range(1, POLISHING + 1):
            _, score, _ = self.objective(parameters, basis, share, replica)
            gradient = -score.sum(axis=0) + self.precision @ (parameters - self.mean)
            change = -np.linalg.solve(self._information(score) + self.precision, gradient)
            parameters = parameters + change * min(1.0, LARGEST / max(float(np.abs(change).max()), 1e-300))
            scores.append(score)
            iterates.append(parameters)
        information = independent(np.array([self._merged(score) for score in scores]), self.precision)
        late = np.array(iterates[POLISHING // 3 :])
        scatter = np.cov(late.T) / INDEPENDENT
        return late.mean(axis=0), np.linalg.inv(information + self.precision) + scatter

    def _information(self, score: np.ndarray) -> np.ndarray:
        """Outer product of the scores of parts that hang together within themselves only."""
        merged = self._merged(score)
        return merged.T @ merged

    def _merged(self, score: np.ndarray) -> np.ndarray:
        """Scores of these parts, less their mean."""
        whole = len(score) // MERGED * MERGED
        merged = score[:whole].reshape(-1, MERGED, score.shape[1]).sum(axis=1)
        return merged - merged.mean(axis=0)

    def fit(self) -> tuple[Wheel, np.ndarray]:
        """The wheel, and means and standard deviations of x and g (n, 4), m, NaN where no path was traced."""
        parameters = self._start()
        for share, most in STAGES:
            parameters = self.climb(parameters, self.basis, share, most)
        share = STAGES[-1][0]
        costs, functions = np.empty(len(SHIFTS)), []
        for number, shift in enumerate(SHIFTS):
            basis = self.basis.moved(float(shift))
            relaxed = self.climb(parameters, basis, share, RELAXED)
            values = [self.objective(relaxed, basis, share, turn, False)[0] for turn in range(REPEATS)]
            costs[number] = np.mean(values)
            functions.append(basis.conicity @ relaxed[:-2])
        best, deviation = parabola(SHIFTS, costs)
        basis = self.basis.moved(best)
        parameters, covariance = self.polish(parameters, basis, share)
        by_shift = np.gradient(np.array(functions), SHIFTS, axis=0)[int(np.argmin(np.abs(SHIFTS - best)))]
        own = basis.conicity @ covariance[:-2, :-2] @ basis.conicity.T
        wheel = Wheel(parameters, basis, own + deviation**2 * np.outer(by_shift, by_shift))
        return wheel, self._paths(parameters, basis, share)

    def _start(self) -> np.ndarray:
        """The cone among several that explains the record best under the first stage's noise."""
        cones = np.tile(self.mean, (len(CONES), 1))
        cones[:, :-2] *= np.array(CONES)[:, None]
        return min(cones, key=lambda cone: self.objective(cone, self.basis, STAGES[0][0])[0])

    def _paths(self, parameters: np.ndarray, basis: Basis, share: float) -> np.ndarray:
        """With more particles: traced back few of them are left, whose spread would be too small."""
        self.normals = self.more
        moments = self.objective(parameters, basis, share)[2]
        moments[:, 2:] = np.sqrt(np.maximum(moments[:, 2:] - moments[:, :2] ** 2, 0.0))
        traced = np.any(moments != 0.0, axis=1)
        moments[~traced] = np.nan
        return moments


def independent(scores: np.ndarray, prior: np.ndarray) -> np.ndarray:
    """Information (p, p) by scores (sets, parts, p) of independent random numbers: products of different sets only.

    Free of the sets' own noise in the mean. Directions in which it comes out below its own sampling error, a share of
    sqrt(2 / parts) of what mean scores and prior (p, p) say, have that.
    """
    count, parts = scores.shape[:2]
    total = scores.sum(axis=0)
    own = np.einsum("nij,nik->jk", scores, scores)
    root = np.linalg.cholesky(total.T @ total / count**2 + prior)
    inverse = np.linalg.inv(root)
    values, vectors = np.linalg.eigh(inverse @ ((total.T @ total - own) / (count * (count - 1))) @ inverse.T)
    return root @ (vectors * np.maximum(values, np.sqrt(2.0 / parts))) @ vectors.T @ root.T


def parabola(shifts: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """Shift of the minimum of minus a log likelihood and its standard deviation, by a parabola about the least value.

    Where the values have no minimum within the range: the least one's shift and half their range.
    """
    least = shifts[int(np.argmin(values))]
    weights = np.exp(-0.5 * ((shifts - least) / WIDTH) ** 2)
    square, line, _ = np.polyfit(shifts, values, 2, w=weights)
    if square <= 0.0:
        return float(least), float(shifts[-1] - shifts[0]) / 2.0
    best = float(np.clip(-line / (2.0 * square), shifts[0], shifts[-1]))
    return best, float(1.0 / np.sqrt(2.0 * square))
