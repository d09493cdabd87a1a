"""A first order of many effects beside a fit: one linear step of each from each of its starts, in the levels of the fit
and in levels that are raised as where another fit begins, whichever gains more. In the first, what is small shows; in
the second, what is far off. It decides nothing; what comes first is fitted.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from experiments.discrepancy.core.levels import sums
from experiments.discrepancy.core.model import Effect, Fit, Hypothesis
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import Problem, raised, whitened

SIZE = 1.5  # of the first start; sd of an effect's size where it is taken as linear
ASSUMED = 10  # families whose scores are taken to have the variance 1, beside those that are looked at
AT_ONCE = 24  # starts whose predictions are made together


def first_gains(
    base: Fit, effects: Sequence[Effect], policy: Policy, end: float = math.inf
) -> list[tuple[float, Effect, np.ndarray]]:
    """What a step gains over the same step without the effect [nats], the effect and the start, of every start that is
    reached before `end` of time.monotonic().
    """
    screens = _both(base, policy)
    begins = [(one, x) for one in effects for x in one.begins(base.x, base.system.coordinates)]
    found = []
    for first in range(0, len(begins), AT_ONCE):
        if time.monotonic() > end:
            break
        steps = _Steps.of(base, policy, begins[first : first + AT_ONCE])
        gains = np.max([one.gains(steps) for one in screens], axis=0)
        found += [(float(gain), one, x) for gain, (one, x) in zip(gains, begins[first:], strict=False)]
    return found


def rough_gains(base: Fit, effects: Sequence[Effect], policy: Policy) -> list[float]:
    """What each effect gains beside a fit if all were linear [nats], without a run: by its prior where it is a
    coordinate of the fit, else by what it changes of the nominal predictions, at sizes with normal priors.
    """
    screens = _both(base, policy)
    return [max(screen.rough(one) for screen in screens) for one in effects]


def _both(base: Fit, policy: Policy) -> "tuple[_Screen, _Screen]":
    """In raised levels, and in those of the fit."""
    return _Screen(base, policy), _Screen(base, policy, base.psi)


def misfit(base: Fit, effects: Sequence[Effect], policy: Policy) -> float:
    """How much better than by chance what a fit leaves is explained by effects that it does not name: the mean square
    of their scores z, at least 1; each family counts once.

    Scores have the variance 1 where the model errs only as its sources of error say. Where a model lacks much, most
    effects explain a little of that, and the largest score is no evidence for its effect. The spread of all scores then
    takes the place of 1 (the empirical null of Efron 2004, J. Am. Stat. Assoc. 99).
    """
    families: dict[str, list[float]] = {}
    named, screen = base.hypothesis.families, _Screen(base, policy, base.psi)
    for one in effects:
        if (
            one.kind == "name"
            and one.shown
            and one.family not in named
            and (square := screen.square_of(one.shown)) is not None
        ):
            families.setdefault(one.family, []).append(square)
    squares = [float(np.mean(one)) for one in families.values()]
    return max(1.0, (sum(squares) + ASSUMED) / (len(squares) + ASSUMED))


class _Screen:
    """What all effects share: the slopes of the fit, whitened, and what the step gains without an effect. psi : levels;
    those of the fit with the latent ones raised where none are given.
    """

    def __init__(self, base: Fit, policy: Policy, psi: np.ndarray | None = None) -> None:
        self.base, self.policy = base, policy
        self.problem = Problem(base.system, base.hypothesis, policy)
        latent = np.array([one.place is not None for one in self.problem.levels])
        high = np.where(latent, np.maximum(base.psi, raised(self.problem.levels)), base.psi)
        self.psi = high if psi is None else psi
        self.parts = sums(base.groups)
        self.slopes = whitened(self.parts, self.psi, base.slopes)
        self.square = self.slopes @ self.slopes.T
        self.residual = whitened(self.parts, self.psi, [one.residual[None] for one in base.groups])[0]
        self.without = self._value(self.problem, base.x, self.residual, self.slopes[:0])

    def rough(self, effect: Effect) -> float:
        """As `rough_gains` says."""
        if effect.moves or not effect.own:
            healthy = self.base.system.coordinates
            begin, *_ = effect.begins(self.base.x, healthy)
            moved = [effect.along(healthy)] if effect.moves else np.zeros((0, len(healthy)))
            own = moved @ self.slopes[: len(healthy)]
            return self._value(self._problem(effect), begin, self.residual, own) - self.without
        if effect.shown is None:
            return math.inf
        push, alone = self._of_changes(effect.shown)
        wide = alone + SIZE**-2 * np.eye(len(push))
        return float(0.5 * push @ np.linalg.solve(wide, push) - 0.5 * np.linalg.slogdet(SIZE**2 * wide)[1])

    def square_of(self, shown: Sequence[np.ndarray]) -> float | None:
        """Mean square of the scores z of what an effect changes of the predictions; None where the fit would not show
        it.
        """
        push, alone = self._of_changes(shown)
        seen = np.linalg.eigvalsh(alone)[0] > 1.0
        return float(push @ np.linalg.solve(alone, push)) / len(push) if seen else None

    def _of_changes(self, shown: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Slope of the log likelihood by the sizes of changes (K,), and their information (K, K), both freed of what
        the fit's coordinates take.
        """
        changes = whitened(self.parts, self.psi, shown)
        along = self.slopes @ changes.T
        shared = cho_solve(self.curved, along)
        return changes @ self.residual - shared.T @ self.pull, changes @ changes.T - shared.T @ along

    @cached_property
    def pull(self) -> np.ndarray:
        """Slope of the log posterior by the fit's coordinates."""
        return self.slopes @ self.residual - (self.base.x - self.problem.means) / self.problem.spreads**2

    @cached_property
    def curved(self) -> tuple[np.ndarray, bool]:
        """Its curvature, factorised (Cholesky)."""
        return cho_factor(self.square + np.diag(1.0 / self.problem.spreads**2))

    def gains(self, steps: "_Steps") -> list[float]:
        """Of each start."""
        count, found = len(self.base.x), []
        for problem, at, left in zip(steps.problems, steps.points, steps.left, strict=True):
            white = whitened(self.parts, self.psi, left)
            moved = (at[1:] - at[0])[:, count:]
            own = (white[0] - white[1:]) / moved.sum(axis=1)[:, None]
            good = np.isfinite(white).all()
            found.append(self._value(problem, at[0], white[0], own) - self.without if good else -np.inf)
        return found

    def _problem(self, effect: Effect) -> Problem:
        return _beside(self.base, effect, self.policy)

    def _value(self, problem: Problem, x: np.ndarray, residual: np.ndarray, own: np.ndarray) -> float:
        """Log of the marginal likelihood of the linear model about x, but for what all hypotheses share."""
        cross = self.slopes @ own.T
        square = np.block([[self.square, cross], [cross.T, own @ own.T]])
        precision = square + np.diag(1.0 / problem.spreads**2)
        slope = np.concatenate([self.slopes @ residual, own @ residual]) - (x - problem.means) / problem.spreads**2
        cost = 0.5 * residual @ residual + problem.prior(x) - 0.5 * slope @ np.linalg.solve(precision, slope)
        return float(-cost + 0.5 * len(x) * np.log(2.0 * np.pi) - 0.5 * np.linalg.slogdet(precision)[1])


@dataclass(frozen=True)
class _Steps:
    """Starts of effects beside a fit: the hypothesis of each, its points (1 + own coordinates, coordinates), and what
    is left there of each group.
    """

    problems: list[Problem]
    points: list[np.ndarray]
    left: list[list[np.ndarray]]

    @classmethod
    def of(cls, base: Fit, policy: Policy, begins: Sequence[tuple[Effect, np.ndarray]]) -> "_Steps":
        """All runs at once."""
        problems = [_beside(base, one, policy) for one, _ in begins]
        points = [_moved(problem, x, len(base.x)) for problem, (_, x) in zip(problems, begins, strict=True)]
        whole = [problem.hypothesis.effects for problem in problems]
        predicted = base.system.predict_each(list(zip(points, whole, strict=True)))
        seen = base.system.observed
        left = [[one[None] - two for one, two in zip(seen, parts, strict=True)] for parts in predicted]
        return cls(problems, points, left)


def _beside(base: Fit, effect: Effect, policy: Policy) -> Problem:
    return Problem(base.system, Hypothesis((*base.hypothesis.effects, effect)), policy)


def _moved(problem: Problem, x: np.ndarray, first: int) -> np.ndarray:
    """x, and x with each coordinate from `first` on moved by a little."""
    return np.concatenate([x[None], x + np.diag(problem.sizes)[first:]])
