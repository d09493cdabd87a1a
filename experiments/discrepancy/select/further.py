"""Further effects: a second one beside the first, and each of two by itself."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from experiments.discrepancy.fit.candidates import Candidate
from experiments.discrepancy.fit.fitting import Fit, Problem, starting_fit, with_candidates
from experiments.discrepancy.fit.hypothesis import Hypothesis, hypothesis
from experiments.discrepancy.progress import Progress
from experiments.discrepancy.screen.kin import kin, of_classes
from experiments.discrepancy.screen.locate import locate
from experiments.discrepancy.screen.renewing import PROMISING, renewed
from experiments.discrepancy.screen.screening import Screened, best_of, screen
from experiments.discrepancy.select.decide import LARGE, held_out_gap
from experiments.discrepancy.select.refining import something_left, time_for
from experiments.discrepancy.select.stand import Stand
from experiments.discrepancy.select.starts import all_sizes, at_home
from railsim.errors import InputError

GLANCE = 8.0  # nats that a signature must gain without its loudest sections, where no cell is significant
SECONDS = {False: 4, True: 2}  # further effects that are fitted beside the first: everywhere, in places
FIRSTS = 3  # effects beside which a second one is looked for


def with_further(stand: Stand, found: Sequence[Candidate], progress: Progress) -> Stand:
    """With a second effect beside the best, where one is promising: of all where something is left, else of those
    that are quickly looked at; where the best needs nuisances far from their data sheets those too that look like them.
    What is left then may be so because the best is not even half of it, so others that take much by themselves, borne
    out or not, are tried as the first of two as well.
    """
    if stand.best is stand.null:
        return stand
    pairs: list[Hypothesis] = []
    for first in _firsts(stand):
        if not time_for(stand.problem, "further", f"a further effect beside {first.label}", progress):
            break
        rest = [one for one in found if one.equivalence not in first.classes and (stand.unexplained or not one.local)]
        base = _base(stand.problem, first)
        screened = screen(stand.problem, base, rest, progress)
        if base is first.fit:
            screened = renewed(stand.problem, base, screened)
        screened = best_of(screened)
        loud = PROMISING if stand.unexplained else GLANCE
        seconds = [one for one in screened if (one.gain if stand.unexplained else one.robust) > loud]
        chosen = [*_first_of(seconds, False), *_first_of(seconds, True)]
        if chosen:
            progress(f"beside {first.label}: {', '.join(one.candidate.label for one in chosen)}")
        for one in chosen:
            if time_for(stand.problem, "end", f"{first.label} with {one.candidate.label}", progress):
                made = _paired(stand.problem, first, base, one, progress)
                pairs += [made] if made is not None else []
        if first is stand.best and stand.far:
            tried = {one.candidate.label for one in chosen}
            others = [one for one in screened if one.candidate.label not in tried]
            pairs += _eased(stand.problem, first, others, progress)
        if pairs and not something_left(stand.problem, max(pairs, key=lambda one: one.log_evidence)):
            break
    return replace(stand, fitted=[*stand.fitted, *pairs, *_each_alone(stand, pairs, progress)])


def _firsts(stand: Stand) -> list[Hypothesis]:
    """The best, and where it leaves something those that take most by themselves; each class once."""
    ordered = sorted(stand.fitted, key=lambda one: -one.log_evidence) if stand.unexplained else []
    firsts = {one.classes: one for one in reversed(ordered) if one.log_evidence > stand.null.log_evidence}
    others = [one for one in reversed(firsts.values()) if one.classes != stand.best.classes]
    return [stand.best, *sorted(others, key=lambda one: -one.log_evidence)][:FIRSTS]


def _each_alone(stand: Stand, pairs: Sequence[Hypothesis], progress: Progress) -> list[Hypothesis]:
    """Each effect of the best pair by itself, from where the pair is: what one of two does with nuisances that were
    fitted further is no evidence for the other.
    """
    if not pairs:
        return []
    best = max(pairs, key=lambda one: one.log_evidence)
    progress(f"{best.label}: {best.log_evidence - stand.best.log_evidence:+.1f} nats more")
    both = zip(best.candidates, best.values, strict=True)
    alone = [hypothesis(stand.problem, best.fit, (one,), [(best.fit.z, [values])], progress) for one, values in both]
    return [one for one in alone if one is not None]


def _first_of(screened: Sequence[Screened], in_places: bool) -> list[Screened]:
    """The best of the effects that act everywhere, or of those that speak in places, each name once."""
    names: dict[str, Screened] = {}
    for one in screened:
        if one.candidate.speaks_in_places == in_places:
            names.setdefault(one.candidate.name, one)
    return list(names.values())[: SECONDS[in_places]]


def _base(problem: Problem, first: Hypothesis) -> Fit:
    """Where a further effect is looked for: at the first one, with the nominal build where much is left."""
    if held_out_gap(problem, first.fit) < LARGE:
        return first.fit
    home = starting_fit(problem, at_home(problem, first.fit))
    try:
        return with_candidates(problem, home, first.candidates, [(home.z, first.fit.shares)])
    except InputError:
        return first.fit


def _eased(problem: Problem, first: Hypothesis, screened: Sequence[Screened], progress: Progress) -> list[Hypothesis]:
    """The first with each effect that looks like one of its strained nuisances, and the others of their classes; those
    nuisances begin at their data sheets.
    """
    located = locate(problem, first.fit)
    strained = [one.label in located.surprising for one in problem.forward.nuisances]
    z = np.where(strained, 0.0, first.fit.z)
    pairs: list[Hypothesis] = []
    liked = list({one.candidate.name: one for one in reversed(kin(problem, located, screened))}.values())
    classes = {one.candidate.equivalence for one in liked if not one.candidate.of_sensor}
    for one in (*liked, *of_classes(classes, screened, {one.candidate.name for one in liked})):
        if time_for(problem, "end", f"{first.label} with {one.candidate.label}", progress):
            starts = [(z, [first.values[0], values]) for values in all_sizes(one)]
            made = hypothesis(problem, first.fit, (first.candidate, one.candidate), starts, progress)
            pairs += [made] if made is not None else []
    return pairs


def _paired(problem: Problem, first: Hypothesis, base: Fit, one: Screened, progress: Progress) -> Hypothesis | None:
    starts = [(z, [first.values[0], one.values]) for z in (one.z, first.fit.z)]
    if base is not first.fit:
        starts.append((base.z, [first.values[0], one.values]))
    return hypothesis(problem, base, (first.candidate, one.candidate), starts, progress)
