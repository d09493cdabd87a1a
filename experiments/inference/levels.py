"""Levels of error: their likelihood given the residuals, and the fit that maximises it with their priors.

For each covariance S(psi) = sum_k exp(2 psi_k) K_k that is met T times, the residuals count by their sum of outer
products alone. Slope: tr(S^-1 dS_k) T - tr(S^-1 dS_k S^-1 R); Fisher information: T tr(S^-1 dS_k S^-1 dS_l), both by
half (Mardia and Marshall 1984, Biometrika 71, eqs. 3 and 4).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from experiments.inference.model import Group, Level

LONGEST = 1.2  # of a step of a log level
FEWEST = 1e-9  # nats; a step that gains less ends the search
STEPS = 60
SAME = 1e-9  # of the standard deviations of all errors together
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
    def roots(self) -> np.ndarray | None:
        """(F, C, levels): K_k = r_k r_k^H, where each component is the square of one column (one source that all
        channels hear); None where one of them is not.
        """
        diagonal = np.real(np.einsum("kfcc->kfc", self.components))
        largest = np.argmax(diagonal, axis=2)[..., None]
        column = np.take_along_axis(self.components, largest[..., None, :], 3)[..., 0]
        size = np.sqrt(np.take_along_axis(diagonal, largest, 2))
        columns = column / np.where(size > 0.0, size, 1.0)
        square = columns[..., None] * np.conj(columns[..., None, :])
        whole = np.sqrt(diagonal.sum(axis=0))
        alike = (np.abs(square - self.components) <= SAME * whole[:, :, None] * whole[:, None, :]).all()
        return np.ascontiguousarray(np.moveaxis(columns, 0, 2)) if alike else None

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
    for one in parts:
        inverse = np.linalg.inv(one.covariance(psi))
        if one.roots is not None:
            seen, twice = inverse @ one.roots, 2.0 * np.exp(2.0 * psi)
            between = np.conj(np.swapaxes(one.roots, 1, 2)) @ seen
            trace = np.real(np.einsum("fkk->k", between))
            square = np.real((np.conj(seen) * (one.outer @ seen)).sum((0, 1)))
            slope += 0.5 * twice * (one.repeats * trace - square)
            fisher += 0.5 * one.repeats * np.outer(twice, twice) * (np.abs(between) ** 2).sum(0)
            continue
        turned = inverse[None] @ (2.0 * np.exp(2.0 * psi)[:, None, None, None] * one.components)
        flat, other = turned.reshape(count, -1), np.swapaxes(turned, -1, -2).reshape(count, -1)
        residual = (inverse @ one.outer).ravel()
        trace = np.real(np.einsum("kfcc->k", turned))
        slope += 0.5 * (one.repeats * trace - np.real(other @ residual))
        fisher += 0.5 * one.repeats * np.real(flat @ other.T)
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
    """The best of several starts: as they are, at the priors' middles, and with each latent level raised in turn,
    for what is left may be laid to one place or another, and each is an optimum of its own.
    """
    middle = middles(levels)
    starts = [psi, middle]
    for index, level in enumerate(levels if raised else ()):
        if level.place is not None:
            start = middle.copy()
            start[index] += RAISED
            starts.append(start)
    rough = [fit_levels(parts, levels, start, 0.05, 12) for start in starts]
    best = min(rough, key=lambda one: one.cost)
    return fit_levels(parts, levels, best.psi)
