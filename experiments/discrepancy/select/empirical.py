"""An effect without a name: a force law tabled over the state it follows, from the latent force's curve.

Its points are fitted, and it runs, like any other effect.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from experiments.discrepancy.fit.candidates import Candidate, Context
from experiments.discrepancy.fit.fitting import Fit, Problem, restarted, starting_fit
from experiments.discrepancy.fit.hypothesis import Hypothesis, hypothesis
from experiments.discrepancy.progress import Progress
from experiments.discrepancy.screen.latent import LatentForce, latent_forces
from experiments.discrepancy.select.decide import LARGE, held_out_gap
from experiments.discrepancy.select.refining import polished, something_left
from experiments.discrepancy.select.starts import at_home
from railsim.effects.empirical_force import EmpiricalForce
from railsim.effects.interface import Effect, Parameter, ParameterPrior
from railsim.model import TRACK, Model

STARTS = (0.7, 1.5)  # of the curve, which the smoother shrinks
POINTS = 9  # whose forces are fitted
FINER = 8  # times as many steps in the table, on a monotone cubic through the points (Fritsch and Carlson 1980)
BEYOND = 0.5  # of the states' range to each side, over which the law goes on straight
REACH = 4.0  # times the curve's largest force, that a point may be
LOOKED_AT = 8  # places of latent forces that are compared by what they follow
AS_GOOD = 0.9  # of the loudest one's gain, from which a latent force may as well be the one
CURVES = 3  # curves that are tried, those first that are followed best
RESEMBLES = 0.5  # of the gap that nuisances alone leave, below which an effect resembles what is there
LEAST_TRIED = 0.01  # share of the force's variance that a curve must have to be tried
FOLLOWED = {False: (20.0, LEAST_TRIED), True: (30.0, 0.02)}
"""Nats of a latent force between two bodies, and that share, from which it follows a state, beside nuisances alone (in
none of 48 healthy recordings one has both) and beside an effect."""


@dataclass(frozen=True)
class TabledLaw(Candidate):
    """A force at one place as a function of one state there; its values at `states` are the free numbers.

    Attributes
    ----------
    states : m, rad, m/s or rad/s, increasing. velocity : whether they are velocities. size : N or N m, standard
    deviation of the values before anything is measured.
    """

    states: tuple[float, ...] = ()
    velocity: bool = False
    size: float = 1.0

    @property
    def label(self) -> str:
        """Place and state."""
        made = dict(self.choices)
        what = "velocity" if self.velocity else "displacement"
        return f"{self.name} ({made['axis']} between {made['upper']} and {made['lower']}, over {what})"

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Force at each state."""
        far, prior = REACH * self.size, ParameterPrior(0.0, self.size)
        one = Parameter("N or N m", -far, far, 0.0, 0.0, 0.1 * self.size, prior)
        return {f"force{number}": one for number in range(len(self.states))}

    def build(self, values: Mapping[str, float]) -> Effect:
        """The table with these values."""
        at = np.array(self.states)
        force = np.array([values[f"force{number}"] for number in range(len(at))])
        wide = 10.0 * max(abs(at[0]), abs(at[-1]), 1.0)
        fine = np.interp(np.arange(FINER * (len(at) - 1) + 1) / FINER, np.arange(len(at)), at)
        there = PchipInterpolator(at, force)(fine)
        beyond = BEYOND * (at[-1] - at[0])
        first, last = ((force[k + 1] - force[k]) / (at[k + 1] - at[k]) * beyond for k in (0, -2))
        states = tuple(np.concatenate([[at[0] - beyond], fine, [at[-1] + beyond]]).tolist())
        law = tuple(np.concatenate([[force[0] - first], there, [force[-1] + last]]).tolist())
        if self.velocity:
            table = {"displacement": (-wide, wide), "velocity": states, "force": (law, law)}
        else:
            table = {"displacement": states, "velocity": (-wide, wide), "force": tuple((f, f) for f in law)}
        return self.kind.build({**dict(self.choices), **table, "scale": 1.0})


def tabled_law(context: Context, force: LatentForce, model: Model) -> tuple[TabledLaw, dict[str, float]] | None:
    """The law of a latent force and its values by the smoother; None where its curve says nothing."""
    if len(force.curve) < POINTS or force.follows < LEAST_TRIED:
        return None
    often = np.interp(np.linspace(0.0, len(force.curve) - 1.0, POINTS), np.arange(len(force.curve)), force.curve[:, 0])
    states = 0.5 * (often + np.linspace(often[0], often[-1], POINTS))  # closer where the state is often
    if np.diff(states).min() <= 0.0:
        return None
    values = -np.interp(states, force.curve[:, 0], force.curve[:, 1])  # the law opposes the movement
    joint = next((e for e in model.elements if {e.upper, e.lower} == {force.place.upper, force.place.lower}), None)
    own = model.bodies[model.index(force.place.upper)].position
    choices = (
        ("upper", force.place.upper),
        ("lower", force.place.lower or TRACK),
        ("axis", force.place.direction),
        ("position", tuple(joint.position) if joint else own),
    )
    size = 2.0 * float(np.abs(values).max())
    if not 0.0 < size < math.inf:
        return None
    law = TabledLaw(EmpiricalForce, context, choices, tuple(states.tolist()), "velocity" in force.state, size)
    return law, {f"force{number}": float(value) for number, value in enumerate(values)}


def follows_a_state(problem: Problem, fit: Fit) -> bool:
    """Whether a force that follows a state is left where nothing else is: a law that only resembles the named one, or
    one that is too faint for any cell.
    """
    nats, share = FOLLOWED[bool(fit.candidates)]
    return any(one.gain > nats and one.follows > share and one.place.lower for one in likely_forces(problem, fit))


def likely_forces(problem: Problem, fit: Fit, motion: Fit | None = None) -> list[LatentForce]:
    """Latent forces as good as the loudest, those first that follow a state best: what joins two bodies answers nearly
    as a force on either does from outside; where one of the two is held they are the same, and the joint is kept.
    `motion`: the fit whose states they may follow.
    """
    found = latent_forces(problem, fit, LOOKED_AT, motion)
    loud = [one for one in found if one.gain >= AS_GOOD * found[0].gain]
    kept: list[LatentForce] = []
    for one in sorted(loud, key=lambda one: not one.place.lower):
        if not any(_same(one, other) for other in kept):
            kept.append(one)
    return sorted(kept, key=lambda one: -one.follows)


def _same(one: LatentForce, other: LatentForce) -> bool:
    figures = (one.gain, one.follows), (other.gain, other.follows)
    return one.place.direction == other.place.direction and np.allclose(*figures, rtol=1e-3, atol=0.0)


def fit_empirical(
    problem: Problem, null: Hypothesis, named: Hypothesis, context: Context, progress: Progress
) -> tuple[Hypothesis, LatentForce] | None:
    """The best of the places' laws, fitted with all nuisances, and where it acts; None where none helps. Where
    nuisances alone have been bent far, forces are looked for beside the nominal build first; before that, beside the
    nuisances of the best effect (`named`) and over its motion, where it resembles what is there.
    """
    bases: list[tuple[Fit, Fit | None]] = [(null.fit, None)]
    gap = held_out_gap(problem, null.fit)
    if gap > LARGE:
        bases.insert(0, (starting_fit(problem, at_home(problem, null.fit)), None))
        if held_out_gap(problem, named.fit) < max(LARGE, RESEMBLES * gap):
            bases.insert(0, (restarted(problem, named.fit, named.fit.z), named.fit))
    best: tuple[Hypothesis, LatentForce] | None = None
    for base, motion in bases:
        for force in likely_forces(problem, base, motion)[:CURVES]:
            fitted = _fitted(problem, base, context, force, progress)
            if fitted is None or held_out_gap(problem, fitted.fit) >= gap:
                continue
            progress(f"{fitted.label}: {fitted.log_evidence - null.log_evidence:+.1f} nats")
            if best is None or fitted.log_evidence > best[0].log_evidence:
                best = fitted, force
        if best is not None and not something_left(problem, best[0]):
            break
    if best is not None and something_left(problem, best[0]):
        return polished(problem, best[0], progress), best[1]
    return best


def _fitted(problem: Problem, base: Fit, context: Context, force: LatentForce, progress: Progress) -> Hypothesis | None:
    """The law of a force, from where it was found."""
    begun = tabled_law(context, force, problem.forward.setup(base.z).model)
    if begun is None:
        return None
    law, values = begun
    starts = [(base.z, [{name: size * value for name, value in values.items()}]) for size in STARTS]
    return hypothesis(problem, base, (law,), starts, progress)
