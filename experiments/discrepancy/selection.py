"""Selection: effects are added one by one until only noise is left; one that the next makes needless goes again."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.candidates import Candidate
from experiments.discrepancy.decide import ENOUGH, Decision, Judged, decide, held_out_gap, judge
from experiments.discrepancy.fitting import Fit, Problem, fit_nuisances
from experiments.discrepancy.hypothesis import Hypothesis, Tell, fit_candidate, null_evidence, polish
from experiments.discrepancy.locate import Located, locate
from experiments.discrepancy.screening import Screened, screen, shortlist

MOST_EFFECTS = 2
MOST_FITTED = 8
MOST_POLISHED = 3
CLOSE = 60.0  # nats behind the best within which a hypothesis is polished
WHITE = 1.03  # held-out gap from which nothing is left to explain
LOUD = 2.0  # mean square of a cell from which a further effect is looked for all the same
HOPELESS = 0.2  # of the leader's gain
FAIR_CHANCE = 50.0  # nats that a signature may be behind in any case
RIVAL = 30.0  # nats between two classes below which the noise is propagated anew before they are compared


@dataclass(frozen=True)
class Selection:
    """What was chosen.

    Attributes
    ----------
    screened, judged : of the first effect. added : in the order in which they were found; the first is the verdict's.
    decision : on the first, with the last one's fit in mind.
    """

    problem: Problem
    null: Fit
    screened: tuple[Screened, ...]
    judged: tuple[Judged, ...]
    added: tuple[Judged, ...]
    decision: Decision


def select(problem: Problem, null: Fit, located: Located, found: Sequence[Candidate], tell: Tell) -> Selection:
    """One effect after another; a second one only where the first leaves something."""
    screened = screen(problem, null, found, tell)
    problem, null, judged = _rounds(problem, null, screened, tell)
    located = locate(problem, null)
    accepted = [one for one in judged if one.evidence >= ENOUGH and one.held_out > 0.0]
    if not accepted:
        return Selection(problem, null, tuple(screened), tuple(judged), (), decide(problem, null, located, judged))
    added = [accepted[0]]
    while len(added) < MOST_EFFECTS:
        last = added[-1].hypothesis.fit
        left = locate(problem, last)
        if added[-1].gap < WHITE and not any(cell.robust > LOUD for cell in left.significant):
            break
        tell(f"{len(left.significant)} cells still significant: looking for a further effect")
        names = {one.hypothesis.candidate.equivalence for one in added}
        rest = [one for one in found if one.equivalence not in names]
        _, _, more = _rounds(problem, last, screen(problem, last, rest, tell), tell)
        good = [one for one in more if one.evidence >= ENOUGH and one.held_out > 0.0]
        if not good:
            break
        added.append(good[0])
    added = _pruned(problem, null, added, tell)
    decision = decide(problem, null, located, judged, added[-1].gap)
    return Selection(problem, null, tuple(screened), tuple(judged), tuple(added), decision)


def _rounds(problem: Problem, null: Fit, screened: Sequence[Screened], tell: Tell) -> tuple[Problem, Fit, list[Judged]]:
    """Fit the shortlist; where two classes are close, again with the noise propagated through the best."""
    chosen = shortlist(screened)
    null, judged = fit_all(problem, null, chosen, tell)
    if len({one.hypothesis.candidate.equivalence for one in judged}) < 2:
        return problem, null, judged
    best = judged[0]
    others = [one for one in judged if one.hypothesis.candidate.equivalence != best.hypothesis.candidate.equivalence]
    if best.evidence < ENOUGH / 2.0 or best.evidence - max(one.evidence for one in others) > RIVAL:
        return problem, null, judged
    tell("two classes are close: noise propagated through the best of them")
    renewed = problem.with_noise(best.hypothesis.fit.z, best.hypothesis.fit.effects)
    residual = renewed.residual(null.prediction)
    again = Fit(null.z, null.effects, residual, null.columns, renewed.whitened_columns(null.columns), null.prediction)
    near = [one.hypothesis for one in judged if one.evidence > best.evidence - 2.0 * RIVAL][:MOST_POLISHED]
    refitted = [_refit(renewed, again, one, tell) for one in near]
    return renewed, again, judge(renewed, again, null_evidence(renewed, again), [one for one in refitted if one])


def _refit(problem: Problem, null: Fit, one: Hypothesis, tell: Tell) -> Hypothesis | None:
    found = fit_candidate(problem, null, one.candidate, [(one.fit.z, one.values)], tell)
    return polish(problem, null, found, tell) if found else None


def fit_all(problem: Problem, null: Fit, chosen: Sequence[Screened], tell: Tell) -> tuple[Fit, list[Judged]]:
    """The shortlist fitted and judged; and the nuisances alone, fitted again from where the best hypothesis left them:
    what they can do themselves is no evidence for an effect.
    """
    reference = null_evidence(problem, null)
    fitted: list[Hypothesis] = []
    for one in chosen[:MOST_FITTED]:
        if fitted and _hopeless(one, chosen, max(fitted, key=lambda other: other.log_evidence), problem):
            continue
        starts = [(null.z, start_of(one)), (np.zeros_like(null.z), start_of(one))]
        found = fit_candidate(problem, null, one.candidate, starts, tell)
        if found is not None:
            fitted.append(found)
            tell(f"{one.candidate.label}: {found.log_evidence - reference:+.1f} nats")
    fitted.sort(key=lambda one: -one.log_evidence)
    close = [one for one in fitted[:MOST_POLISHED] if one.log_evidence > max(reference, fitted[0].log_evidence - CLOSE)]
    for number, one in enumerate(close):
        fitted[number] = polish(problem, null, one, tell)
        tell(f"{one.candidate.label}, linearised again: {fitted[number].log_evidence - reference:+.1f} nats")
    null = _fair(problem, null, fitted, tell)
    return null, judge(problem, null, null_evidence(problem, null), fitted)


def _fair(problem: Problem, null: Fit, fitted: Sequence[Hypothesis], tell: Tell) -> Fit:
    """The better of two fits of the nuisances alone: the one that there is, and one from the best hypothesis."""
    if not fitted:
        return null
    start = max(fitted, key=lambda one: one.log_evidence).fit.z
    again = fit_nuisances(problem, start, null.effects, rounds=1, tell=tell)
    return again if null_evidence(problem, again) > null_evidence(problem, null) else null


def _hopeless(one: Screened, chosen: Sequence[Screened], best: Hypothesis, problem: Problem) -> bool:
    """Whether a hypothesis that leaves only noise is there already, and this one's signature does far less."""
    leader = max(chosen, key=lambda other: other.gain)
    return held_out_gap(problem, best.fit) < WHITE and one.gain < HOPELESS * leader.gain - FAIR_CHANCE


def start_of(screened: Screened) -> dict[str, float]:
    """Where the fit begins: the screened size, scaled."""
    free = screened.candidate.parameters
    values = dict(screened.values)
    for name, parameter in free.items():
        if parameter.absent is not None:
            moved = parameter.absent + screened.scale * (values[name] - parameter.absent)
            values[name] = float(np.clip(moved, parameter.low, parameter.high))
    return values


def _pruned(problem: Problem, null: Fit, added: list[Judged], tell: Tell) -> list[Judged]:
    """Without the first of two where the second alone does as well."""
    if len(added) < 2:
        return added
    first, second = added
    alone = fit_candidate(
        problem, null, second.hypothesis.candidate, [(second.hypothesis.fit.z, second.hypothesis.values)], tell
    )
    if alone is None or alone.log_evidence < second.hypothesis.log_evidence - ENOUGH:
        return added
    tell(f"{first.hypothesis.candidate.label} is not needed beside {second.hypothesis.candidate.label}")
    return judge(problem, null, null_evidence(problem, null), [alone])
