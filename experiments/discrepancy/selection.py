"""Selection: shortlisted effects are fitted with all nuisances; a second one joins where the first leaves something."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.candidates import Candidate
from experiments.discrepancy.decide import ENOUGH, Decision, Judged, decide, held_out_gap, judge
from experiments.discrepancy.fitting import Problem, improved, linearised, moved_to, restarted, starting_fit
from experiments.discrepancy.hypothesis import Hypothesis, Tell, again, concluded, hypothesis
from experiments.discrepancy.locate import Located, locate
from experiments.discrepancy.screening import Screened, best_of, screen, shortlist
from railsim.errors import InputError

PROMISING = 4.0  # nats that a signature must gain to be fitted
WORTH_FITTING = 5.0  # the same without its loudest sections, where nothing in the residual is significant
WHITE = 1.03  # held-out gap from which nothing is left to explain
LOUD = 2.0  # mean square of a cell from which a further effect is looked for all the same
HOPELESS = 0.2  # of the leader's gain
NEGLIGIBLE = 0.03  # of the leader's gain
FAIR_CHANCE = 50.0  # nats that a signature may be behind in any case
RIVAL = 30.0  # nats between two classes below which the noise is propagated anew before they are compared
POLISHED = 2  # classes whose best hypothesis is linearised anew where it leaves something
FAR_BEHIND = 300.0  # nats behind the best from which a class is not linearised anew,
OUT_OF_REACH = 0.3  # or this share of what the best brings, if that is more
ROUNDS = 2
RESTARTS = 3
BUDGET = {"fit": 200.0, "linearise": 260.0, "law": 300.0, "further": 330.0, "end": 420.0}
"""Runs of the model after which a stage is not begun any more; what was not tried is said in the verdict."""
WORTH = 3.0  # nats that a further linearisation must have brought to go on
LAWS = ("polach", "fastsim")  # creep laws that are tried where something is left
LAW_REACH = 300.0  # nats behind the best within which others are fitted with another law too
SECONDS = 4  # further effects that are fitted beside the first
SWAPPED = 2  # other first effects that are tried beside the best second one


@dataclass(frozen=True)
class Selection:
    """What was chosen.

    Attributes
    ----------
    null : nuisances alone. screened : signatures beside them. judged : all hypotheses, the most probable first.
    not_tried : what there was no time for.
    """

    problem: Problem
    null: Hypothesis
    screened: tuple[Screened, ...]
    judged: tuple[Judged, ...]
    decision: Decision
    not_tried: tuple[str, ...] = ()


def select(problem: Problem, null: Hypothesis, located: Located, found: Sequence[Candidate], tell: Tell) -> Selection:
    """One effect, or two where one leaves something; each of two goes where the other alone does as well."""
    left_out: list[str] = []
    tell = _noting(tell, left_out)
    screened = screen(problem, null.fit, found, tell)
    alone = decide(problem, null, located, [])
    strongest = max((one.robust for one in screened), default=0.0)
    if max((one.gain for one in screened), default=0.0) < PROMISING or (
        strongest < WORTH_FITTING and not located.significant
    ):
        return Selection(problem, null, tuple(screened), (), alone)
    fitted = _fitted(problem, null, shortlist(screened), tell)
    null = _fair(problem, null, fitted, tell)
    judged = judge(problem, null, fitted)
    best = judged[0].hypothesis if judged and judged[0].evidence >= ENOUGH else null
    if _something_left(problem, best) and _time_for(problem, "law", "another creep law", tell):
        problem, null, fitted = _other_law(problem, null, best, judged, tell)
        judged = judge(problem, null, fitted)
    if _close(judged):
        tell("two classes are close: noise propagated through the best of them")
        best = judged[0].hypothesis.fit
        problem = problem.with_noise(best.z, best.effects)
        null = again(problem, null, tell)
        near = [one.hypothesis for one in judged if one.evidence > judged[0].evidence - 2.0 * RIVAL]
        fitted = [again(problem, one, tell) for one in near]
        judged = judge(problem, null, fitted)
    if (
        judged
        and judged[0].evidence >= ENOUGH
        and _something_left(problem, judged[0].hypothesis)
        and _time_for(problem, "further", "a further effect", tell)
    ):
        fitted += _pairs(problem, judged, found, tell)
        judged = judge(problem, null, fitted)
    located = locate(problem, null.fit)
    decision = decide(problem, null, located, judged)
    return Selection(problem, null, tuple(screened), tuple(judged), decision, tuple(dict.fromkeys(left_out)))


NOT_TRIED = "no time for "


def _noting(tell: Tell, left_out: list[str]) -> Tell:
    """`tell` that keeps what there was no time for."""

    def both(text: str) -> None:
        if text.startswith(NOT_TRIED):
            left_out.append(text.removeprefix(NOT_TRIED))
        tell(text)

    return both


def _time_for(problem: Problem, stage: str, what: str, tell: Tell) -> bool:
    """Whether the budget lets a stage begin; else says so."""
    there = problem.forward.meter.spent < BUDGET[stage]
    if not there:
        tell(NOT_TRIED + what)
    return there


def _fitted(problem: Problem, null: Hypothesis, chosen: Sequence[Screened], tell: Tell) -> list[Hypothesis]:
    """The shortlist, but for those that have no chance beside one that leaves only noise."""
    fitted: list[Hypothesis] = []
    for one in chosen:
        if one.gain < PROMISING or (fitted and not _time_for(problem, "fit", one.candidate.label, tell)):
            continue
        if fitted and _hopeless(one, chosen, max(fitted, key=lambda other: other.log_evidence), problem):
            continue
        starts = [(one.z, [one.values]), (null.fit.z, [one.values]), (one.z, [one.tried])]
        made = hypothesis(problem, null.fit, (one.candidate,), starts, tell)
        if made is not None:
            fitted.append(made)
            tell(f"{made.label}: {made.log_evidence - null.log_evidence:+.1f} nats")
    order = sorted(fitted, key=lambda one: -one.log_evidence)
    behind = max(FAR_BEHIND, OUT_OF_REACH * (order[0].log_evidence - null.log_evidence)) if order else 0.0
    order = [one for one in order if one.log_evidence > order[0].log_evidence - behind]
    for one in [leader_of(order, place) for place in range(POLISHED)]:
        if one is not None and held_out_gap(problem, one.fit) > WHITE:
            better = polished(problem, one, tell)
            fitted = [better if other is one else other for other in fitted]
    return fitted


def _other_law(
    problem: Problem, null: Hypothesis, first: Hypothesis, judged: Sequence[Judged], tell: Tell
) -> tuple[Problem, Hypothesis, list[Hypothesis]]:
    """With the creep law that explains what the best one leaves, where one does: which law holds is a nuisance."""
    fitted = [one.hypothesis for one in judged]
    for name in other_laws(problem):
        other = problem.but(forward=problem.forward.but(law=name))
        best = under(other, first, tell)
        if best is not None and held_out_gap(other, best.fit) > WHITE:
            best = polished(other, best, tell)
        if best is None or best.log_evidence < first.log_evidence + ENOUGH:
            continue
        tell(f"creep law {name}: {best.log_evidence - first.log_evidence:+.1f} nats")
        near = [one for one in fitted if one is not first and one.log_evidence > first.log_evidence - LAW_REACH]
        rest = [one for one in (under(other, one, tell) for one in near) if one is not None]
        if first is null:
            return other, best, rest
        alone = under(other, null, tell)
        if alone is not None:
            return other, alone, [best, *rest]
    return problem, null, fitted


def other_laws(problem: Problem) -> list[str]:
    """Creep laws that the vehicle's could be taken for."""
    law = problem.forward.law or getattr(getattr(problem.evidence.scenario.vehicle, "adhesion", None), "law", "")
    return [name for name in LAWS if law in LAWS and name != law]


def under(problem: Problem, one: Hypothesis, tell: Tell) -> Hypothesis | None:
    """A hypothesis fitted on under another problem; None where the model does not run."""
    try:
        return concluded(problem, improved(problem, moved_to(problem, one.fit), tell))
    except InputError as error:
        tell(f"{one.label}: {error}")
        return None


def leader_of(order: Sequence[Hypothesis], place: int) -> Hypothesis | None:
    """The best hypothesis of the class that is so far down."""
    best: dict[frozenset[str], Hypothesis] = {}
    for one in order:
        best.setdefault(one.classes, one)
    found = list(best.values())
    return found[place] if place < len(found) else None


def polished(problem: Problem, one: Hypothesis, tell: Tell) -> Hypothesis:
    """With derivatives made anew at the hypothesis itself, as long as that brings something."""
    for _ in range(ROUNDS):
        if not _time_for(problem, "linearise", f"derivatives at {one.label}", tell):
            break
        better = concluded(problem, improved(problem, linearised(problem, one.fit), tell))
        gain = better.log_evidence - one.log_evidence
        tell(f"{one.label}, linearised again: {gain:+.1f} nats")
        one = better if gain > 0.0 else one
        if gain < WORTH:
            break
    return one


def _hopeless(one: Screened, chosen: Sequence[Screened], best: Hypothesis, problem: Problem) -> bool:
    """Whether a hypothesis that leaves only noise is there already and this one's signature does far less, or next to
    nothing beside one that takes much.
    """
    leader = max(other.gain for other in chosen)
    if one.gain < NEGLIGIBLE * leader - FAIR_CHANCE:
        return True
    return held_out_gap(problem, best.fit) < WHITE and one.gain < HOPELESS * leader - FAIR_CHANCE


def _fair(problem: Problem, null: Hypothesis, fitted: Sequence[Hypothesis], tell: Tell) -> Hypothesis:
    """The better of two fits of the nuisances alone: the one that there is, and one from the best hypothesis; what
    they can do themselves is no evidence for an effect.
    """
    if not fitted:
        return null
    best = max(fitted, key=lambda one: one.log_evidence)
    other = concluded(problem, improved(problem, restarted(problem, best.fit, best.fit.z), tell))
    better = max(null, other, key=lambda one: one.log_evidence)
    return polished(problem, better, tell) if held_out_gap(problem, better.fit) > WHITE else better


def _close(judged: Sequence[Judged]) -> bool:
    if not judged or judged[0].evidence < ENOUGH / 2.0:
        return False
    others = [one for one in judged if one.hypothesis.classes != judged[0].hypothesis.classes]
    return any(judged[0].evidence - one.evidence < RIVAL for one in others)


def _something_left(problem: Problem, best: Hypothesis) -> bool:
    left = locate(problem, best.fit).significant
    return bool(left) and (held_out_gap(problem, best.fit) > WHITE or any(cell.robust > LOUD for cell in left))


def _pairs(problem: Problem, judged: Sequence[Judged], found: Sequence[Candidate], tell: Tell) -> list[Hypothesis]:
    """The best effect with each of the most promising others, the best of these with other first effects, and alone."""
    first = judged[0].hypothesis
    rest = [one for one in found if one.equivalence not in first.classes]
    tell(f"something is left beside {first.label}: looking for a further effect")
    seconds = [one for one in best_of(screen(problem, first.fit, rest, tell)) if one.gain > PROMISING]
    names: dict[str, Screened] = {}
    for one in seconds:
        names.setdefault(one.candidate.name, one)
    made = [
        _paired(problem, first, one, tell)
        for one in list(names.values())[:SECONDS]
        if _time_for(problem, "end", f"{first.label} with {one.candidate.label}", tell)
    ]
    pairs = [one for one in made if one is not None]
    if not pairs:
        return []
    best = max(pairs, key=lambda one: one.log_evidence)
    second, values = best.candidates[1], best.values[1]
    tell(f"{best.label}: {best.log_evidence - first.log_evidence:+.1f} nats more")
    others: list[Hypothesis] = []
    for one in judged[1:]:
        classes = {*best.classes, *(other.candidate.equivalence for other in others)}
        if problem.forward.meter.spent > BUDGET["end"]:
            break
        if len(others) < SWAPPED and one.hypothesis.candidate.equivalence not in classes:
            both = (one.hypothesis.candidate, second)
            starts = [(one.hypothesis.fit.z, [one.hypothesis.values[0], values])]
            swapped = hypothesis(problem, one.hypothesis.fit, both, starts, tell)
            others += [swapped] if swapped is not None else []
    alone = hypothesis(problem, best.fit, (second,), [(best.fit.z, [values])], tell)
    return [*pairs, *others, *([alone] if alone is not None else [])]


def _paired(problem: Problem, first: Hypothesis, one: Screened, tell: Tell) -> Hypothesis | None:
    starts = [(z, [first.values[0], one.values]) for z in (one.z, first.fit.z)]
    return hypothesis(problem, first.fit, (first.candidate, one.candidate), starts, tell)


def nuisances_alone(problem: Problem, z: np.ndarray, tell: Tell) -> Hypothesis:
    """The fit that all others are compared with."""
    return concluded(problem, improved(problem, starting_fit(problem, z), tell))


def unbiased(problem: Problem, null: Hypothesis, tell: Tell) -> Hypothesis:
    """Nuisances alone, fitted on with the bank's derivatives as long as that brings something: what a fit's steps have
    taught its derivatives on a long way can hold it up.
    """
    for _ in range(RESTARTS):
        better = nuisances_alone(problem, null.fit.z, tell)
        gain = better.log_evidence - null.log_evidence
        null = better if gain > 0.0 else null
        if gain < WORTH:
            break
    return null
