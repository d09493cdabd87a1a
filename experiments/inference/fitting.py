"""One hypothesis at its optimum, and its evidence by Laplace's approximation.

Gauss and Newton for the mean (Levenberg's damping; a step is shortened, never bent, for clipping single coordinates
leaves ridges), Fisher's scoring for the levels. Mean and covariance are orthogonal in information, so that the two
blocks do not mix:

    log Z = -cost + d / 2 log 2 pi - 1/2 log |H_x| - 1/2 log |H_psi|.

Latent levels begin at five times what healthy systems have and are lowered in stages: where they are free from the
start they take what the coordinates could explain, and nothing pulls the mean any more.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from experiments.inference.levels import Sums, best_levels, cost, fit_levels, middles, sums
from experiments.inference.model import Coordinate, Fit, Group, Hypothesis, Level, System
from experiments.inference.policy import Policy

STAGES = ((math.log(5.0), 6), (0.0, 4), (None, 12))
"""Logs by which latent levels stand above their healthy middles, None = free; and steps at most."""

DIFFERENCE = 0.005  # of a prior's standard deviation; step of the derivatives
ROUNDS = 5  # of covariance and fit at most
TRIES = 8  # dampings of a step
CHORD_TRIES = 2  # with slopes of another point


class OutOfTimeError(Exception):
    """The time for a search has ended."""


@dataclass(frozen=True)
class Problem:
    """A hypothesis of a system: what is searched for, with which priors; `end` of time.monotonic()."""

    system: System
    hypothesis: Hypothesis
    policy: Policy
    end: float = math.inf

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """Of the hypothesis."""
        return self.hypothesis.coordinates(self.system.coordinates)

    @property
    def levels(self) -> tuple[Level, ...]:
        """Of the hypothesis."""
        return self.hypothesis.levels(self.system.levels, self.policy)

    @property
    def means(self) -> np.ndarray:
        """Of the coordinates' priors."""
        return np.array([one.mean for one in self.coordinates])

    @property
    def spreads(self) -> np.ndarray:
        """Standard deviations of the coordinates' priors."""
        return np.array([one.spread for one in self.coordinates])

    def prior(self, x: np.ndarray) -> float:
        """Minus log prior density of the coordinates."""
        apart = (x - self.means) / self.spreads
        return 0.5 * float(apart @ apart) + float(np.log(self.spreads).sum()) + 0.5 * len(x) * math.log(2.0 * math.pi)

    def residuals(self, points: np.ndarray) -> tuple[np.ndarray, ...]:
        """(points, F, T, C) of each group; raises `OutOfTimeError`."""
        if time.monotonic() > self.end:
            raise OutOfTimeError
        predicted = self.system.predict(points, self.hypothesis.effects)
        return tuple(seen[None] - one for seen, one in zip(self.system.observed, predicted, strict=True))

    def groups(self, x: np.ndarray, components: Sequence[np.ndarray]) -> tuple[Group, ...]:
        """Residuals at x with these covariances."""
        return tuple(Group(one[0], part) for one, part in zip(self.residuals(x[None]), components, strict=True))

    @property
    def changed(self) -> np.ndarray:
        """Places of the coordinates that the hypothesis brings or gives other priors."""
        faults = {one.name for effect in self.hypothesis.effects for one in effect.faults}
        faults |= {one.name for level in self.hypothesis.unknown for one in level.law}
        count = len(self.system.coordinates)
        return np.array([k for k, one in enumerate(self.coordinates) if k >= count or one.name in faults], int)

    def slopes(self, x: np.ndarray, groups: Sequence[Group], which: np.ndarray | None = None) -> tuple[np.ndarray, ...]:
        """(coordinates, F, T, C) of each group: forward differences of the predictions from `groups` at x on, all runs
        at once; by those coordinates alone that are asked for.
        """
        which = np.arange(len(x)) if which is None else which
        sizes = np.array([one.step or DIFFERENCE * one.spread for one in self.coordinates])
        moved = self.residuals(x + np.diag(sizes)[which])
        parts = zip(groups, moved, strict=True)
        return tuple((one.residual[None] - other) / sizes[which].reshape(-1, 1, 1, 1) for one, other in parts)

    def renewed(self, x: np.ndarray, groups: Sequence[Group], old: Sequence[np.ndarray]) -> tuple[np.ndarray, ...]:
        """Slopes at x: those of another hypothesis or point, but for the coordinates of the effects."""
        if not len(self.changed):
            return tuple(old)
        new = self.slopes(x, groups, self.changed)
        both = [np.concatenate([one, np.zeros((len(x) - len(one), *one.shape[1:]), one.dtype)]) for one in old]
        for whole, part in zip(both, new, strict=True):
            whole[self.changed] = part
        return tuple(both)


def raised(levels: Sequence[Level], above: float = STAGES[0][0]) -> np.ndarray:
    """Levels at their middles, the latent ones above them by a log: as high as where a fit begins."""
    return middles(levels) + np.array([above if one.place else 0.0 for one in levels])


def whitened(parts: Sequence[Sums], psi: np.ndarray, arrays: Sequence[np.ndarray]) -> np.ndarray:
    """(rows, values) of arrays (rows, F, T, C): multiplied with the inverse root of each covariance, real."""
    columns = []
    for one, values in zip(parts, arrays, strict=True):
        root = np.linalg.inv(np.linalg.cholesky(one.covariance(psi)))
        white = np.einsum("fcd,rftd->rftc", root, values, optimize=True).reshape(len(values), -1)
        columns += [white.real, white.imag] if np.iscomplexobj(white) else [white]
    return np.concatenate(columns, axis=1)


def newton(
    problem: Problem, x: np.ndarray, parts: Sequence[Sums], psi: np.ndarray, groups: Sequence[Group],
    slopes: Sequence[np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Slope and Gauss-Newton matrix of the cost by the coordinates."""
    white = whitened(parts, psi, slopes)
    residual = whitened(parts, psi, [group.residual[None] for group in groups])[0]
    precision = 1.0 / problem.spreads**2
    return (x - problem.means) * precision - white @ residual, white @ white.T + np.diag(precision)


def fit(
    problem: Problem, x: np.ndarray, psi: np.ndarray | None = None, slopes: Sequence[np.ndarray] | None = None,
    rounds: int = ROUNDS,
) -> Fit | None:  # fmt: skip
    """The optimum from x on, made about its own state, until two rounds agree; None = nothing finite there.

    psi : levels to begin with; None anneals the latent ones. slopes : of a fit nearby, to begin with. Where the time
    ends, the last round's fit.

    Raises
    ------
    OutOfTimeError : the time ended before the first round.
    """
    found: Fit | None = None
    try:
        for _ in range(rounds):
            here = replace(problem, system=problem.system.about(x, problem.hypothesis.effects, psi))
            components = here.system.covariances(x, problem.hypothesis.effects)
            if not all(np.isfinite(part).all() for part in components):
                break
            this = _round(here, x, psi, components, slopes)
            if this is None:
                break
            agree = found is not None and abs(this.evidence - found.evidence) < problem.policy.tolerance
            found = this
            if agree:
                break
            x, psi, slopes = this.x, this.psi, this.slopes
        return found and finish(replace(problem, system=found.system), found.x, found.psi, found.groups)
    except OutOfTimeError:
        if found is None:
            raise
        return found


def _round(
    problem: Problem, x: np.ndarray, psi: np.ndarray | None, components: Sequence[np.ndarray],
    slopes: Sequence[np.ndarray] | None,
) -> Fit | None:  # fmt: skip
    """One search with fixed covariances of unit levels; evidence by the slopes of its last steps."""
    groups = problem.groups(x, components)
    if not all(np.isfinite(group.residual).all() for group in groups):
        return None
    levels, first = problem.levels, psi is None
    slopes = problem.slopes(x, groups) if slopes is None else problem.renewed(x, groups, slopes)
    for above, steps in STAGES if first else STAGES[-1:]:
        free = above is None
        if free:
            start = best_levels(sums(groups), levels, middles(levels) if psi is None else psi, first).psi
        else:
            start = raised(levels, above)
        x, psi, groups, slopes = _descend(problem, x, start, groups, components, steps, free, slopes)
    assert psi is not None
    return finish(problem, x, psi, groups, slopes)


def _descend(
    problem: Problem, x: np.ndarray, psi: np.ndarray, groups: tuple[Group, ...], components: Sequence[np.ndarray],
    steps: int, free: bool, slopes: Sequence[np.ndarray],
) -> tuple[np.ndarray, np.ndarray, tuple[Group, ...], Sequence[np.ndarray]]:  # fmt: skip
    """At most so many steps of the mean, with the levels held or following. Slopes are kept while they serve (a chord):
    made anew where a step gains less than half of what they promise; those of the effects' coordinates at every step.
    """
    damping, enough, fresh = 1e-3, problem.policy.tolerance if free else 1.0, False
    parts = sums(groups)
    total, psi = _levelled(problem, x, psi, parts, free)
    for _ in range(steps):
        slope, precision = newton(problem, x, parts, psi, groups, slopes)
        for _ in range(TRIES if fresh else CHORD_TRIES):
            step = -np.linalg.solve(precision + damping * np.diag(np.diag(precision)), slope)
            step *= min(1.0, problem.policy.longest_step / float(np.abs(step / problem.spreads).max(initial=1e-300)))
            tried = problem.groups(x + step, components)
            trial = sums(tried)
            then, levelled = _levelled(problem, x + step, psi, trial, free)
            if then < total:
                break
            damping = 8.0 * damping + 1e-4
        else:
            if fresh:
                break
            slopes, fresh, damping = problem.slopes(x, groups), True, 1e-3
            continue
        promised = -float(slope @ step + 0.5 * step @ precision @ step)
        gained, total = total - then, then
        x, psi, groups, parts, damping = x + step, levelled, tried, trial, max(damping / 8.0, 1e-7)
        if gained < enough and (fresh or promised < enough):
            break
        fresh = gained < 0.5 * promised
        slopes = problem.slopes(x, groups) if fresh else problem.renewed(x, groups, slopes)
    return x, psi, groups, slopes


def _levelled(
    problem: Problem, x: np.ndarray, psi: np.ndarray, parts: Sequence[Sums], free: bool
) -> tuple[float, np.ndarray]:
    """Cost at x with the levels held, or with those that fit best from psi on."""
    if not all(np.isfinite(part.outer).all() for part in parts):
        return math.inf, psi
    if not free:
        return cost(parts, psi) + problem.prior(x), psi
    best = fit_levels(parts, problem.levels, psi, steps=8)
    return best.cost + problem.prior(x), best.psi


def few_steps(
    problem: Problem, x: np.ndarray, psi: np.ndarray, components: Sequence[np.ndarray], steps: int,
    slopes: Sequence[np.ndarray],
) -> tuple[float, np.ndarray]:  # fmt: skip
    """Evidence after so many steps of the mean, with the levels that fit best there, and where they led; minus infinite
    where the prediction is not finite. The steps are taken with the latent levels raised as where a fit begins, for in
    levels that fit another hypothesis every step from afar leads uphill; and one more in these, for what is small.
    slopes : of a fit nearby.
    """
    groups = problem.groups(x, components)
    if not all(np.isfinite(group.residual).all() for group in groups):
        return -math.inf, x
    high = np.where([one.place is None for one in problem.levels], psi, np.maximum(psi, raised(problem.levels)))
    slopes = problem.renewed(x, groups, slopes)
    for held, most in ((high, steps), (psi, 1)):
        x, _, groups, slopes = _descend(problem, x, held, groups, components, most, False, slopes)
    parts = sums(groups)
    best = fit_levels(parts, problem.levels, psi, steps=8)
    _, precision = newton(problem, x, parts, best.psi, groups, slopes)
    return laplace(best.cost + problem.prior(x), precision, best.precision), x


def finish(
    problem: Problem, x: np.ndarray, psi: np.ndarray, groups: tuple[Group, ...],
    slopes: Sequence[np.ndarray] | None = None,
) -> Fit:  # fmt: skip
    """The fit at x, with its evidence; with new slopes where none are given."""
    parts = sums(groups)
    best = fit_levels(parts, problem.levels, psi)
    slopes = problem.slopes(x, groups) if slopes is None else tuple(slopes)
    _, precision = newton(problem, x, parts, best.psi, groups, slopes)
    total = best.cost + problem.prior(x)
    evidence = laplace(total, precision, best.precision)
    psi, levels = best.psi, best.precision
    return Fit(problem.hypothesis, problem.system, x, psi, total, evidence, precision, levels, groups, slopes)


def laplace(total: float, precision: np.ndarray, level_precision: np.ndarray) -> float:
    """Log of the marginal likelihood [nats]."""
    size = len(precision) + len(level_precision)
    determinants = np.linalg.slogdet(precision)[1] + np.linalg.slogdet(level_precision)[1]
    return float(-total + 0.5 * size * math.log(2.0 * math.pi) - 0.5 * determinants)


def with_unknown(policy: Policy, base: Fit, levels: tuple[Level, ...], end: float = math.inf) -> Fit:
    """The same effects with something unknown at these levels: levels fitted anew, and the mean where they changed;
    raises `OutOfTimeError`.
    """
    other = Problem(base.system, replace(base.hypothesis, unknown=levels), policy, end)
    parts = sums(base.groups)
    start = base.psi.copy()
    for index, one in enumerate(other.levels):
        if one.name in {level.name for level in levels}:
            start[index] = max(start[index], one.prior.middle)
    rough = min(
        (fit_levels(parts, other.levels, one) for one in (base.psi, start)), key=lambda one: one.cost
    )  # fmt: skip
    components = [group.components for group in base.groups]
    x, psi, groups, slopes = _descend(other, base.x, rough.psi, base.groups, components, 4, True, base.slopes)
    return finish(other, x, psi, groups, slopes)
