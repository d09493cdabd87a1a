"""Moving: what was fitted and leaves something is looked for elsewhere along the way, further off than a fit goes.

The ends of a stretch, and the spacing of a row of joints of which training sections hold so few that they do not say
it.
"""

from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from experiments.discrepancy.fit.fitting import Problem, at_values
from experiments.discrepancy.fit.hypothesis import Hypothesis, Tell, concluded, hypothesis
from experiments.discrepancy.screen.places import distance_at
from experiments.discrepancy.select.decide import ENOUGH, LARGE, held_out_gap
from experiments.discrepancy.select.refining import something_left
from experiments.discrepancy.select.starts import with_other_ends
from railsim.errors import InputError

FEW = 2  # joints in training sections that do not fix their spacing against the errors of their places
ASIDE = 0.1 * np.arange(-10, 11)  # m that the next joint is tried off its place; a dip is felt over a metre
FINE = 1e-3  # m to which its place is found


def moved(problem: Problem, made: Hypothesis, tell: Tell) -> Hypothesis:
    """One effect with its place found anew, where it leaves something."""
    return _respaced(problem, _other_ends(problem, made, tell), tell)


def _other_ends(problem: Problem, made: Hypothesis, tell: Tell) -> Hypothesis:
    """With the ends of a stretch elsewhere, as long as it leaves something and that brings something."""
    while something_left(problem, made):
        starts = [(made.fit.z, [values]) for values in with_other_ends(made.candidate, made.values[0])]
        other = hypothesis(problem, made.fit, made.candidates, starts, tell) if starts else None
        if other is None or other.log_evidence < made.log_evidence + ENOUGH:
            break
        tell(f"{other.label}, ends elsewhere: {other.log_evidence - made.log_evidence:+.1f} nats")
        made = other
    return made


def _respaced(problem: Problem, made: Hypothesis, tell: Tell) -> Hypothesis:
    """With the spacing that held-out sections show, the joint that training sections hold where it is: what lies in a
    held-out section is seen there only. That one number is then no test of them.
    """
    values = made.values[0]
    if "spacing" not in values or held_out_gap(problem, made.fit) < LARGE:
        return made
    s = distance_at(problem, problem.frames.middles)
    joints = np.arange(values["first"], s[-1], values["spacing"])
    held = [s_ for s_ in joints if problem.train[int(np.abs(s - s_).argmin())]]
    if not 0 < len(held) <= FEW:
        return made
    kept = float(held[0])
    before = round((kept - values["first"]) / values["spacing"])
    low, high = (getattr(made.candidate.parameters["spacing"], end) for end in ("low", "high"))

    def at(aside: float) -> dict[str, float]:
        spacing = float(np.clip(values["spacing"] + aside, low, high))
        return {**values, "spacing": spacing, "first": kept - before * spacing}

    def worth(aside: float) -> float:
        try:
            return at_values(problem, made.fit, [at(aside)]).cost(problem.test)
        except InputError:
            return np.inf

    best = float(ASIDE[int(np.argmin([worth(float(aside)) for aside in ASIDE]))])
    step = float(ASIDE[1] - ASIDE[0])
    found: Any = minimize_scalar(worth, bounds=(best - step, best + step), options={"xatol": FINE})
    other = concluded(problem, at_values(problem, made.fit, [at(float(found.x))]))
    tell(f"{other.label}, spacing by held-out sections: {other.values[0]['spacing'] - values['spacing']:+.2f} m")
    return other if held_out_gap(problem, other.fit) < held_out_gap(problem, made.fit) else made
