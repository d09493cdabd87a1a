"""Rivals: effects of other classes that explain nearly as much, refined as the best one is before any gets a name.

One that still stands where older derivatives have left it may be behind for that alone: a sensor's delay and its
resonance, or a wheelset's angle and its wheels' difference, lie a fiftieth of what either brings apart.
"""

from dataclasses import replace

import numpy as np

from experiments.discrepancy.fit.hypothesis import Hypothesis, again
from experiments.discrepancy.progress import Progress
from experiments.discrepancy.select.passing import likelihood_of_own
from experiments.discrepancy.select.refining import polished, time_for, with_noise_of
from experiments.discrepancy.select.stand import Stand
from railsim.errors import InputError

CLOSE = 30.0  # nats behind the best from which a rival is refined,
CONTESTED = 0.05  # or this share of what the best brings, if that is more
WEAK = 60.0  # nats of the best below which the noise stays that of nuisances alone
TURNS = 4  # hypotheses that are refined, the best among them


def with_rivals_refined(stand: Stand, progress: Progress, stage: str = "linearise") -> Stand:
    """With derivatives made anew at the best and at those that are close to it, as long as the budget of a stage
    lasts; whichever then is the best is held against the others in turn.
    """
    for _ in range(TURNS):
        one = _next(stand)
        if one is None or not time_for(stand.problem, stage, f"derivatives at {one.label}", progress):
            break
        better = replace(polished(stand.problem, one, progress, stage), fresh=True)
        stand = replace(stand, fitted=[better if other is one else other for other in stand.fitted])
    return stand


def with_noise_of_likeliest(stand: Stand, progress: Progress, stage: str = "law") -> Stand:
    """With the noise that the likeliest of the best and its rivals passes on, each by what it passes on itself: under
    that of a healthy vehicle a channel that comes late seems to disagree with what the others say of the track. Of two
    effects each stays in the comparison by itself.
    """
    problem, best = stand.problem, stand.best
    rivals = _rivals(stand)
    if not rivals or best.log_evidence - stand.null.log_evidence < WEAK:
        return stand
    if not time_for(problem, stage, "rivals with the noise that they pass on", progress):
        return stand
    likeliest, most = best, -np.inf
    for one in (best, *rivals):
        try:
            here = likelihood_of_own(problem, one.fit.z, one.fit.effects) - 0.5 * float(one.fit.z @ one.fit.z)
        except InputError as error:
            progress(f"{one.label}, on a track that it may be: {error}")
            continue
        if here > most:
            likeliest, most = one, here
    progress(f"track errors propagated through {likeliest.label}")
    other = with_noise_of(problem, likeliest, progress)
    if other is None:
        return stand
    kept = [best, *rivals]
    parts = [one for one in _best_of_classes(stand) if any(one.classes < whole.classes for whole in kept)]
    kept += [one for one in parts if all(one is not other for other in kept)]
    fitted = [replace(again(other, one, progress), fresh=one.fresh) for one in kept]
    return Stand(other, again(other, stand.null, progress), fitted)


def _next(stand: Stand) -> Hypothesis | None:
    """The best, or the nearest of another class, that was not refined yet."""
    best = stand.best
    if best is stand.null:
        return None
    return next((one for one in (best, *_rivals(stand)) if not one.fresh), None)


def _rivals(stand: Stand) -> list[Hypothesis]:
    """The nearest of each other class that is close to the best, closest first."""
    best = stand.best
    reach = max(CLOSE, CONTESTED * (best.log_evidence - stand.null.log_evidence))
    near = [one for one in _best_of_classes(stand) if one.log_evidence > best.log_evidence - reach]
    return [one for one in near if one.classes != best.classes][: TURNS - 1]


def _best_of_classes(stand: Stand) -> list[Hypothesis]:
    """The one with most evidence of each class, or of two, most first."""
    first: dict[frozenset[str], Hypothesis] = {}
    for one in sorted(stand.fitted, key=lambda one: -one.log_evidence):
        first.setdefault(one.classes, one)
    return list(first.values())
