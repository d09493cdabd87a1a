"""One hypothesis at its optimum, and its evidence by Laplace's approximation.

Gauss and Newton for the mean (Levenberg's damping; a step is shortened, never bent, for clipping single coordinates
leaves ridges), Fisher's scoring for the levels. Mean and covariance are orthogonal in information, so that the two
blocks do not mix:

    log Z = -cost + d / 2 log 2 pi - 1/2 log |H_x| - 1/2 log |H_psi|.

Latent levels begin at five times what healthy systems have and are lowered in stages: where they are free from the
start they take what the coordinates could explain, and nothing pulls the mean any more.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from experiments.discrepancy.core.descent import Descent
from experiments.discrepancy.core.levels import Sums, best_levels, fit_levels, middles, sums
from experiments.discrepancy.core.model import Fit, Group, Level
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import ABOVE, OutOfTimeError, Problem, Slopes, between, raised

STAGES = ((ABOVE, 6), (0.0, 4), (None, 12))
"""Logs by which latent levels stand above their healthy middles, None = free; and steps at most."""

ROUNDS = 5  # of covariance and fit at most


def curvature(problem: Problem, parts: Sequence[Sums], psi: np.ndarray, slopes: Sequence[np.ndarray]) -> np.ndarray:
    """Gauss-Newton matrix of the cost by the coordinates."""
    return between(parts, psi, slopes, slopes) + np.diag(1.0 / problem.spreads**2)


def fit(
    problem: Problem, x: np.ndarray, psi: np.ndarray | None = None, slopes: Sequence[np.ndarray] | None = None,
    rounds: int = ROUNDS, thorough: bool = True,
) -> Fit | None:  # fmt: skip
    """The optimum from x on, made about its own state, until two rounds agree; None = nothing finite there.

    psi : levels to begin with; None anneals the latent ones. slopes : of a fit nearby, to begin with. thorough : the
    last step of a round has slopes of its own. Where the time ends, the last round's fit.

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
            this = _round(here, x, psi, components, slopes, thorough)
            if this is None:
                break
            agree = found is not None and abs(this.evidence - found.evidence) < problem.policy.tolerance
            found = this
            if agree:
                break
            x, psi, slopes = this.x, this.psi, this.slopes
    except OutOfTimeError:
        if found is None:
            raise
    return found


def _round(
    problem: Problem, x: np.ndarray, psi: np.ndarray | None, components: Sequence[np.ndarray],
    slopes: Sequence[np.ndarray] | None, thorough: bool,
) -> Fit | None:  # fmt: skip
    """One search with fixed covariances of unit levels."""
    groups, rows = problem.ahead(x, components)
    if not all(np.isfinite(group.residual).all() for group in groups):
        return None
    levels, first, fresh = problem.levels, psi is None, not slopes
    here = problem.with_own(slopes, rows) if slopes else problem.slopes(x, groups)
    for above, steps in STAGES if first else STAGES[-1:]:
        free = above is None
        if free:
            start = best_levels(sums(groups), levels, middles(levels) if psi is None else psi, first).psi
        else:
            start = raised(levels, above)
        way = Descent(problem, x, start, groups, here, free, fresh, thorough=free and thorough).run(steps)
        x, psi, groups, here, fresh = way.x, way.psi, way.groups, way.slopes, way.fresh
    assert psi is not None
    return finish(problem, x, psi, groups, here)


def few_steps(
    problem: Problem, x: np.ndarray, psi: np.ndarray, components: Sequence[np.ndarray], steps: int,
    slopes: Sequence[np.ndarray],
) -> tuple[float, np.ndarray]:  # fmt: skip
    """Evidence after so many steps of the mean, with the levels that fit best there, and where they led; minus infinite
    where the prediction is not finite. The steps are taken with the latent levels raised as where a fit begins, for in
    levels that fit another hypothesis every step from afar leads uphill; and one more in these, for what is small.
    slopes : of a fit nearby.
    """
    groups, rows = problem.ahead(x, components)
    if not all(np.isfinite(group.residual).all() for group in groups):
        return -math.inf, x
    high = np.where([one.place is None for one in problem.levels], psi, np.maximum(psi, raised(problem.levels)))
    here = problem.with_own(slopes, rows)
    for held, most in ((high, steps), (psi, 1)):
        way = Descent(problem, x, held, groups, here, free=False).run(most)
        x, groups, here = way.x, way.groups, way.slopes
    parts = sums(groups)
    best = fit_levels(parts, problem.levels, psi, steps=8)
    precision = curvature(problem, parts, best.psi, here)
    return laplace(best.cost + problem.prior(x), precision, best.precision), x


def finish(
    problem: Problem, x: np.ndarray, psi: np.ndarray, groups: tuple[Group, ...], slopes: Slopes | None = None
) -> Fit:
    """The fit at x, with its evidence; with new slopes where none are given."""
    parts = sums(groups)
    best = fit_levels(parts, problem.levels, psi)
    slopes = problem.slopes(x, groups) if slopes is None else tuple(slopes)
    precision = curvature(problem, parts, best.psi, slopes)
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
    """The same effects with something unknown at these levels: levels fitted anew, and the mean where they changed and
    runs are not dear; raises `OutOfTimeError`.
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
    if base.system.dear:
        return finish(other, base.x, rough.psi, base.groups, base.slopes)
    way = Descent(other, base.x, rough.psi, base.groups, base.slopes, free=True).run(4)
    return finish(other, way.x, way.psi, way.groups, way.slopes)
