"""Hypothesis: none, one or more effects with free numbers beside all nuisances, fitted together; and its evidence."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from experiments.discrepancy.fit.candidates import Candidate, is_threshold
from experiments.discrepancy.fit.fitting import Fit, Problem, improved, with_candidates
from experiments.discrepancy.fit.products import WEIGHT, normal_equations
from experiments.discrepancy.fit.scores import Shares, value_at
from experiments.discrepancy.progress import Progress
from railsim.effects.interface import Effect, Parameter
from railsim.errors import InputError

DROPPED = 3
WORTH_NAMING = 0.5  # of the smallest size that its kind says is worth naming
OWN_ERROR = 0.05  # of an effect's size, what the model is wrong by in all sections alike; read from development cases


@dataclass(frozen=True)
class Hypothesis:
    """Effects that were fitted together.

    Attributes
    ----------
    covariance : (m, m) of the shares, nuisances marginalised. log_evidence : Laplace, training frames. fresh : whether
    its derivatives were made anew as often as that brought something.
    """

    fit: Fit
    covariance: np.ndarray
    log_evidence: float
    fresh: bool = False

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """All its effects."""
        return self.fit.candidates

    @property
    def candidate(self) -> Candidate:
        """The first of its effects."""
        return self.fit.candidates[0]

    @property
    def effect(self) -> Effect:
        """The first, at the fitted numbers."""
        return self.fit.effects[0]

    @property
    def classes(self) -> frozenset[str]:
        """Equivalence classes of its effects."""
        return frozenset(one.equivalence for one in self.fit.candidates)

    @property
    def label(self) -> str:
        """Its effects in words."""
        return " + ".join(one.label for one in self.fit.candidates) or "nuisances alone"

    @property
    def slight(self) -> bool:
        """Whether one of its effects is far smaller than the smallest of its kind that is worth naming."""
        return any(_slight(*pair) for pair in zip(self.candidates, self.values, strict=True))

    @property
    def values(self) -> list[dict[str, float]]:
        """Free numbers of each effect."""
        return Shares(self.fit.candidates).values(self.fit.shares)


Start = tuple[np.ndarray, Sequence[dict[str, float]]]


def hypothesis(
    problem: Problem,
    null: Fit,
    candidates: tuple[Candidate, ...],
    starts: Sequence[Start],
    progress: Progress,
    level: float = math.inf,
) -> Hypothesis | None:
    """Fitted from the best of some starts (nuisances, numbers of each effect), given up where its cost will not come
    down to `level`; None where the model runs at none.
    """
    shares = Shares(candidates)
    try:
        each = {(z.tobytes(), repr(values)): (z, shares.of(values)) for z, values in starts}
        begun = with_candidates(problem, null, candidates, list(each.values()))
    except InputError as error:
        progress(f"{' + '.join(one.label for one in candidates)}: {error}")
        return None
    return concluded(problem, improved(problem, begun, progress, level))


def concluded(problem: Problem, fit: Fit) -> Hypothesis:
    """A fit with its evidence: Laplace's approximation on training frames."""
    normal, _ = normal_equations(problem.jacobian(fit), fit.residual, problem.train)
    n, m = len(fit.z), len(fit.shares)
    whole = normal + np.diag(np.concatenate([np.ones(n), Shares(fit.candidates).width()]))
    covariance = np.linalg.inv(whole)[n:, n:]
    own = 0.0
    if m:
        width = 0.5 * m * math.log(2.0 * math.pi) + 0.5 * float(np.linalg.slogdet(covariance)[1])
        at_bound = sum(math.log(2.0) for share in fit.shares if not 1e-6 < share < 1.0 - 1e-6)
        own = min(width, 0.0) - at_bound  # a prior that is one in all over the range of shares
    log_evidence = -fit.cost(problem.train) - 0.5 * _log_determinant(normal[:n, :n] + np.eye(n)) + own
    return Hypothesis(replace(fit, jacobian=None), covariance, log_evidence)


def again(problem: Problem, one: Hypothesis, progress: Progress) -> Hypothesis:
    """Fitted on under another statement of the noise."""
    return concluded(problem, improved(problem, one.fit.rewhitened(problem), progress))


def robust_evidence(problem: Problem, one: Hypothesis, null: Hypothesis) -> float:
    """Evidence against another hypothesis [nats] without the sections that speak loudest for it."""
    gains = 0.5 * ((WEIGHT * null.fit.residual) ** 2 - (WEIGHT * one.fit.residual) ** 2).sum(axis=(1, 2))
    loudest = np.sort(gains[problem.train])[::-1][:DROPPED]
    return one.log_evidence - null.log_evidence - float(np.clip(loudest, 0.0, None).sum())


def intervals(problem: Problem, one: Hypothesis, which: int = 0) -> dict[str, dict[str, float | str]]:
    """Value and two standard deviations to each side of the numbers of one effect, widened where the residual is not
    white, and by what the model itself is wrong by.
    """
    misfit = problem.white.mean_square(one.fit.residual, problem.train) if problem.white else 1.0
    spread = np.sqrt(np.diag(one.covariance) * max(1.0, misfit))
    place = sum(len(before.parameters) for before in one.candidates[:which])
    found = {}
    for name, p in one.candidates[which].parameters.items():
        middle, reach = float(one.fit.shares[place]), 2.0 * float(spread[place])
        value, low, high = (value_at(p, share) for share in (middle, middle - reach, middle + reach))
        own = 2.0 * OWN_ERROR * _size(p, value)
        low, high = max(p.low, value - math.hypot(value - low, own)), min(p.high, value + math.hypot(high - value, own))
        found[name] = {"value": value, "low": low, "high": high, "unit": p.unit}
        place += 1
    return found


def _slight(candidate: Candidate, values: dict[str, float]) -> bool:
    sizes = [
        abs((values[name] - p.absent) / (p.smallest - p.absent))
        for name, p in candidate.parameters.items()
        if p.absent is not None and p.smallest is not None and p.smallest != p.absent
    ]
    return bool(sizes) and max(sizes) < WORTH_NAMING


def _size(p: Parameter, value: float) -> float:
    """How large a number is: its distance from where the effect is absent, or from nought if that is less far (numbers
    like a velocity of blow-off are absent at their largest); places and waves have none.
    """
    if p.absent is None:
        return 0.0
    return min(abs(value), abs(value - p.absent)) if is_threshold(p) else abs(value - p.absent)


def _log_determinant(matrix: np.ndarray) -> float:
    return float(np.linalg.slogdet(matrix)[1])
