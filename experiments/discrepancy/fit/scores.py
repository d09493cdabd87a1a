"""Scores: numbers of effects as shares between their bounds, beside nuisances as scores, and steps within tolerance."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear
from scipy.stats import norm

from experiments.discrepancy.baseline.nuisances import TOLERATED
from experiments.discrepancy.fit.candidates import VARIED, Candidate
from railsim.effects.interface import Effect, Parameter

DECADES = 100.0  # upper over lower bound


@dataclass(frozen=True)
class Shares:
    """Free numbers of some candidates in one vector: 0 = lower bound, 1 = upper."""

    candidates: tuple[Candidate, ...]

    @cached_property
    def parameters(self) -> list[tuple[str, Parameter]]:
        """Name and bounds of every number, candidate after candidate."""
        return [pair for one in self.candidates for pair in one.parameters.items()]

    def steps(self, shares: np.ndarray) -> list[float]:
        """Shares by which each is varied for a derivative there."""
        owners = [(one, p) for one in self.candidates for p in one.parameters.values()]
        found = []
        for (one, p), share in zip(owners, shares, strict=True):
            value = value_at(p, float(share))
            step = one.step(p, value)
            usual = step >= VARIED * (p.high - p.low) * (1.0 - 1e-9)
            log = logarithmic(p)
            relative = step / value / math.log(p.high / p.low) if log else step / (p.high - p.low)
            found.append(VARIED if usual else relative)
        return found

    def of(self, values: Sequence[dict[str, float]]) -> np.ndarray:
        """(m,) from the values of each candidate."""
        return np.array(
            [
                share_of(p, given[name])
                for one, given in zip(self.candidates, values, strict=True)
                for name, p in one.parameters.items()
            ]
        )

    def values(self, shares: np.ndarray) -> list[dict[str, float]]:
        """Values of each candidate's numbers."""
        found, place = [], 0
        for one in self.candidates:
            here: dict[str, float] = {}
            for name, p in one.parameters.items():
                here[name] = value_at(p, float(shares[place]))
                place += 1
            found.append(here)
        return found

    def effects(self, shares: np.ndarray) -> tuple[Effect, ...]:
        """The effects at these shares."""
        pairs = zip(self.candidates, self.values(shares), strict=True)
        return tuple(one.build(values) for one, values in pairs)

    def log_prior(self, shares: np.ndarray) -> float:
        """Of the shares; each prior is one in all over its range."""
        total = 0.0
        for share, (_, parameter) in zip(shares, self.parameters, strict=True):
            mean, std = _scaled(parameter)
            if math.isfinite(std):
                mass = float(norm.cdf((1.0 - mean) / std) - norm.cdf(-mean / std))
                total += float(norm.logpdf(share, mean, std)) - math.log(max(mass, 1e-12))
        return total

    def curvature(self) -> np.ndarray:
        """(m,) of the negative logarithm of the prior."""
        return np.array([1.0 / std**2 if math.isfinite(std) else 0.0 for std in self._stds()])

    def width(self) -> np.ndarray:
        """(m,) one over the prior's variance: what the data do not say is no narrower than that."""
        return np.array([1.0 / std**2 if math.isfinite(std) else 12.0 for std in self._stds()])

    def scaled(
        self, normal: np.ndarray, gradient: np.ndarray, z: np.ndarray, shares: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Matrix, right-hand side and point of a Newton step, priors in; shares as scores whose bounds are +-3."""
        slope = [
            (s - _scaled(p)[0]) / std**2 if math.isfinite(std) else 0.0
            for s, std, (name, p) in zip(shares, self._stds(), self.parameters, strict=True)
        ]
        prior = np.concatenate([np.ones(len(z)), self.curvature() + 1e-3])
        downhill = gradient - np.concatenate([z, slope])
        rescale = np.concatenate([np.ones(len(z)), np.full(len(shares), 0.5 / TOLERATED)])
        matrix = (normal + np.diag(prior)) * np.outer(rescale, rescale)
        return matrix, downhill * rescale, np.concatenate([z, TOLERATED * (2.0 * shares - 1.0)])

    def unscaled(self, edges: np.ndarray) -> np.ndarray:
        """Shares of what `scaled` made of them."""
        return np.clip(0.5 * (edges / TOLERATED + 1.0), 0.0, 1.0)

    def _stds(self) -> list[float]:
        return [_scaled(parameter)[1] for name, parameter in self.parameters]


def logarithmic(parameter: Parameter) -> bool:
    """Whether a number ranges over so many decades that its logarithm is what varies evenly (and what is uniform before
    anything is measured); never a place or a time.
    """
    where = parameter.role in ("distance", "time")
    return not where and parameter.low > 0.0 and parameter.high > DECADES * parameter.low


def share_of(p: Parameter, value: float) -> float:
    """Where a value lies between the bounds."""
    if logarithmic(p):
        return math.log(value / p.low) / math.log(p.high / p.low)
    return (value - p.low) / (p.high - p.low)


def value_at(p: Parameter, share: float) -> float:
    """The value at a share, within the bounds."""
    value = p.low * (p.high / p.low) ** share if logarithmic(p) else p.low + (p.high - p.low) * share
    return float(np.clip(value, p.low, p.high))


def _scaled(parameter: Parameter) -> tuple[float, float]:
    if logarithmic(parameter):
        return 0.5, math.inf
    span = parameter.high - parameter.low
    return (parameter.prior.mean - parameter.low) / span, parameter.prior.std / span


def bounded_step(
    matrix: np.ndarray, slope: np.ndarray, z: np.ndarray, share: float, bounds: np.ndarray | None = None
) -> np.ndarray:
    """z after a share of the step to the minimum of the quadratic model within all bounds (Stark and Parker 1995); cut
    off at a bound afterwards, a Newton step may lead uphill.

    Parameters
    ----------
    bounds : (2, n) least and most of the first scores; the others stay within `TOLERATED`.
    """
    lower, upper = _limits(z, bounds)
    at = np.clip(z, lower, upper)
    factor = np.linalg.cholesky(matrix)
    aim = solve_triangular(factor, slope, lower=True)
    move = lsq_linear(factor.T, aim, (lower - at, upper - at), method="bvls").x
    return np.clip(at + share * move, lower, upper)


def at_bound(z: np.ndarray, bounds: np.ndarray | None = None) -> np.ndarray:
    """Which scores stand at the edge of their tolerance: 1 at the upper, -1 at the lower, 0 between."""
    lower, upper = _limits(z, bounds)
    return (z >= upper - 1e-9).astype(int) - (z <= lower + 1e-9)


def _limits(z: np.ndarray, bounds: np.ndarray | None) -> np.ndarray:
    """(2, len(z)) least and most."""
    limits = np.array([[-TOLERATED], [TOLERATED]]) * np.ones(len(z))
    if bounds is not None:
        limits[:, : bounds.shape[1]] = bounds
    return limits
