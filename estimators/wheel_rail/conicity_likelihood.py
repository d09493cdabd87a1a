"""Most likely function of conicity with everything else integrated out, its information matrix, and the smoother.

The likelihood is that of the innovations of `wheel_rail.conicity_kernel` (prediction error decomposition), which
integrates over the paths of wheelset and rails; that is the difference to the joint mode of paths and function, which
is biased, since every conicity explains the sensors exactly with some rail. Fisher scoring finds the maximum of the
posterior, and the information there gives the covariance (Laplace's approximation).
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from estimators.wheel_rail.conicity_kernel import LINE, RAIL, STATES, Numbers, WheelsetRecord, Y, run

SPACING = 5e-5  # m, of the table that the kernel reads
FARTHEST = 0.012  # m
START = (3e-3, 0.05, 5e-3, 2e-3, 0.05, 0.02, 0.1, 3e-3, 3e-3, 2e-3, 0.03, 0.0)  # std of the states (illustrative)
DELTAS = (1e-3, 1e-2)  # steps of the differences: conicity (-), logarithms
SCALES = (0.3, 0.45, 0.65, 0.8, 1.0, 1.25, 1.5, 2.0)  # of the nominal conicity: cones among which starts are chosen
LONGEST_STEP = 0.3  # of any parameter
ENOUGH, ROUGHLY = 0.05, 20.0  # gain in log posterior below which the search ends, and that from one of several starts
ATTEMPTS = 10  # with growing damping
DAMPED = 0.1  # share of the precision's diagonal
LOGS = ("f11", "rail", "slip", "line")


@dataclass(frozen=True)
class ConicityPrior:
    """Of the coefficients: mean conicity, spread of each and of second differences; of the logarithms of `LOGS`."""

    conicity: float
    spread: float
    roughness: float
    logs: np.ndarray
    log_spread: np.ndarray


@dataclass(frozen=True)
class Posterior:
    """Parameters (conicity's coefficients, then `LOGS` as logarithms), information of the data and of both."""

    parameters: np.ndarray
    information: np.ndarray
    precision: np.ndarray
    objective: float

    @property
    def covariance(self) -> np.ndarray:
        """Of the parameters."""
        return np.linalg.inv(self.precision)


class Likelihood:
    """Of a record, for conicity as cubic B-splines of |y - d| with `pieces` between 0 and `reach` (m)."""

    def __init__(
        self, record: WheelsetRecord, numbers: Numbers, prior: ConicityPrior, reach: float, pieces: int
    ) -> None:
        self.record, self.numbers, self.prior = record, numbers, prior
        width = reach / pieces
        knots = width * np.arange(-3, pieces + 4)
        self.shift = np.arange(0.0, FARTHEST, SPACING)
        inside = np.clip(self.shift, 0.0, reach * (1.0 - 1e-9))
        self.basis = BSpline.design_matrix(inside, knots, 3).toarray()
        self.count = pieces + 3
        self.mean = np.concatenate([np.full(self.count, prior.conicity), prior.logs])
        curvature = np.diff(np.eye(self.count), 2, axis=0) / prior.roughness
        self.prior_precision = np.zeros((len(self.mean), len(self.mean)))
        own = curvature.T @ curvature + np.eye(self.count) / prior.spread**2
        self.prior_precision[: self.count, : self.count] = own
        logs = np.arange(self.count, len(self.mean))
        self.prior_precision[logs, logs] = prior.log_spread**-2

    def innovations(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Errors and their variances (n, 2)."""
        return self._run(parameters, False)[:2]

    def objective(self, parameters: np.ndarray) -> float:
        """Minus the logarithm of the posterior, up to a constant."""
        error, variance = self.innovations(parameters)
        apart = parameters - self.mean
        value = 0.5 * float(np.sum(error**2 / variance + np.log(variance)) + apart @ self.prior_precision @ apart)
        return value if np.isfinite(value) else np.inf

    def fit(self, starts: int = 3, finely: bool = True) -> Posterior:
        """Best of the maxima of the posterior that are found from the cones which explain the record best.

        The contact of worn wheels bends so sharply that the posterior has several maxima; the search from one start
        ended at a wrong one in a third of the runs with a hollow of 0.2 mm and more. `finely`: to the top.
        """
        cones = []
        for scale in SCALES:
            start = self.mean.copy()
            start[: self.count] *= scale
            cones.append((self.objective(start), scale, start))
        cones.sort(key=lambda cone: cone[:2])
        found = [self._climb(start, ROUGHLY) for _, _, start in cones[:starts]]
        best = min(found, key=lambda one: one.objective)
        return self._climb(best.parameters, ENOUGH) if finely else best

    def _climb(self, start: np.ndarray, enough: float, iterations: int = 40) -> Posterior:
        """Maximum of the posterior by Fisher scoring with a step that shrinks where it does not gain."""
        parameters, damping = start, 0.0
        best = self.objective(parameters)
        gradient, information = self._derivatives(parameters)
        for _ in range(iterations):
            precision = information + self.prior_precision
            step = self._better(parameters, best, gradient, precision, damping)
            if step is None:
                break
            moved, value, stiff = step
            gained = best - value
            parameters, best, damping = moved, value, stiff / 4.0 if stiff > DAMPED else 0.0
            gradient, information = self._derivatives(parameters)
            if gained < enough:
                break
        return Posterior(parameters, information, information + self.prior_precision, best)

    def _better(
        self, parameters: np.ndarray, best: float, gradient: np.ndarray, precision: np.ndarray, damping: float
    ) -> tuple[np.ndarray, float, float] | None:
        """A step that gains: parameters, objective and the damping that it took; None where none does."""
        for _ in range(ATTEMPTS):
            change = -np.linalg.solve(precision + damping * np.diag(np.diag(precision)), gradient)
            moved = parameters + change * min(1.0, LONGEST_STEP / max(float(np.abs(change).max()), 1e-300))
            value = self.objective(moved)
            if value < best:
                return moved, value, damping
            damping = max(4.0 * damping, 3.0 * DAMPED)
        return None

    def conicity(self, posterior: Posterior) -> tuple[np.ndarray, np.ndarray]:
        """At `self.shift`: value and standard deviation by the posterior."""
        own = posterior.covariance[: self.count, : self.count]
        spread = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", self.basis, own, self.basis), 0.0))
        return self.basis @ posterior.parameters[: self.count], spread

    def smooth(self, posterior: Posterior) -> tuple[np.ndarray, np.ndarray]:
        """Smoothed states (n, states) and standard deviations of rail, y - d and line (n, 3): Rauch, Tung, Striebel."""
        _, _, means, covariances, transitions = self._run(posterior.parameters, True)
        count = len(means)
        state, P = means[-1, 1].copy(), covariances[-1, 1].copy()
        states, spread = np.empty((count, STATES)), np.empty((count, 3))
        for k in range(count - 1, -1, -1):
            if k < count - 1:
                ahead = covariances[k + 1, 0]
                scale = 1.0 / np.sqrt(np.diag(ahead))
                cross = transitions[k + 1] @ covariances[k, 1]
                gain = np.linalg.solve(ahead * np.outer(scale, scale), cross * scale[:, None]).T * scale
                state = means[k, 1] + gain @ (state - means[k + 1, 0])
                P = covariances[k, 1] + gain @ (P - ahead) @ gain.T
            states[k] = state
            spread[k] = P[RAIL, RAIL], P[Y, Y] - 2.0 * P[Y, RAIL] + P[RAIL, RAIL], P[LINE, LINE]
        return states, np.sqrt(np.maximum(spread, 0.0))

    def _run(self, parameters: np.ndarray, keep: bool):
        logs = np.exp(parameters[self.count :])
        numbers = self.numbers._replace(**dict(zip(LOGS, (float(one) for one in logs), strict=True)))
        start = np.diag(np.array(START) ** 2)
        start[LINE, LINE] = numbers.line**2
        table = self.basis @ parameters[: self.count]
        return run(self.record, table, SPACING, numbers, np.zeros(STATES), start, keep)

    def sensitivities(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Change of whitened innovations and of their variances' logarithms by each parameter, (parameters, 2 n)."""
        error, variance = self.innovations(parameters)
        root = np.sqrt(variance)
        errors, variances = [], []
        for number in range(len(parameters)):
            moved = parameters.copy()
            delta = DELTAS[0] if number < self.count else DELTAS[1]
            moved[number] += delta
            other, spread = self.innovations(moved)
            errors.append(((other - error) / (delta * root)).ravel())
            variances.append(((spread - variance) / (delta * variance)).ravel())
        return np.array(errors), np.array(variances)

    def _derivatives(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gradient of the objective and Fisher information of the data, by one-sided differences."""
        error, variance = self.innovations(parameters)
        by_error, by_variance = self.sensitivities(parameters)
        whitened = (error / np.sqrt(variance)).ravel()
        gradient = by_error @ whitened - 0.5 * by_variance @ (whitened**2 - 1.0)
        gradient = gradient + self.prior_precision @ (parameters - self.mean)
        return gradient, by_error @ by_error.T + 0.5 * by_variance @ by_variance.T
