"""Moving: what was fitted and leaves something is looked for elsewhere along the way, further off than a fit goes.

The ends of a stretch, the spacing of a row of joints of which training sections hold so few that they do not say it,
and a dip of which held-out sections show more. A stretch that covers the whole way is the effect that acts everywhere.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from experiments.discrepancy.fit.candidates import Candidate
from experiments.discrepancy.fit.fitting import Problem, at_values, restarted, with_candidates
from experiments.discrepancy.fit.hypothesis import Hypothesis, concluded, hypothesis
from experiments.discrepancy.fit.scores import Shares
from experiments.discrepancy.progress import Progress
from experiments.discrepancy.screen.places import distance_at
from experiments.discrepancy.screen.placing import matched
from experiments.discrepancy.select.decide import ENOUGH, LARGE, held_out_gap
from experiments.discrepancy.select.refining import something_left
from experiments.discrepancy.select.starts import ends, with_other_ends
from railsim.errors import InputError

FEW = 2  # joints in training sections that do not fix their spacing against the errors of their places
ASIDE = 0.1 * np.arange(-10, 11)  # m that the next joint is tried off its place; a dip is felt over a metre
FINE = 1e-3  # m to which its place is found
FIRST_STEPS = 4.0  # of what a number is varied by for a derivative, with which a dip's are looked for by all sections
MOST_RUNS = 80  # of the model for that


def moved(problem: Problem, made: Hypothesis, progress: Progress) -> Hypothesis:
    """One effect with its place found anew, where it leaves something."""
    return shown_held_out(problem, _other_ends(problem, made, progress), progress)


def _other_ends(problem: Problem, made: Hypothesis, progress: Progress) -> Hypothesis:
    """With the ends of a stretch elsewhere, as long as it leaves something and that brings something."""
    while something_left(problem, made):
        starts = [(made.fit.z, [values]) for values in with_other_ends(made.candidate, made.values[0])]
        other = hypothesis(problem, made.fit, made.candidates, starts, progress) if starts else None
        if other is None or other.log_evidence < made.log_evidence + ENOUGH:
            break
        progress(f"{other.label}, ends elsewhere: {other.log_evidence - made.log_evidence:+.1f} nats")
        made = other
    return made


def everywhere(problem: Problem, made: Hypothesis, found: Sequence[Candidate], progress: Progress) -> Hypothesis:
    """With a stretch that covers the whole way, but for what its first and its last section see alone, as the effect of
    those `found` that acts everywhere; the same where there is none.
    """
    s = distance_at(problem, problem.frames.middles)
    names = {one.name for one in made.candidates}
    for number, (candidate, values) in enumerate(zip(made.candidates, made.values, strict=True)):
        whole = next((one for one in found if one.name == candidate.kind.everywhere and one.name not in names), None)
        if whole is None or not _covers(candidate, values, s):
            continue
        now = [*made.values]
        now[number] = {name: values[name] for name in whole.parameters}
        candidates = tuple(whole if other == number else one for other, one in enumerate(made.candidates))
        other = hypothesis(problem, made.fit, candidates, [(made.fit.z, now)], progress)
        if other is not None and other.log_evidence > made.log_evidence - ENOUGH:
            progress(f"{made.label} covers the whole way: {other.label}")
            return everywhere(problem, other, found, progress)
    return made


def _covers(candidate: Candidate, values: dict[str, float], s: np.ndarray) -> bool:
    """Whether a stretch begins by the second section and lasts to the last but one; s: their middles [m]."""
    begin, end = ends(candidate, values)
    return bool(begin <= s[1] and end >= s[-2])


def shown_held_out(problem: Problem, made: Hypothesis, progress: Progress) -> Hypothesis:
    """A row of joints or a dip with the numbers that held-out sections show, where it leaves much there: what lies in a
    held-out section is seen there only. Those sections are then no test of these numbers.
    """
    if len(made.candidates) > 1 or not made.candidate.short or held_out_gap(problem, made.fit) < LARGE:
        return made
    found = (
        _respaced(problem, made, progress) if made.candidate.number("spacing") else _deepened(problem, made, progress)
    )
    return found if held_out_gap(problem, found.fit) < held_out_gap(problem, made.fit) else made


def _respaced(problem: Problem, made: Hypothesis, progress: Progress) -> Hypothesis:
    """With another first joint and spacing, the joint that training sections hold where it is."""
    values = made.values[0]
    s = distance_at(problem, problem.frames.middles)
    begin, gap = made.candidate.number("distance"), made.candidate.number("spacing")
    joints = np.arange(values[begin], s[-1], values[gap])
    held = [place for place in joints if problem.train[int(np.abs(s - place).argmin())]]
    if not 0 < len(held) <= FEW:
        return made
    kept = float(held[0])
    first, spacing = (made.candidate.parameters[name] for name in (begin, gap))

    def at(before: int, metres: float) -> dict[str, float]:
        metres = float(np.clip(metres, spacing.low, spacing.high))
        start = float(np.clip(kept - before * metres, first.low, first.high))
        return {**values, gap: metres, begin: start}

    def worth(before: int, metres: float) -> float:
        try:
            return at_values(problem, made.fit, [at(before, metres)]).cost(problem.test)
        except InputError:
            return np.inf

    rows = [(one[begin], one[gap]) for one in (values, *_placed(problem, made))]
    tried = {(round((kept - start) / metres), metres + float(aside)) for start, metres in rows for aside in ASIDE}
    before, near = min(sorted(tried), key=lambda row: worth(*row))
    step = float(ASIDE[1] - ASIDE[0])
    found: Any = minimize_scalar(
        lambda metres: worth(before, metres), bounds=(near - step, near + step), options={"xatol": FINE}
    )
    other = concluded(problem, at_values(problem, made.fit, [at(before, float(found.x))]))
    progress(f"{other.label}, first joint and spacing by held-out sections: {other.values[0]}")
    return other


def _deepened(problem: Problem, made: Hypothesis, progress: Progress) -> Hypothesis:
    """A dip of which training sections see an end only, with its numbers by all sections."""
    shares = Shares(made.candidates)
    seen = problem.train | problem.test

    def cost(given: np.ndarray) -> float:
        try:
            return at_values(problem, made.fit, shares.values(given)).cost(seen)
        except InputError:
            return np.inf

    free = made.candidate.parameters
    where = [{name: one[name] for name in free if free[name].absent is None} for one in _placed(problem, made)]
    starts = [made.values[0], *({**size, **one} for one in where for size in made.candidate.sizes())]
    begun = min((shares.of([one]) for one in starts), key=cost)
    corners = np.clip(begun + FIRST_STEPS * np.diag(shares.steps(begun)), 0.0, 1.0)
    found: Any = minimize(
        cost,
        begun,
        method="Nelder-Mead",
        bounds=[(0.0, 1.0)] * len(begun),
        options={"initial_simplex": np.vstack([begun, corners]), "maxfev": MOST_RUNS, "xatol": 1e-5, "fatol": 1.0},
    )
    fit = with_candidates(problem, made.fit, made.candidates, [(made.fit.z, found.x)])
    other = concluded(problem, fit)
    progress(f"{other.label}, by all sections: {other.values[0]}")
    return replace(other, covariance=concluded(problem.but(train=seen), fit).covariance)


def _placed(problem: Problem, made: Hypothesis) -> list[dict[str, float]]:
    """Where the effect looks most like what is left without it, in all sections."""
    alone = restarted(problem, made.fit, made.fit.z)

    def change_of(one: Candidate, values: dict[str, float]) -> np.ndarray | None:
        try:
            return problem.stacked(problem.forward.predict(alone.z, (one.build(values),))) - alone.stacked
        except InputError:
            return None

    return matched(problem, alone, made.candidate, made.values[0], change_of)
