"""An effect without a name: the latent force's curve as a tabulated law, which is fitted and runs like any other."""

from collections.abc import Sequence

import numpy as np

from experiments.discrepancy.candidates import Candidate, Context
from experiments.discrepancy.decide import held_out_gap
from experiments.discrepancy.fitting import Problem
from experiments.discrepancy.hypothesis import Hypothesis, Tell, hypothesis
from experiments.discrepancy.latent import LatentForce
from railsim import effects as library
from railsim.effects.interface import Effect
from railsim.model import Model
from railsim.registry import discover

STARTS = (0.7, 1.5)  # of the curve, which the smoother shrinks
LAW = "empirical_force"  # the effect that takes a table
OUTSIDE = "track"  # its name for what is no body
FOLLOWING = 0.05  # share of the force's variance that a curve must have to be tried


def empirical_candidate(context: Context, force: LatentForce, model: Model) -> Candidate | None:
    """The table of a latent force; None where its curve says nothing."""
    kind = discover(library, Effect).get(LAW)
    if kind is None or len(force.curve) < 4 or force.follows < FOLLOWING:
        return None
    state, values = force.curve[:, 0], -force.curve[:, 1]  # the law opposes the movement
    kept = np.concatenate([[True], np.diff(state) > 1e-12 * max(float(np.ptp(state)), 1e-30)])
    state, values = state[kept], values[kept] - float(np.interp(0.0, state[kept], values[kept]))
    wide = 10.0 * float(np.abs(state).max())
    if "velocity" in force.state:
        displacement, velocity = (-1.0, 1.0), tuple(state.tolist())
        table = (tuple(values.tolist()),) * 2
    else:
        displacement, velocity = tuple(state.tolist()), (-wide, wide)
        table = tuple((float(value),) * 2 for value in values)
    joint = next((e for e in model.elements if {e.upper, e.lower} == {force.place.upper, force.place.lower}), None)
    own = model.bodies[model.index(force.place.upper)].position
    choices = (
        ("upper", force.place.upper),
        ("lower", force.place.lower or OUTSIDE),
        ("axis", force.place.direction),
        ("position", tuple(joint.position) if joint else own),
        ("displacement", displacement),
        ("velocity", velocity),
        ("force", table),
    )
    return Candidate(kind, context, choices)


def fit_empirical(
    problem: Problem, null: Hypothesis, context: Context, forces: Sequence[LatentForce], tell: Tell
) -> Hypothesis | None:
    """The best of the places' tables, fitted with all nuisances; None where none helps."""
    setup = problem.forward.setup(null.fit.z)
    found = []
    for force in forces:
        candidate = empirical_candidate(context, force, setup.model)
        if candidate is not None:
            starts = [(null.fit.z, [{"scale": size}]) for size in STARTS]
            fitted = hypothesis(problem, null.fit, (candidate,), starts, tell)
            if fitted is not None and held_out_gap(problem, fitted.fit) < held_out_gap(problem, null.fit):
                found.append(fitted)
                tell(f"empirical {force.place.label}: {fitted.log_evidence - null.log_evidence:+.1f} nats")
    return max(found, key=lambda one: one.log_evidence, default=None)
