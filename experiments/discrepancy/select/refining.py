"""Refining: a hypothesis made better where it stands, what it leaves, and whether there is time for more."""

import math
from dataclasses import replace

import numpy as np

from experiments.discrepancy.fit.fitting import Problem, improved, linearised, moved_to, starting_fit
from experiments.discrepancy.fit.hypothesis import Hypothesis, concluded
from experiments.discrepancy.progress import Progress
from experiments.discrepancy.screen.locate import locate
from experiments.discrepancy.select.decide import LARGE, held_out_gap
from railsim.errors import InputError

WHITE = 1.03  # held-out gap from which nothing is left to explain
ROUNDS = 2
WORTH = 150.0  # nats that a further linearisation must have brought to go on: the next brings a hundredth of it
WORTH_ALONE = 500.0  # the same of nuisances alone: what a weak effect is held against is refined once more beside it
ALIKE = 0.5  # cosine between what a nuisance and an effect do, from which they are told apart by new derivatives
LAWS = ("polach", "fastsim")  # creep laws that are tried where something is left
BUDGET = {"fit": 600.0, "linearise": 1000.0, "law": 1150.0, "further": 1500.0, "end": 1900.0}
"""Runs of the model after which a stage is not begun any more; what was not tried is said in the verdict."""


def nuisances_alone(problem: Problem, z: np.ndarray, progress: Progress, level: float = math.inf) -> Hypothesis:
    """The fit that all others are compared with; given up where its cost will not come down to `level`."""
    return concluded(problem, improved(problem, starting_fit(problem, z), progress, level))


def polished(problem: Problem, one: Hypothesis, progress: Progress, stage: str = "linearise") -> Hypothesis:
    """With derivatives made anew at the hypothesis itself, as long as that brings something and the budget of a stage
    lasts.
    """
    if one.fresh:
        return one
    for _ in range(ROUNDS if held_out_gap(problem, one.fit) < LARGE else 1):
        if not time_for(problem, stage, f"derivatives at {one.label}", progress):
            break
        better = _anew(problem, one, progress)
        if better is None:
            break
        gain = better.log_evidence - one.log_evidence
        progress(f"{one.label}, linearised again: {gain:+.1f} nats")
        one = better if gain > 0.0 else one
        if gain < WORTH:
            return replace(one, fresh=True)
        if not one.candidates and gain < WORTH_ALONE:
            break
    return one


def with_own_numbers(problem: Problem, one: Hypothesis, progress: Progress) -> Hypothesis:
    """The numbers of its effects where derivatives by nuisances that do the same are as new as the effects' own: old
    ones make a spring's factor and the same spring's tolerance seem two things, and intervals too narrow.
    """
    if not time_for(problem, "end", f"the numbers of {one.label}", progress):
        return one
    return _anew(problem, one, progress, ALIKE) or one


def _anew(problem: Problem, one: Hypothesis, progress: Progress, alike: float = 0.0) -> Hypothesis | None:
    """Fitted on with derivatives made anew at itself; None where the model does not run there."""
    try:
        return concluded(problem, improved(problem, linearised(problem, one.fit, alike), progress))
    except InputError as error:
        progress(f"{one.label}: {error}")
        return None


def something_left(problem: Problem, best: Hypothesis) -> bool:
    """Whether a hypothesis leaves more than noise."""
    left = locate(problem, best.fit)
    return bool(left.loud) or (bool(left.significant) and held_out_gap(problem, best.fit) > WHITE)


def other_laws(problem: Problem) -> list[str]:
    """Creep laws that the vehicle's could be taken for."""
    law = problem.forward.law or getattr(getattr(problem.evidence.scenario.vehicle, "adhesion", None), "law", "")
    return [name for name in LAWS if law in LAWS and name != law]


def under(problem: Problem, one: Hypothesis, progress: Progress, level: float = math.inf) -> Hypothesis | None:
    """A hypothesis fitted on under another problem, given up where its cost will not come down to `level`; None where
    the model does not run.
    """
    try:
        return concluded(problem, improved(problem, moved_to(problem, one.fit), progress, level))
    except InputError as error:
        progress(f"{one.label}: {error}")
        return None


def with_noise_of(problem: Problem, one: Hypothesis, progress: Progress) -> Problem | None:
    """The problem with the noise as a hypothesis passes the track's errors on; None where the model does not run on one
    of the tracks that it may be.
    """
    try:
        return problem.with_noise(one.fit.z, one.fit.effects)
    except InputError as error:
        progress(f"{one.label}, on a track that it may be: {error}")
        return None


NOT_TRIED = "no time for "


def noting(progress: Progress, left_out: list[str]) -> Progress:
    """`progress` that keeps what there was no time for."""

    def both(text: str) -> None:
        if text.startswith(NOT_TRIED):
            left_out.append(text.removeprefix(NOT_TRIED))
        progress(text)

    return both


def time_for(problem: Problem, stage: str, what: str, progress: Progress) -> bool:
    """Whether the budget lets a stage begin; else says so."""
    there = problem.forward.meter.spent < BUDGET[stage]
    if not there:
        progress(NOT_TRIED + what)
    return there
