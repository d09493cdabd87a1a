"""Levels of error: their likelihood given the residuals, and the fit that maximises it with their priors.

For each covariance S(psi) = sum_k exp(2 psi_k) K_k that is met T times, the residuals count by their sum of outer
products alone. Slope: tr(S^-1 dS_k) T - tr(S^-1 dS_k S^-1 R); Fisher information: T tr(S^-1 dS_k S^-1 dS_l), both by
half (Mardia and Marshall 1984, Biometrika 71, eqs. 3 and 4).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from experiments.discrepancy.core.model import Group, Level

LONGEST = 1.2  # of a step of a log level
FEWEST = 1e-9  # nats; a step that gains less ends the search
STEPS = 60
SAME = 1e-9  # of the power of all errors together
PROMISING = 16  # latent levels that are raised in turn
RAISED = 2.5  # of the log of a level: where the search for another optimum begins


@dataclass(frozen=True)
class Sums:
    """Residuals of a group as what counts of them: (F, C, C) sum of outer products over T repetitions."""

    outer: np.ndarray
    components: np.ndarray
    repeats: int

    @classmethod
    def of(cls, group: Group) -> "Sums":
        """From the residuals."""
        columns = np.swapaxes(group.residual, 1, 2)
        return cls(columns @ np.conj(np.swapaxes(columns, 1, 2)), group.components, group.residual.shape[1])

    @cached_property
    def roots(self) -> tuple[np.ndarray, np.ndarray]:
        """Which components are the square of one column, K_k = r_k r_k^H (one source that all channels hear), and
        these columns (F, C, as many).
        """
        diagonal = np.real(np.einsum("kfcc->kfc", self.components))
        trace = diagonal.sum(axis=2)
        flat = self.components.reshape(*trace.shape, -1)
        squares = sum(np.einsum("kfn,kfn->kf", part, part) for part in (np.real(flat), np.imag(flat)))
        second = (trace**2 - squares) / np.where(trace > 0.0, 2.0 * trace, 1.0)  # eigenvalue, where it is small
        single = (second <= SAME * trace.sum(axis=0)).all(axis=1)
        largest = np.argmax(diagonal[single], axis=2)[..., None]
        column = np.take_along_axis(self.components[single], largest[..., None, :], 3)[..., 0]
        size = np.sqrt(np.take_along_axis(diagonal[single], largest, 2))
        return single, np.ascontiguousarray(np.moveaxis(column / np.where(size > 0.0, size, 1.0), 0, 2))

    def covariance(self, psi: np.ndarray) -> np.ndarray:
        """(F, C, C)."""
        return np.tensordot(np.exp(2.0 * psi), self.components, 1)


def sums(groups: Sequence[Group]) -> tuple[Sums, ...]:
    """Of all groups."""
    return tuple(Sums.of(group) for group in groups)


def cost(parts: Sequence[Sums], psi: np.ndarray) -> float:
    """Minus log likelihood without its 2 pi; infinite where a covariance is not one."""
    total = 0.0
    for one in parts:
        try:
            covariance = one.covariance(psi)
            root = np.linalg.cholesky(covariance)
        except np.linalg.LinAlgError:
            return np.inf
        if not np.isfinite(one.outer).all():
            return np.inf
        square = (np.linalg.inv(covariance) * np.swapaxes(one.outer, 1, 2)).sum()
        log_determinant = 2.0 * float(np.log(np.real(np.einsum("fcc->fc", root))).sum())
        total += 0.5 * (one.repeats * log_determinant + float(np.real(square)))
    return total


def slopes(parts: Sequence[Sums], psi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slope of `cost` (levels,) and Fisher information (levels, levels)."""
    count = len(psi)
    slope, fisher = np.zeros(count), np.zeros((count, count))
    twice = 2.0 * np.exp(2.0 * psi)
    for one in parts:
        inverse = np.linalg.inv(one.covariance(psi))
        (single, columns), repeats = one.roots, 0.5 * one.repeats
        seen, whole = inverse @ columns, one.components[~single]
        between = np.conj(np.swapaxes(columns, 1, 2)) @ seen
        turned = inverse[None] @ whole
        flat, other = (part.reshape(len(whole), inverse.size) for part in (turned, np.swapaxes(turned, -1, -2)))
        trace, square = np.zeros(count), np.zeros(count)
        trace[single] = np.real(np.einsum("fkk->k", between))
        square[single] = np.real((np.conj(seen) * (one.outer @ seen)).sum((0, 1)))
        trace[~single] = np.real(np.einsum("kfcc->k", turned))
        square[~single] = np.real(other @ (inverse @ one.outer).ravel())
        mixed = np.real((np.conj(seen) * (whole @ seen)).sum((1, 2)))
        slope += 0.5 * twice * (one.repeats * trace - square)
        part = np.zeros((count, count))
        part[np.ix_(single, single)] = (np.abs(between) ** 2).sum(0)
        part[np.ix_(~single, ~single)] = np.real(flat @ other.T)
        part[np.ix_(~single, single)], part[np.ix_(single, ~single)] = mixed, mixed.T
        fisher += repeats * np.outer(twice, twice) * part
    return slope, fisher


def prior_cost(levels: Sequence[Level], psi: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Sum of the priors' costs, slopes (levels,) and curvatures (levels,)."""
    rows = np.array([one.prior.cost(float(value)) for one, value in zip(levels, psi, strict=True)])
    return float(rows[:, 0].sum()), rows[:, 1], rows[:, 2]


def middles(levels: Sequence[Level]) -> np.ndarray:
    """Where the levels' priors have their middle."""
    return np.array([one.prior.middle for one in levels])


@dataclass(frozen=True)
class Levelled:
    """Levels at their optimum: cost with priors, and its second derivative."""

    psi: np.ndarray
    cost: float
    precision: np.ndarray


def fit_levels(
    parts: Sequence[Sums], levels: Sequence[Level], psi: np.ndarray, tolerance: float = 0.01, steps: int = STEPS
) -> Levelled:
    """Fisher's scoring with damping from `psi` on, until a step gains less than `tolerance` [nats]."""
    psi, damping = psi.copy(), 1e-3
    prior = prior_cost(levels, psi)
    total = cost(parts, psi) + prior[0]
    slope, fisher = slopes(parts, psi)
    for _ in range(steps):
        precision = fisher + np.diag(prior[2])
        step = -np.linalg.solve(precision + damping * np.diag(np.diag(precision)), slope + prior[1])
        trial = psi + np.clip(step, -LONGEST, LONGEST)
        there = prior_cost(levels, trial)
        then = cost(parts, trial) + there[0]
        if then > total - FEWEST:
            damping = 8.0 * damping + 1e-3
            if damping > 1e5:
                break
            continue
        gained, psi, prior, total, damping = total - then, trial, there, then, max(damping / 6.0, 1e-6)
        slope, fisher = slopes(parts, psi)
        if gained < tolerance:
            break
    return Levelled(psi, total, fisher + np.diag(prior[2]))


def best_levels(parts: Sequence[Sums], levels: Sequence[Level], psi: np.ndarray, raised: bool = True) -> Levelled:
    """The best of several starts: as they are, at the priors' middles, and with each latent level that promises
    most raised in turn, for what is left may be laid to one place or another, and each is an optimum of its own.
    """
    middle = middles(levels)
    starts = [psi, middle]
    slope, fisher = slopes(parts, middle)
    promise = np.maximum(-slope, 0.0) ** 2 / np.maximum(np.diag(fisher), 1e-300)
    latent = [index for index, level in enumerate(levels) if level.place is not None]
    for index in sorted(latent, key=lambda one: -promise[one])[: PROMISING if raised else 0]:
        start = middle.copy()
        start[index] += RAISED
        starts.append(start)
    rough = [fit_levels(parts, levels, start, 0.05, 12) for start in starts]
    best = min(rough, key=lambda one: one.cost)
    return fit_levels(parts, levels, best.psi)
