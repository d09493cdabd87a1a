"""Selection: shortlisted effects are fitted with all nuisances; a second one joins where the first leaves something."""

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from experiments.discrepancy.fit.candidates import Candidate
from experiments.discrepancy.fit.fitting import Fit, Problem, improved, moved_to, restarted, starting_fit
from experiments.discrepancy.fit.hypothesis import Hypothesis, again, concluded, hypothesis
from experiments.discrepancy.progress import Progress
from experiments.discrepancy.screen.kin import kin, like_law, of_classes
from experiments.discrepancy.screen.latent import LatentForce
from experiments.discrepancy.screen.locate import Located, locate
from experiments.discrepancy.screen.renewing import PROMISING, renewed
from experiments.discrepancy.screen.screening import Screened, scaled, screen, shortlist
from experiments.discrepancy.select.decide import ENOUGH, LARGE, Decision, Judged, decide, held_out_gap
from experiments.discrepancy.select.empirical import fit_empirical, follows_a_state
from experiments.discrepancy.select.further import FIRSTS, GLANCE, with_further
from experiments.discrepancy.select.masked import unmasked
from experiments.discrepancy.select.moving import everywhere, moved, shown_held_out
from experiments.discrepancy.select.passing import with_passing
from experiments.discrepancy.select.refining import (
    WHITE,
    noting,
    other_laws,
    polished,
    something_left,
    time_for,
    under,
    with_noise_of,
    with_own_numbers,
)
from experiments.discrepancy.select.rivals import with_noise_of_likeliest, with_rivals_refined
from experiments.discrepancy.select.stand import FAR_BEHIND, OUT_OF_REACH, Stand
from experiments.discrepancy.select.starts import all_sizes, at_home, elsewhere, stretched

WORTH_FITTING = 5.0  # the same without its loudest sections, where nothing in the residual is significant
HOPELESS = 0.2  # of the leader's gain
NEGLIGIBLE = 0.03  # of the leader's gain
FAIR_CHANCE = 50.0  # nats that a signature may be behind in any case
WEAK = 60.0  # nats of the best effect below which nuisances alone get derivatives of their own
RIVAL = 30.0  # nats between two classes below which the noise is propagated anew before they are compared
VARIANTS = 3  # other places of the best effect that are fitted too
NEAREST = 4  # classes that are fitted on with the noise of the best
HALF_SEEN = 0.75  # of the next, where the derivatives by the nuisances are still the nominal vehicle's
HARDLY_BENT = 30.0  # nats that new derivatives bring nuisances alone, up to which old ones hid no effect from screening
FAINT_PAIR = 500.0  # nats that two effects bring together, below which one law may be what they stand for
KEPT_PROMISE = 0.3  # of what a signature promised, below which a fit is begun elsewhere
SLIGHT = 0.1  # of the size at which it looks best, from where a fit sets out once more that ended behind the nuisances


@dataclass(frozen=True)
class Selection:
    """What was chosen.

    Attributes
    ----------
    null : nuisances alone. screened : signatures beside them. judged : all hypotheses, the most probable first.
    tabled : a law without a name and where it acts, where effects leave something. not_tried : what there was no time
    for.
    """

    problem: Problem
    null: Hypothesis
    screened: tuple[Screened, ...]
    judged: tuple[Judged, ...]
    decision: Decision
    tabled: tuple[Hypothesis, LatentForce] | None = None
    not_tried: tuple[str, ...] = ()


def select(
    problem: Problem, null: Hypothesis, located: Located, found: Sequence[Candidate], progress: Progress
) -> Selection:
    """One effect, or two where one leaves something; each of two goes where the other alone does as well."""
    left_out: list[str] = []
    progress = noting(progress, left_out)
    null, screened, located = _looked_at(problem, null, located, found, progress)
    bent = located.bent or held_out_gap(problem, null.fit) > LARGE
    if bent or _promising(located, screened, progress):
        stand = _fitted(problem, null, screened, found if bent else (), progress)
    else:
        if not located.worth_looking and follows_a_state(problem, null.fit):
            null = polished(problem, null, progress)
        stand = unmasked(Stand(problem, null, []), found, progress)
        if not stand.fitted:
            stand = _with_law(stand, found, screened, progress)
            decision = decide(problem, null, located, stand.judged)
            return Selection(problem, null, screened, tuple(stand.judged), decision, stand.tabled)
    stand = _fair(_with_kin(stand, located, screened, progress), progress)
    stand = with_passing(stand, found, progress)
    stand = _everywhere(_with_mates(with_noise_of_best(stand, progress), screened, progress), found, progress)
    if stand.best is not stand.null and stand.best.candidate.sharp:  # its runs are slow: which wheel it is comes first
        stand = _other_places(stand, screened, progress, refined=False)
    stand = with_noise_of_likeliest(with_rivals_refined(_nearer(stand, progress), progress), progress)
    stand = _other_places(_other_law(stand, progress), screened, progress)
    stand = _with_law(stand, found, screened, progress)
    if stand.leader is not stand.best:
        stand = _other_law(stand, progress)
    else:
        stand = with_rivals_refined(_noise_of_both(with_further(stand, found, progress), progress), progress, "end")
        if len(stand.best.candidates) > 1:
            stand = with_noise_of_likeliest(stand, progress, "end")
        stand = _with_law(stand, found, screened, progress)
    stand = _with_own_numbers(_everywhere(stand, found, progress), progress)
    located = locate(stand.problem, stand.null.fit)
    decision = decide(stand.problem, stand.null, located, stand.judged)
    tabled = stand.tabled if stand.unexplained or stand.leader is not stand.best or stand.by_law else None
    not_tried = tuple(dict.fromkeys(left_out))
    return Selection(stand.problem, stand.null, screened, tuple(stand.judged), decision, tabled, not_tried)


def _looked_at(
    problem: Problem, null: Hypothesis, located: Located, found: Sequence[Candidate], progress: Progress
) -> tuple[Hypothesis, tuple[Screened, ...], Located]:
    """Nuisances alone, the signatures beside them and what they leave. Where much is left signatures are no more than
    hints. Where nothing was, the derivatives by the nuisances are made anew only if a signature seems worth it; all are
    then looked at again, for the nuisances may have been bent by what old derivatives did not show, but only those
    that promise something where they hardly were.
    """
    screened = tuple(screen(problem, null.fit, found, progress))
    if held_out_gap(problem, null.fit) > LARGE:
        return null, screened, located
    screened = renewed(problem, null.fit, screened)
    if not located.worth_looking and _promising(located, screened, progress, HALF_SEEN):
        before, null = null, polished(problem, null, progress)
        once_more = [*found]
        if null.log_evidence - before.log_evidence < HARDLY_BENT:
            loud = {one.candidate.label for one in screened if one.gain > HALF_SEEN * PROMISING}
            once_more = [one for one in found if one.label in loud]
        labels = {one.label for one in once_more}
        rest = [one for one in screened if one.candidate.label not in labels]
        screened = renewed(problem, null.fit, [*rest, *screen(problem, null.fit, once_more, progress)])
        located = locate(problem, null.fit)
    return null, screened, located


def _promising(located: Located, screened: Sequence[Screened], progress: Progress, share: float = 1.0) -> bool:
    """Whether a signature is worth a fit: the less the residual itself says, the louder it must be."""
    loudest = max(screened, key=lambda one: one.robust, default=None)
    if loudest is None or max(one.gain for one in screened) < PROMISING:
        return False
    progress(f"loudest signature: {loudest.candidate.label} {loudest.robust:+.1f} nats")
    if located.significant:
        return True
    return loudest.robust > share * (WORTH_FITTING if located.surprising else GLANCE)


@dataclass(frozen=True)
class Base:
    """A fit of the nuisances from which effects are fitted, what was screened there, and whether it is of the nominal
    build.
    """

    fit: Fit
    screened: Sequence[Screened]
    nominal: bool = False

    @cached_property
    def chosen(self) -> dict[str, Screened]:
        """Those shortlisted, by label."""
        return {one.candidate.label: one for one in shortlist(self.screened) if one.gain > PROMISING}


def _fitted(
    problem: Problem, null: Hypothesis, screened: Sequence[Screened], found: Sequence[Candidate], progress: Progress
) -> Stand:
    """The shortlist, but for those that have no chance beside one that leaves only noise. Where nuisances alone have
    been bent far, effects (`found`) are looked for and fitted from the nominal build too.
    """
    bases = [Base(null.fit, screened)]
    if found:
        home = starting_fit(problem, at_home(problem, null.fit))
        bases.insert(0, Base(home, screen(problem, home, found, progress), nominal=True))
    stand = Stand(problem, null, [])
    for label in _in_turn([base.chosen for base in bases]):
        if stand.fitted and not time_for(stand.problem, "fit", label, progress):
            continue
        if stand.most is not None and hopeless_beside(stand, label, stand.most, bases):
            continue
        made = fitted_from_bases(stand, label, bases, progress)
        if made is None:
            continue
        gain = made.log_evidence - stand.null.log_evidence
        progress(f"{made.label}: {gain:+.1f} nats, gap {held_out_gap(stand.problem, made.fit):.3g}")
        stand = replace(stand, fitted=[*stand.fitted, made])
        if stand.most is made:
            stand = _law_at_once(stand, progress)
            if stand.problem.forward.law != problem.forward.law:
                problem = stand.problem
                bases = [replace(base, fit=moved_to(problem, base.fit)) for base in bases]
    most = stand.most
    near = most is not None and most.log_evidence > stand.null.log_evidence - FAR_BEHIND
    if most is None or not found or not near or held_out_gap(problem, null.fit) > LARGE:
        return stand
    better = polished(problem, most, progress)  # as nuisances alone have been
    return replace(stand, fitted=[better if one is most else one for one in stand.fitted])


def fitted_from_bases(stand: Stand, label: str, bases: Sequence[Base], progress: Progress) -> Hypothesis | None:
    """One of the shortlist from each base where it is on the list, until it leaves nothing or is out of reach of one
    that does; in any case if it ends behind nuisances alone, which are a part of it.
    """
    made: Hypothesis | None = None
    one = next(base.chosen[label] for base in bases if label in base.chosen)
    for base in bases:
        far = made is not None and made.fit.cost(stand.problem.train) > stand.level
        behind = made is not None and made.log_evidence < stand.null.log_evidence
        open_yet = made is None or behind or (not far and something_left(stand.problem, made))
        if made is None or (label in base.chosen and open_yet):
            made = _better(made, _begun(stand, base, base.chosen.get(label, one), progress))
    if made is None or made.fit.cost(stand.problem.train) > stand.level:
        return made
    return moved(stand.problem, made, progress)


def _in_turn(lists: Sequence[dict[str, Screened]]) -> list[str]:
    """Labels of all lists, the first of each, then the second of each."""
    turns = itertools.zip_longest(*lists)
    return list(dict.fromkeys(label for turn in turns for label in turn if label is not None))


def _better(one: Hypothesis | None, other: Hypothesis | None) -> Hypothesis | None:
    both = [fit for fit in (one, other) if fit is not None]
    return max(both, key=lambda fit: fit.log_evidence, default=None)


def _begun(stand: Stand, begun: Base, one: Screened, progress: Progress) -> Hypothesis | None:
    """A screened effect fitted from where it was screened, a gust from where else it may be as well."""
    made = fitted_from_starts(stand, begun, one, progress)
    for other in elsewhere(one, begun.screened):
        if made is not None and not something_left(stand.problem, made):
            break
        made = _better(made, fitted_from_starts(stand, begun, other, progress))
    return made


def fitted_from_starts(stand: Stand, begun: Base, one: Screened, progress: Progress) -> Hypothesis | None:
    """A screened effect fitted from the best of its starts, and from each of its sizes where a start that does nothing
    may look best.
    """
    made = _from_starts(stand, begun, one, progress)
    for values in all_sizes(one) if one.candidate.from_a_threshold else []:
        start = (begun.fit.z, [values])
        made = _better(made, hypothesis(stand.problem, begun.fit, (one.candidate,), [start], progress, stand.level))
    return made


def _from_starts(stand: Stand, begun: Base, one: Screened, progress: Progress) -> Hypothesis | None:
    """A screened effect fitted from where it was screened, or from the nominal build at all of its sizes."""
    problem, null, base = stand.problem, stand.null, begun.fit
    starts = [(one.z, [one.values]), (base.z, [one.values]), (one.z, [one.tried])]
    if begun.nominal:
        starts = [(base.z, [values]) for values in (one.values, *all_sizes(one), *stretched(one))]
        return hypothesis(problem, base, (one.candidate,), starts, progress, stand.level)
    starts += [(one.z, [values]) for values in stretched(one)]
    made = hypothesis(problem, base, (one.candidate,), starts, progress, stand.level)
    slight = (base.z, [scaled(one.candidate, one.values, SLIGHT)])
    for other in (starts[0], (base.z, [one.tried]), slight):
        if made is not None and made.log_evidence > null.log_evidence + KEPT_PROMISE * one.gain:
            break
        made = _better(made, hypothesis(problem, base, (one.candidate,), [other], progress, stand.level))
    return made


def _with_mates(stand: Stand, screened: Sequence[Screened], progress: Progress) -> Stand:
    """With the other effects of the best one's class, where it leaves something: they look alike and are not the same,
    and the signature of a large one at the nominal vehicle may be too unlike to be on the shortlist.
    """
    if stand.best is stand.null or not stand.unexplained:
        return stand
    mates = of_classes(stand.best.classes, screened, _names(stand))
    return replace(stand, fitted=[*stand.fitted, *_begun_like(stand, stand.best, mates, progress)])


def _names(stand: Stand) -> set[str]:
    """Of the first effect of each that was fitted."""
    return {one.candidate.name for one in stand.fitted}


def _with_kin(stand: Stand, located: Located, screened: Sequence[Screened], progress: Progress) -> Stand:
    """With the effects that look like the strained nuisances, and the others of their classes; not where all are bent
    to explain what is no nuisance, nor where the best effect leaves no nuisance strained and nothing else.
    """
    if not located.surprising or held_out_gap(stand.problem, stand.null.fit) > LARGE:
        return stand
    if stand.best is not stand.null and not locate(stand.problem, stand.best.fit).worth_looking:
        return stand
    tried = {one.candidate.label for one in stand.fitted}
    liked = kin(stand.problem, located, screened)
    like = {one.candidate.equivalence for one in liked if not one.candidate.of_sensor}
    mates = [one for one in liked if one.candidate.label not in tried]
    stand = replace(stand, fitted=[*stand.fitted, *_begun_like(stand, stand.null, mates, progress)])
    others = of_classes(like, screened, _names(stand))
    return replace(stand, fitted=[*stand.fitted, *_begun_like(stand, stand.null, others, progress)])


def _other_places(stand: Stand, screened: Sequence[Screened], progress: Progress, refined: bool = True) -> Stand:
    """With the best effect on other wheelsets, sides or channels, which may be its mirror image: a first wheelset that
    is turned steers a bogie as a second one does that is turned the other way.
    """
    if stand.best is stand.null:
        return stand
    name, labels = stand.best.candidate.name, {one.candidate.label for one in stand.fitted}
    same = sorted((one for one in screened if one.candidate.name == name), key=lambda one: -one.gain)
    others: dict[str, Screened] = {}
    for one in same:
        if one.candidate.label not in labels and one.gain > HOPELESS * same[0].gain:
            others.setdefault(one.candidate.label, one)
    made = _begun_like(stand, stand.best, list(others.values())[:VARIANTS], progress)
    if not refined:
        return replace(stand, fitted=[*stand.fitted, *made])
    reach = OUT_OF_REACH * (stand.best.log_evidence - stand.null.log_evidence)
    near = [one for one in made if one.log_evidence > stand.best.log_evidence - reach]
    made = [polished(stand.problem, one, progress) if any(one is other for other in near) else one for one in made]
    return replace(stand, fitted=[*stand.fitted, *made])


def _begun_like(stand: Stand, best: Hypothesis, others: Iterable[Screened], progress: Progress) -> list[Hypothesis]:
    """Screened effects fitted from a hypothesis' nuisances and from the nominal build, at all sizes."""
    problem = stand.problem
    home = starting_fit(problem, at_home(problem, best.fit))
    made: list[Hypothesis] = []
    for one in others:
        if time_for(problem, "law", one.candidate.label, progress):
            starts = [(z, [values]) for z in (home.z, best.fit.z) for values in all_sizes(one)]
            fitted = hypothesis(problem, home, (one.candidate,), starts, progress)
            made += [fitted] if fitted is not None else []
    return made


def _everywhere(stand: Stand, found: Sequence[Candidate], progress: Progress) -> Stand:
    """With stretches that cover the whole way as the effects that act everywhere, of all that bring something."""
    level = stand.null.log_evidence + ENOUGH
    made = [
        one if one.log_evidence < level else everywhere(stand.problem, one, found, progress) for one in stand.fitted
    ]
    return replace(stand, fitted=made)


def _with_own_numbers(stand: Stand, progress: Progress) -> Stand:
    """With the best one's numbers as they are handed over."""
    if stand.best is stand.null:
        return stand
    better = shown_held_out(stand.problem, with_own_numbers(stand.problem, stand.best, progress), progress)
    return replace(stand, fitted=[better if one is stand.best else one for one in stand.fitted])


def _nearer(stand: Stand, progress: Progress) -> Stand:
    """With derivatives made anew at the best effect: what it has not taken itself, a second one would."""
    if stand.best is stand.null:
        return stand
    better = shown_held_out(stand.problem, polished(stand.problem, stand.best, progress), progress)
    return replace(stand, fitted=[better if one is stand.best else one for one in stand.fitted])


def _law_at_once(stand: Stand, progress: Progress) -> Stand:
    """With the creep law under which the effect that takes most leaves nothing, where there is one: all others are then
    held against that.
    """
    if stand.best is not stand.most or held_out_gap(stand.problem, stand.best.fit) > LARGE:
        return stand
    other = _other_law(stand, progress, refined=False)
    return stand if other.unexplained else other


def _other_law(stand: Stand, progress: Progress, refined: bool = True) -> Stand:
    """With the creep law under which the leader explains more: which law holds is a nuisance. Nuisances alone, and what
    is not refined yet, are asked only where they leave something.
    """
    problem, null, first = stand.problem, stand.null, stand.leader
    left = stand.unexplained if first is stand.best else something_left(problem, first)
    asked = left or (refined and first is not null)
    if not asked or not time_for(problem, "law", "another creep law", progress):
        return stand
    for name in other_laws(problem):
        other = problem.but(forward=problem.forward.but(law=name))
        best = under(other, first, progress, first.fit.cost(problem.train) + FAR_BEHIND)
        near = best is not None and best.log_evidence > first.log_evidence - FAR_BEHIND
        if best is not None and refined and near:
            best = polished(other, best, progress)
        if best is None or best.log_evidence < first.log_evidence + ENOUGH:
            continue
        progress(f"creep law {name}: {best.log_evidence - first.log_evidence:+.1f} nats")
        rivals = [one for one in stand.fitted if one is not first]
        rivals = [one for one in rivals if one.log_evidence > first.log_evidence - FAR_BEHIND]
        rest = [one for one in (under(other, one, progress) for one in rivals) if one is not None]
        if first is null:
            return Stand(other, best, rest)
        alone = under(other, null, progress)
        if alone is not None and stand.tabled and first is stand.tabled[0]:
            return Stand(other, alone, rest, (best, stand.tabled[1]))
        if alone is not None:
            return Stand(other, alone, [best, *rest])
    return stand


def hopeless_beside(stand: Stand, label: str, best: Hypothesis, bases: Sequence[Base]) -> bool:
    """Whether one of the shortlist is hopeless beside the best; where that leaves only noise and nuisances alone do not
    do as well, what nuisances that have been bent far make of its signature does not count beside the nominal build's.
    """
    problem = stand.problem
    answers = best.log_evidence > stand.null.log_evidence and not something_left(problem, best)
    return all(_hopeless(label, base.chosen, best, problem) for base in (bases[:1] if answers else bases))


def _hopeless(label: str, chosen: dict[str, Screened], best: Hypothesis, problem: Problem) -> bool:
    """Whether a hypothesis that leaves only noise is there already and this one's signature does far less, or next to
    nothing beside one that takes much.
    """
    if label not in chosen:
        return True
    gain, leader = chosen[label].gain, max(other.gain for other in chosen.values())
    if gain < NEGLIGIBLE * leader - FAIR_CHANCE:
        return True
    return held_out_gap(problem, best.fit) < WHITE and gain < HOPELESS * leader - FAIR_CHANCE


def _fair(stand: Stand, progress: Progress) -> Stand:
    """With the better of two fits of the nuisances alone: the one that there is, and one from the best hypothesis; what
    they can do themselves is no evidence for an effect, of which a weak one has little.
    """
    problem, null, best = stand.problem, stand.null, stand.most
    if best is None:
        return stand
    other = concluded(problem, improved(problem, restarted(problem, best.fit, best.fit.z), progress))
    better = max(null, other, key=lambda one: one.log_evidence)
    gain = best.log_evidence - better.log_evidence
    return replace(stand, null=polished(problem, better, progress) if 0.0 < gain < WEAK else better)


def with_noise_of_best(stand: Stand, progress: Progress) -> Stand:
    """The noise as the best hypothesis passes the track's errors on, where two classes are close or something is left;
    the nearest classes are fitted on with it, and in the latter case those that take most, borne out or not: either may
    be one of two. Where the best is weak and leaves nothing, as nuisances alone pass them on: at short waves all
    that is predicted is the track file's error, which a stiffness that is not the nominal one changes in each channel
    by another share.
    """
    judged = stand.judged
    if not judged or judged[0].evidence < 0.5 * ENOUGH:
        return stand
    weak = judged[0].evidence < WEAK and not stand.unexplained
    if not (weak or _close(judged) or stand.unexplained):
        return stand
    first = judged[0].hypothesis
    through = stand.null if weak else first
    progress(f"track errors propagated through {through.label}")
    problem = with_noise_of(stand.problem, through, progress)
    if problem is None:
        return stand
    reach = max(2.0 * RIVAL, OUT_OF_REACH * judged[0].standing)
    close = [one.hypothesis for one in judged if one.standing > judged[0].standing - reach]
    most = sorted(stand.fitted, key=lambda one: -one.log_evidence)[: FIRSTS if stand.unexplained else 0]
    nearest: dict[frozenset[str], Hypothesis] = {}
    for one in (*(close[:1]), *most, *close):
        nearest.setdefault(one.classes, one)
    near = list(nearest.values())[:NEAREST]
    refitted = [shown_held_out(problem, again(problem, one, progress), progress) for one in near]
    return Stand(problem, again(problem, stand.null, progress), refitted)


def _noise_of_both(stand: Stand, progress: Progress) -> Stand:
    """The noise as two effects pass the track's errors on together, where the best are two and leave something."""
    if len(stand.best.candidates) < 2 or not stand.unexplained:
        return stand
    if not time_for(stand.problem, "end", f"the noise of {stand.best.label}", progress):
        return stand
    return with_noise_of_best(stand, progress)


def _with_law(stand: Stand, found: Sequence[Candidate], screened: Sequence[Screened], progress: Progress) -> Stand:
    """With a law without a name where none was fitted yet and the best effect leaves something, be it only a force that
    follows a state, where it needs nuisances far from their data sheets, or where two bring little together; where the
    law is ahead, with the effects that look most like it.
    """
    if stand.tabled is not None or not found:
        return stand
    problem, best = stand.problem, stand.best
    faint_pair = len(best.candidates) > 1 and best.log_evidence - stand.null.log_evidence < FAINT_PAIR
    if not (stand.unexplained or stand.far or faint_pair or follows_a_state(problem, best.fit)):
        return stand
    stand = replace(stand, tabled=fit_empirical(problem, stand.null, best, found[0].context, progress))
    if stand.tabled is None or stand.leader is stand.best:
        return stand
    law, tried = stand.tabled[0], {one.candidate.name for one in stand.fitted}
    mates = [one for one in like_law(problem, law, screened) if one.candidate.name not in tried]
    progress(f"like it: {', '.join(one.candidate.label for one in mates) or 'nothing that was not tried'}")
    return replace(stand, fitted=[*stand.fitted, *_begun_like(stand, law, mates, progress)])


def _close(judged: Sequence[Judged]) -> bool:
    if not judged or judged[0].evidence < ENOUGH / 2.0:
        return False
    others = [one for one in judged if one.hypothesis.classes != judged[0].hypothesis.classes]
    return any(judged[0].standing - one.standing < RIVAL for one in others)
