"""Decide: named, ambiguous, unknown or none, by evidence of the training frames; held-out frames can only reject."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.fitting import WEIGHT, Fit, Problem
from experiments.discrepancy.hypothesis import Hypothesis, robust_evidence
from experiments.discrepancy.locate import Located

ENOUGH = 10.0  # nats for an effect against nuisances alone, its loudest sections left out
TEMPERATURE = 2.0
"""Evidence is divided by it before it becomes confidence: frames overlap and the noise is only nearly right."""
SURE = 0.9  # share of the probability that names
IN_SET = 0.02  # share from which an alternative is listed
UNEXPLAINED = 0.5  # share of the held-out excess that a named effect must take where the excess is large
LARGE = 1.3  # held-out gap (root mean square) from which that is asked for
FURTHER = 5.0  # nats that each effect after the first must bring beyond its own evidence


@dataclass(frozen=True)
class Judged:
    """A hypothesis with its figures.

    Attributes
    ----------
    evidence : nats against nuisances alone, for what acts everywhere without its loudest sections. held_out : nats on
    held-out frames. probability : among classes. gap : root mean square of the whitened held-out residual.
    """

    hypothesis: Hypothesis
    evidence: float
    held_out: float
    probability: float
    gap: float


@dataclass(frozen=True)
class Decision:
    """What the workflow says."""

    status: str
    judged: tuple[Judged, ...]
    confidence: float
    reason: str

    @property
    def best(self) -> Judged | None:
        """The hypothesis that is added to the model."""
        return self.judged[0] if self.status in ("named", "ambiguous") else None


def rms(problem: Problem, residual: np.ndarray) -> float:
    """Root mean square of a whitened residual (k, f, 2 c) on held-out frames, lost ones not counted."""
    if problem.white is None:
        raise ValueError("state the noise first")
    return float(np.sqrt(problem.white.mean_square(residual, problem.test)))


def held_out_gap(problem: Problem, fit: Fit) -> float:
    """Root mean square of the whitened residual on held-out frames; 1 where only the stated noise is left."""
    return rms(problem, fit.residual)


def judge(problem: Problem, null: Hypothesis, hypotheses: Sequence[Hypothesis]) -> list[Judged]:
    """Figures of every hypothesis, the most probable first."""
    evidence: list[float] = []
    held: list[float] = []
    for one in hypotheses:
        local = any(candidate.speaks_in_places for candidate in one.candidates)
        plain = one.log_evidence - null.log_evidence
        value = plain if local else robust_evidence(problem, one, null)
        evidence.append(value - FURTHER * (len(one.candidates) - 1))
        before = (WEIGHT * null.fit.residual[problem.test]) ** 2
        after = (WEIGHT * one.fit.residual[problem.test]) ** 2
        held.append(0.5 * float(before.sum() - after.sum()))
    best: dict[frozenset[str], float] = {}
    for one, value, outside in zip(hypotheses, evidence, held, strict=True):
        best[one.classes] = max(best.get(one.classes, -math.inf), value if outside > 0.0 else value - ENOUGH)
    top = max([0.0, *best.values()])
    weights = {classes: math.exp((value - top) / TEMPERATURE) for classes, value in best.items()}
    total = sum(weights.values()) + math.exp(-top / TEMPERATURE)
    judged = [
        Judged(one, value, outside, weights[one.classes] / total, held_out_gap(problem, one.fit))
        for one, value, outside in zip(hypotheses, evidence, held, strict=True)
    ]
    return sorted(judged, key=lambda one: (-one.probability, -one.evidence))


def decide(problem: Problem, null: Hypothesis, located: Located, judged: Sequence[Judged]) -> Decision:
    """One of the four verdicts, with the reason in words."""
    gap = held_out_gap(problem, null.fit)
    accepted = [one for one in judged if one.evidence >= ENOUGH and one.held_out > 0.0]
    if not accepted:
        if located.significant:
            text = "the residual is larger than the stated noise, and no effect of the library explains it"
            return Decision("unknown", tuple(judged), _certain(located), text)
        text = "nothing is left that tolerances, sensors and the track file do not explain"
        return Decision("none", tuple(judged), 1.0 - (judged[0].probability if judged else 0.0), text)
    first = accepted[0]
    share = explained(gap, first.gap)
    if first.gap > LARGE and share < UNEXPLAINED:
        text = f"the best effect, {first.hypothesis.label}, explains only {share:.0%} of what is left"
        return Decision("unknown", tuple(judged), _certain(located), text)
    classes = {one.hypothesis.classes for one in accepted if one.probability >= IN_SET}
    if first.probability >= SURE or len(classes) == 1:
        return Decision("named", tuple(accepted), first.probability, "one class of effects explains it best")
    text = "several classes of effects explain it nearly as well"
    return Decision("ambiguous", tuple(accepted), first.probability, text)


def explained(before: float, after: float) -> float:
    """Share of the excess of the mean square over the stated noise that is gone."""
    return (before**2 - after**2) / max(before**2 - 1.0, 1e-9)


def _certain(located: Located) -> float:
    """How sure it is that anything is there at all."""
    return float(min(0.99, 1.0 - math.exp(-0.5 * len(located.significant))))
