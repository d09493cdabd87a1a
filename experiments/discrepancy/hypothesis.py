"""Hypothesis: one effect with free numbers beside all nuisances, fitted in the compiled engine; and its evidence."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from experiments.discrepancy.candidates import Candidate
from experiments.discrepancy.fitting import (
    SHORTENED,
    TOLERATED,
    WEIGHT,
    Fit,
    Problem,
    bounded_step,
    cost,
    normal_equations,
    nuisance_jacobian,
)
from experiments.discrepancy.parallel import in_parallel
from railsim.effects.interface import Effect, Parameter
from railsim.errors import InputError

ROUNDS = 6
WORTH = 3.0  # nats that a further linearisation must have brought to go on
DROPPED = 3
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Hypothesis:
    """A fitted candidate.

    Attributes
    ----------
    shares : place of each free number between its bounds, (m,). covariance : (m, m) of the shares, nuisances
    marginalised. log_evidence : Laplace, training frames. gains : (k,) by frame, against nuisances alone.
    """

    candidate: Candidate
    shares: np.ndarray
    effect: Effect
    fit: Fit
    covariance: np.ndarray
    log_evidence: float
    gains: np.ndarray

    @property
    def values(self) -> dict[str, float]:
        """Free numbers."""
        return _values(self.candidate, self.shares)


def null_evidence(problem: Problem, fit: Fit) -> float:
    """Logarithm of the evidence of nuisances alone (with the effects that the fit already has)."""
    normal, _ = normal_equations(fit.jacobian, fit.residual, problem.train)
    return -cost(fit.residual, fit.z, problem.train) - 0.5 * _log_determinant(normal + np.eye(len(normal)))


def fit_candidate(
    problem: Problem,
    null: Fit,
    candidate: Candidate,
    starts: Sequence[tuple[np.ndarray, dict[str, float]]],
    tell: Callable[[str], None],
) -> Hypothesis | None:
    """Fit from the best of some starts (nuisances and numbers of the effect); None where the model runs at none.

    Nuisances keep the linearisation of `null`; the effect's own columns are made again in every round.
    """
    begun = []
    for z, values in starts:
        shares = np.array([(values[name] - p.low) / (p.high - p.low) for name, p in candidate.parameters.items()])
        try:
            begun.append((z, shares, _evaluate(problem, null, candidate, z, shares)))
        except InputError as error:
            tell(f"{candidate.label}: {error}")
    if not begun:
        return None
    z, shares, state = min(begun, key=lambda one: one[2][0])
    columns = _columns(problem, null, candidate, z, shares, state[2])
    for number in range(ROUNDS):
        if number:
            columns = _columns(problem, null, candidate, z, shares, state[2])
        moved = _improve(problem, null, candidate, z, shares, state, columns)
        if moved is None:
            break
        gain = state[0] - moved[2][0]
        z, shares, state = moved
        if gain < 0.3:
            break
    return _conclude(problem, null, candidate, z, shares, state, columns)


def polish(problem: Problem, null: Fit, found: Hypothesis, tell: Callable[[str], None]) -> Hypothesis:
    """The same with the nuisances linearised at the hypothesis itself, twice."""
    for _ in range(2):
        effects = (*null.effects, found.effect)
        columns, _ = nuisance_jacobian(problem, found.fit.z, effects, found.fit.columns)
        values = _values(found.candidate, found.shares)
        again = replace(null, columns=columns, jacobian=problem.whitened_columns(columns))
        better = fit_candidate(problem, again, found.candidate, [(found.fit.z, values)], tell)
        if better is None or better.log_evidence < found.log_evidence + WORTH:
            return found if better is None or better.log_evidence < found.log_evidence else better
        found = better
    return found


State = tuple[float, np.ndarray, np.ndarray, dict[str, np.ndarray], Effect]


def _evaluate(problem: Problem, null: Fit, candidate: Candidate, z: np.ndarray, shares: np.ndarray) -> State:
    """Cost, residual, coefficients, prediction and effect at a point."""
    effect = candidate.build(_values(candidate, shares))
    prediction = problem.forward.predict(z, (*null.effects, effect))
    stacked = problem.stacked(prediction)
    residual = problem.whitened(problem.measured - stacked)
    total = cost(residual, z, problem.train) - _log_prior(candidate, shares)
    return (total if np.isfinite(total) else math.inf), residual, stacked, prediction, effect


def _columns(
    problem: Problem, null: Fit, candidate: Candidate, z: np.ndarray, shares: np.ndarray, stacked: np.ndarray
) -> np.ndarray:
    """(m, k, f, 2 c) derivative of the whitened prediction by the shares."""
    free = candidate.parameters

    def column(number: int) -> np.ndarray:
        name = list(free)[number]
        size = candidate.step(name, free[name])
        step = -size if shares[number] > 0.5 else size
        moved = shares.copy()
        moved[number] += step
        prediction = problem.forward.predict(z, (*null.effects, candidate.build(_values(candidate, moved))))
        return problem.whitened((problem.stacked(prediction) - stacked) / step)

    return np.stack(in_parallel(column, range(len(shares))))


def _improve(
    problem: Problem,
    null: Fit,
    candidate: Candidate,
    z: np.ndarray,
    shares: np.ndarray,
    state: State,
    columns: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, State] | None:
    """One joint step, shortened until it helps; None where it does not."""
    jacobian = np.concatenate([null.jacobian, columns.astype(np.float32)])
    normal, gradient = normal_equations(jacobian, state[1], problem.train)
    slope, curvature = _prior_derivatives(candidate, shares)
    n = len(z)
    prior = np.diag(np.concatenate([np.ones(n), curvature + 1e-3]))
    downhill = gradient - np.concatenate([z, slope])
    edge = TOLERATED * (2.0 * shares - 1.0)  # so that shares keep to 0 ... 1 as nuisances to their tolerance
    rescale = np.concatenate([np.ones(n), np.full(len(shares), 0.5 / TOLERATED)])
    matrix, downhill = (normal + prior) * np.outer(rescale, rescale), downhill * rescale
    for share in SHORTENED:
        moved = bounded_step(matrix, downhill, np.concatenate([z, edge]), share)
        at, there = moved[:n], np.clip(0.5 * (moved[n:] / TOLERATED + 1.0), 0.0, 1.0)
        try:
            found = _evaluate(problem, null, candidate, at, there)
        except InputError:
            continue
        if found[0] < state[0] - 1e-3:
            return at, there, found
    return None


def _conclude(
    problem: Problem,
    null: Fit,
    candidate: Candidate,
    z: np.ndarray,
    shares: np.ndarray,
    state: State,
    columns: np.ndarray,
) -> Hypothesis:
    jacobian = np.concatenate([null.jacobian, columns.astype(np.float32)])
    normal, _ = normal_equations(jacobian, state[1], problem.train)
    _, curvature = _prior_derivatives(candidate, shares)
    n, m = len(z), len(shares)
    whole = normal + np.diag(np.concatenate([np.ones(n), curvature + 1e-9]))
    covariance = np.linalg.inv(whole)[n:, n:]
    width = 0.5 * m * math.log(2.0 * math.pi) + 0.5 * float(np.linalg.slogdet(covariance)[1])
    at_bound = sum(math.log(2.0) for share in shares if not 1e-6 < share < 1.0 - 1e-6)
    own = min(width, 0.0) - at_bound  # a prior that is one in all over the range of shares
    log_evidence = -state[0] - 0.5 * _log_determinant(normal[:n, :n] + np.eye(n)) + own
    before = 0.5 * ((WEIGHT * null.residual) ** 2).sum(axis=(1, 2))
    after = 0.5 * ((WEIGHT * state[1]) ** 2).sum(axis=(1, 2))
    fit = Fit(z, (*null.effects, state[4]), state[1], null.columns, null.jacobian, state[3])
    return Hypothesis(candidate, shares, state[4], fit, covariance, log_evidence, before - after)


def robust_evidence(problem: Problem, hypothesis: Hypothesis, null: Fit, log_evidence: float) -> float:
    """Evidence against nuisances alone [nats] without the sections that speak loudest for the effect."""
    gains = 0.5 * ((WEIGHT * null.residual) ** 2 - (WEIGHT * hypothesis.fit.residual) ** 2).sum(axis=(1, 2))
    loudest = np.sort(gains[problem.train])[::-1][:DROPPED]
    return hypothesis.log_evidence - log_evidence - float(np.clip(loudest, 0.0, None).sum())


def intervals(problem: Problem, hypothesis: Hypothesis) -> dict[str, dict[str, float | str]]:
    """Value and two standard deviations to each side, widened where the residual is not white."""
    misfit = float(np.mean(hypothesis.fit.residual[problem.train] ** 2))
    spread = np.sqrt(np.diag(hypothesis.covariance) * max(1.0, misfit))
    found = {}
    for number, (name, p) in enumerate(hypothesis.candidate.parameters.items()):
        span = p.high - p.low
        value = p.low + span * float(hypothesis.shares[number])
        reach = 2.0 * span * float(spread[number])
        low, high = max(p.low, value - reach), min(p.high, value + reach)
        found[name] = {"value": value, "low": low, "high": high, "unit": p.unit}
    return found


def _values(candidate: Candidate, shares: Sequence[float] | np.ndarray) -> dict[str, float]:
    pairs = zip(candidate.parameters.items(), shares, strict=True)
    return {name: float(np.clip(p.low + (p.high - p.low) * s, p.low, p.high)) for (name, p), s in pairs}


def _scaled(parameter: Parameter) -> tuple[float, float]:
    span = parameter.high - parameter.low
    return (parameter.prior.mean - parameter.low) / span, parameter.prior.std / span


def _log_prior(candidate: Candidate, shares: np.ndarray) -> float:
    """Of the shares; each prior is one in all over its range."""
    total = 0.0
    for share, parameter in zip(shares, candidate.parameters.values(), strict=True):
        mean, std = _scaled(parameter)
        if math.isfinite(std):
            mass = float(norm.cdf((1.0 - mean) / std) - norm.cdf(-mean / std))
            total += float(norm.logpdf(share, mean, std)) - math.log(max(mass, 1e-12))
    return total


def _prior_derivatives(candidate: Candidate, shares: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slope and curvature of the negative logarithm of the prior."""
    scaled = [_scaled(parameter) for parameter in candidate.parameters.values()]
    slope = [(s - mean) / std**2 if math.isfinite(std) else 0.0 for s, (mean, std) in zip(shares, scaled, strict=True)]
    curvature = [1.0 / std**2 if math.isfinite(std) else 0.0 for _, std in scaled]
    return np.array(slope), np.array(curvature)


def _log_determinant(matrix: np.ndarray) -> float:
    return float(np.linalg.slogdet(matrix)[1])
