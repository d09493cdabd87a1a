"""Decide: named, ambiguous, unknown or none, by evidence of the training frames; held-out frames can only reject."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from experiments.discrepancy.baseline.frames import REDUNDANCY
from experiments.discrepancy.fit.candidates import Candidate
from experiments.discrepancy.fit.fitting import Fit, Problem, lost_within
from experiments.discrepancy.fit.hypothesis import Hypothesis, robust_evidence
from experiments.discrepancy.fit.products import WEIGHT
from experiments.discrepancy.screen.locate import Cell, Located, Spot, locate
from experiments.discrepancy.screen.places import distance_at

ENOUGH = 10.0  # nats for an effect against nuisances alone, its loudest sections left out
TEMPERATURE = 2.0
"""Evidence is divided by it before it becomes confidence: frames overlap and the noise is only nearly right."""
SURE = 0.9  # share of the probability that names
IN_SET = 0.02  # share from which an alternative is listed
UNEXPLAINED = 0.6  # share of the excess in significant cells that a named effect must take
LARGE = 1.3  # held-out gap (root mean square) from which nuisances alone are far from the truth
FURTHER = 5.0  # nats that a second effect costs
COARSE = 0.005  # share of what an effect brings that the model itself may be wrong by
SMALL_BUT_THERE = 60.0  # nats of an effect too small for its name, from which something else is there
HELPED = 0.001  # share of what an effect brings that nuisances far from their data sheets may add to it
BORNE_OUT = 0.2  # of the training frames' evidence, frame for frame, that held-out frames must show
HARMLESS = 3.0  # nats that an effect of a place that held-out frames do not see at all may cost there
SUREST = {"none": 0.99, "named": 0.92, "unknown": 0.86}
"""Confidence that is stated at most: of so many blind verdicts that were as sure as can be (963, 255, 73) so many were
true (docs/benchmarks, seeds 22, 24 and 25)."""
CLEARLY = 20.0  # nats by which a tabled law must be ahead of a named effect, and as coarse a share as above


@dataclass(frozen=True)
class Judged:
    """A hypothesis with its figures.

    Attributes
    ----------
    evidence : nats against nuisances alone, for what acts everywhere without its loudest sections. standing : nats by
    which it is compared with others, with all sections where its evidence is enough. held_out : nats on held-out
    frames. borne_out : whether these bear it out. slight : whether it is too small for its name. probability : among
    classes. gap : root mean square of the whitened held-out residual.
    """

    hypothesis: Hypothesis
    evidence: float
    standing: float
    held_out: float
    borne_out: bool
    slight: bool
    probability: float
    gap: float

    @property
    def in_question(self) -> bool:
        """Whether it may get a name, if its evidence is enough."""
        return self.borne_out and not self.slight


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
    """Figures of every hypothesis, the most probable first; what held-out frames do not bear out loses `ENOUGH`.

    The loudest sections do not let an effect in that acts everywhere; between effects that are in they count for each.
    """
    figures = [_figures(problem, null, one, hypotheses) for one in hypotheses]
    best: dict[frozenset[str], float] = {}
    for one, own in zip(hypotheses, figures, strict=True):
        best[one.classes] = max(best.get(one.classes, -math.inf), own.standing)
    top = max([0.0, *best.values()])
    weights = {classes: math.exp((value - top) / TEMPERATURE) for classes, value in best.items()}
    total = sum(weights.values()) + math.exp(-top / TEMPERATURE)
    judged = [
        Judged(
            one,
            own.evidence,
            own.standing,
            own.held_out,
            own.borne_out,
            one.slight,
            weights[one.classes] / total,
            held_out_gap(problem, one.fit),
        )
        for one, own in zip(hypotheses, figures, strict=True)
    ]
    return sorted(judged, key=lambda one: (-one.probability, not one.in_question, -one.standing))


class _Figures(NamedTuple):
    """Those of `Judged`, and the part of its evidence that only held-out sections see [nats]."""

    evidence: float
    standing: float
    held_out: float
    borne_out: bool
    unseen: float


def _figures(problem: Problem, null: Hypothesis, one: Hypothesis, others: Sequence[Hypothesis]) -> _Figures:
    """Figures against nuisances alone.

    A further effect is held against the best of the hypotheses that go without one of the two.
    """
    alone = max(
        (other for other in others if other.classes < one.classes), key=lambda other: other.log_evidence, default=None
    )
    before = alone or null
    further = [other for other in one.candidates if other.equivalence not in before.classes]
    gain = _evidence(problem, before, one, further)
    outside = _held_out(problem, before, one)
    asked = BORNE_OUT * _share_held_out(problem) * max(0.0, gain)
    if all(other.local for other in further):
        there = _seen_held_out(problem, before, one)
        asked = there * asked - (1.0 - there) * HARMLESS
    borne_out = outside > asked
    unseen, cost = 0.0, 0.0
    if further and all(other.local for other in further):  # what is in a held-out section is seen there only
        unseen = max(0.0, outside - _share_held_out(problem) * max(0.0, gain))
        gain += unseen
    if alone is not None:
        first = _figures(problem, null, alone, others)
        borne_out = borne_out and gain > ENOUGH + min(COARSE * max(0.0, first.evidence), excess(problem, alone))
        gain, outside = first.evidence + gain - FURTHER, first.held_out + outside
        unseen, cost = unseen + first.unseen, FURTHER
    whole = one.log_evidence - null.log_evidence + unseen - cost
    standing = min(gain, 0.0) - ENOUGH if one.slight or not borne_out else whole if gain >= ENOUGH else gain
    return _Figures(gain, standing, outside, borne_out, unseen)


def excess(problem: Problem, one: Hypothesis) -> float:
    """Nats that a hypothesis leaves over the stated noise on training frames."""
    heard = problem.white.good[problem.train].sum() * 2 * one.fit.residual.shape[1] if problem.white else 0
    left = 0.5 * float(np.sum((WEIGHT * one.fit.residual[problem.train]) ** 2))
    return max(0.0, left - 0.5 * float(heard) / REDUNDANCY)


def _evidence(problem: Problem, before: Hypothesis, one: Hypothesis, further: Sequence[Candidate]) -> float:
    """Nats against another hypothesis; of what acts everywhere without its loudest sections."""
    if any(candidate.speaks_in_places for candidate in further):
        return one.log_evidence - before.log_evidence
    return robust_evidence(problem, one, before)


def _held_out(problem: Problem, null: Hypothesis, one: Hypothesis) -> float:
    """Nats on held-out frames."""
    before = (WEIGHT * null.fit.residual[problem.test]) ** 2
    after = (WEIGHT * one.fit.residual[problem.test]) ** 2
    return 0.5 * float(before.sum() - after.sum())


def _seen_held_out(problem: Problem, before: Hypothesis, one: Hypothesis) -> float:
    """How much of a hypothesis held-out frames see, frame for frame, of what those see that train: none to all."""
    change = ((WEIGHT * (one.fit.residual - before.fit.residual)) ** 2).sum(axis=(1, 2))
    trained = _share_held_out(problem) * float(change[problem.train].sum())
    return min(1.0, float(change[problem.test].sum()) / max(trained, 1e-12))


def _share_held_out(problem: Problem) -> float:
    """Held-out frames for each that trains."""
    return float(problem.test.sum() / max(problem.train.sum(), 1))


def decide(problem: Problem, null: Hypothesis, located: Located, judged: Sequence[Judged]) -> Decision:
    """One of the four verdicts, with the reason in words; `located`: of nuisances alone."""
    accepted = [one for one in judged if one.evidence >= ENOUGH and one.in_question]
    if not accepted:
        if located.significant:
            text = "the residual is larger than the stated noise, and no effect of the library explains it"
            return Decision("unknown", tuple(judged), _certain(located), text)
        if needs_far(problem, null, located, 0.0):
            names = ", ".join(located.surprising)
            text = f"only tolerances far from their data sheets explain it ({names}), and no effect of the library does"
            return Decision("unknown", tuple(judged), _certain(located), text)
        small = next((one for one in judged if _stands_for_another(problem, one)), None)
        if small is not None:
            text = f"{small.hypothesis.label} brings {small.evidence:.0f} nats at a size that is too small for its name"
            return Decision("unknown", tuple(judged), _certain_by(small.evidence), text)
        spot = located.spot
        if spot.alone:
            at = float(distance_at(problem, problem.frames.middles)[spot.frame])
            band = f"{spot.low:g} to {spot.high:g} Hz"
            text = f"{_plain(spot)} stands out near {at:.0f} m, {band}, and no effect explains it"
            return Decision("unknown", tuple(judged), _certain_by(spot.nats), text)
        text = "nothing is left that tolerances, sensors and the track file do not explain"
        return Decision(
            "none", tuple(judged), min(SUREST["none"], 1.0 - (judged[0].probability if judged else 0.0)), text
        )
    first = accepted[0]
    refused = _refused(problem, located, first)
    if refused:
        sure = max(_certain(located), _certain_by(first.evidence))
        return Decision("unknown", tuple(judged), sure, f"the best effect, {first.hypothesis.label}, {refused}")
    classes = {one.hypothesis.classes for one in accepted if one.probability >= IN_SET}
    if first.probability >= SURE or len(classes) == 1:
        sure = min(SUREST["named"], first.probability)
        return Decision("named", tuple(accepted), sure, "one class of effects explains it best")
    text = "several classes of effects explain it nearly as well"
    return Decision("ambiguous", tuple(accepted), first.probability, text)


def _refused(problem: Problem, located: Located, first: Judged) -> str:
    """Why the best effect gets no name, nothing where it does."""
    left = locate(problem, first.hypothesis.fit)
    share = _share_gone(located, left)
    if share < UNEXPLAINED:
        return f"explains only {share:.0%} of what is left"
    if first.gap > LARGE:
        return f"leaves {first.gap:.2g} times the noise on held-out sections"
    if needs_far(problem, first.hypothesis, left, first.evidence):
        return f"explains it only with tolerances far from their data sheets ({', '.join(left.surprising)})"
    cell = _strange(first.hypothesis, left)
    if cell is None:
        return ""
    return f"leaves {cell.robust:.2g} times the noise's power in {_plain(cell)}, {cell.low:g} to {cell.high:g} Hz"


def _stands_for_another(problem: Problem, one: Judged) -> bool:
    """Whether an effect brings much at a size that is not worth its name, and held-out frames show it, of a local one
    as well.
    """
    there = one.held_out > BORNE_OUT * _share_held_out(problem) * one.evidence
    return one.slight and one.evidence >= SMALL_BUT_THERE and there


def _strange(one: Hypothesis, left: Located) -> Cell | None:
    """The loudest cell that what is there would not leave: one of its own channel where a sensor is at fault, of which
    the model is exact.
    """
    own = {each.channel for each in one.candidates if each.of_sensor}
    return next((cell for cell in left.loud if _plain(cell) in own), None)


def _plain(cell: Cell | Spot) -> str:
    """Its channel without the unit."""
    return cell.channel.split(" [")[0]


def needs_far(problem: Problem, one: Hypothesis, left: Located, gain: float) -> bool:
    """Whether a hypothesis that leaves this and brings so many nats holds with nuisances far from their data sheets
    only: with all of them within it would lose more than chance. One is enough beside an effect, which is then helped
    by what it is not; a thousandth of what that brings is what the model itself bends them by.
    """
    far = left.far or bool(one.candidates and left.surprising)
    return far and lost_within(problem, one.fit) > max(ENOUGH, HELPED * gain)


def contested(problem: Problem, decision: Decision, null: Hypothesis, law: Hypothesis) -> Decision:
    """The verdict when a tabled law without a name was fitted too: it takes the name away from an effect that explains
    clearly less, and what it explains is something where there seemed to be nothing, if held-out frames bear it out.
    """
    if decision.best is None:
        gain = law.log_evidence - null.log_evidence
        borne_out = _held_out(problem, null, law) > BORNE_OUT * _share_held_out(problem) * gain
        if decision.status != "none" or not ahead(null, null, law) or not borne_out:
            return decision
        text = f"a force that follows the state at one place explains it better by {gain:.0f} nats, and no effect does"
        return Decision("unknown", decision.judged, _certain_by(gain), text)
    named = decision.best.hypothesis
    if not ahead(null, named, law):
        return decision
    nats = law.log_evidence - named.log_evidence
    text = f"a law that follows the state at one place explains it better than {named.label}, by {nats:.0f} nats"
    return Decision("unknown", decision.judged, _certain_by(nats), text)


def ahead(null: Hypothesis, named: Hypothesis, law: Hypothesis) -> bool:
    """Whether a tabled law is clearly better than an effect of the library."""
    gain = max(0.0, named.log_evidence - null.log_evidence)
    return law.log_evidence > named.log_evidence + CLEARLY + COARSE * gain


def _share_gone(located: Located, left: Located) -> float:
    """Share of the excess in the significant cells that is gone of what an effect leaves; one where there are none."""
    before = {(one.channel, one.low): one for one in located.significant}
    if not before:
        return 1.0
    after = {(one.channel, one.low): one for one in left.cells}
    there = sum(_excess(one) for one in before.values())
    rest = sum(_excess(after[key]) for key in before)
    return 1.0 - rest / max(there, 1e-9)


def _excess(cell: Cell) -> float:
    return max(0.0, cell.power - 1.0) * (cell.high - cell.low)


def _certain_by(nats: float) -> float:
    """How sure it is by what it brings."""
    return min(SUREST["unknown"], 1.0 - math.exp(-nats / (2.0 * CLEARLY)))


def _certain(located: Located) -> float:
    """How sure it is that anything is there at all."""
    return float(min(SUREST["unknown"], 1.0 - math.exp(-0.5 * (len(located.significant) + len(located.surprising)))))
