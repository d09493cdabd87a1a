"""Gauss and Newton's descent of the mean, with covariances that are held.

Predictions cost far more than anything else here, and their derivatives as many runs as there are coordinates. So the
slopes are those of another point as long as they serve. Each step tells what they missed along it (Broyden 1965, Math.
Comp. 19, eq. 4.5), and those of the effects' own coordinates come with every prediction. They are made anew where steps
gain much less than they promise, and before a search may end.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from experiments.discrepancy.core.levels import Sums, cost, fit_levels, sums
from experiments.discrepancy.core.model import Group
from experiments.discrepancy.core.problem import Problem, Slopes, between

TRIES = 8  # dampings of a step
CHORD_TRIES = 2  # with slopes of another point
POOR = 0.25  # of what a step promised: gains below it ask for new slopes
LEAST = 0.1  # of a step: where the others' part is smaller, they are not made to answer for all that was missed
ROUGH = 1.0  # nats; what a search with held levels leaves
LEVEL_TOLERANCE = 0.05  # nats; a step of the levels that gains less ends their search


@dataclass
class Descent:
    """A search under way at x, with the levels `psi`, held or `free`. `fresh` : whether the slopes are those of x.
    `thorough` : whether it may end with fresh slopes alone.
    """

    problem: Problem
    x: np.ndarray
    psi: np.ndarray
    groups: tuple[Group, ...]
    slopes: Slopes
    free: bool
    fresh: bool = False
    thorough: bool = False

    def __post_init__(self) -> None:
        self.damping, self.owned = 1e-3, False
        self.components = [one.components for one in self.groups]
        self.parts = sums(self.groups)
        self.total, self.psi = self._levelled(self.x, self.parts)
        self._bend()

    @property
    def enough(self) -> float:
        """Nats that are not worth a step."""
        return self.problem.policy.tolerance if self.free else ROUGH

    def run(self, steps: int) -> "Descent":
        """At most so many steps; gives itself."""
        for _ in range(steps):
            if not self._stepped():
                break
        return self

    def _stepped(self) -> bool:
        """One step, or new slopes where these promise nothing; whether there may be more to gain."""
        problem = self.problem
        slope = (self.x - problem.means) * self._precise - between(
            self.parts, self.psi, self.slopes, [one.residual[None] for one in self.groups]
        )[:, 0]  # fmt: skip
        precision, promised = self.curvature + np.diag(self._precise), 0.0
        for _ in range(TRIES if self.fresh else CHORD_TRIES):
            step = -np.linalg.solve(precision + self.damping * np.diag(np.diag(precision)), slope)
            longest = float(np.abs(step / problem.spreads).max(initial=1e-300))
            step *= min(1.0, problem.policy.longest_step / longest)
            promised = -float(slope @ step + 0.5 * step @ precision @ step)
            if promised < self.enough:
                break
            exact = self.fresh
            if (gained := self._tried(step)) is not None:
                self.damping = max(self.damping / 8.0, 1e-7)
                if gained > promised:
                    gained += self._further(step)
                return not (exact and gained < self.enough) and (gained > POOR * promised or self._renewed())
            self.damping = 8.0 * self.damping + 1e-4
        return not self.fresh and (self.thorough or promised >= self.enough) and self._renewed()

    def _further(self, step: np.ndarray) -> float:
        """Gain of the same step once more, twice as far as long as it gains: levels fall with what the mean takes, and
        a step of the mean alone does not know that.
        """
        total = 0.0
        while (gained := self._tried(step)) is not None:
            total, step = total + gained, 2.0 * step
            if gained < self.enough:
                break
        return total

    def _tried(self, step: np.ndarray) -> float | None:
        """What a step gains [nats], and it is taken; None where it leads uphill."""
        x = self.x + step
        groups, rows = self.problem.ahead(x, self.components)
        parts = sums(groups)
        total, psi = self._levelled(x, parts)
        if not total < self.total:
            return None
        self._learn(step, groups, rows)
        gained, self.total = self.total - total, total
        self.x, self.psi, self.groups, self.parts, self.fresh = x, psi, groups, parts, False
        return gained

    def _levelled(self, x: np.ndarray, parts: Sequence[Sums]) -> tuple[float, np.ndarray]:
        """Cost at x with the levels held, or with those that fit best."""
        if not all(np.isfinite(part.outer).all() for part in parts):
            return math.inf, self.psi
        if not self.free:
            return cost(parts, self.psi) + self.problem.prior(x), self.psi
        best = fit_levels(parts, self.problem.levels, self.psi, LEVEL_TOLERANCE)
        return best.cost + self.problem.prior(x), best.psi

    @cached_property
    def _precise(self) -> np.ndarray:
        return 1.0 / self.problem.spreads**2

    def _bend(self) -> None:
        """The curvature by these slopes and levels."""
        self.bent = self.parts, self.psi
        self.curvature = between(*self.bent, self.slopes, self.slopes)

    def _renewed(self) -> bool:
        """Slopes at x."""
        self.slopes, self.fresh, self.owned, self.damping = self.problem.slopes(self.x, self.groups), True, True, 1e-3
        self._bend()
        return True

    def _learn(self, step: np.ndarray, groups: Sequence[Group], rows: Slopes) -> None:
        """From what a step did: the slopes along it, and those of the coordinates that are followed."""
        if not self.owned:
            self.slopes, self.owned = tuple(one.copy() for one in self.slopes), True
        followed = self.problem.followed
        told = (np.diag(self.curvature) + self._precise) * step
        least = LEAST * float(told @ step)
        told[followed] = 0.0
        along = told / max(float(told @ step), least)
        steps = zip(self.groups, groups, self.slopes, rows, strict=True)
        missed = []
        for old, new, one, row in steps:
            bent = 0.5 * np.tensordot(step[followed], row - one[followed], 1)
            missed.append((old.residual - new.residual - np.tensordot(step, one, 1) - bent)[None])
        cross, square = between(*self.bent, self.slopes, missed)[:, 0], between(*self.bent, missed, missed)[0, 0]
        self.curvature += np.outer(cross, along) + np.outer(along, cross) + square * np.outer(along, along)
        for one, part in zip(self.slopes, missed, strict=True):
            one += along[:, None, None, None] * part
        if len(followed):
            for one, part in zip(self.slopes, rows, strict=True):
                one[followed] = part
            self.curvature[:, followed] = between(*self.bent, self.slopes, rows)
            self.curvature[followed] = self.curvature[:, followed].T
