"""An effect without a name: a force law tabled over the state it follows, from the latent force's curve.

Its points are fitted, and it runs, like any other effect.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.candidates import Candidate, Context
from experiments.discrepancy.decide import held_out_gap
from experiments.discrepancy.fitting import Problem
from experiments.discrepancy.hypothesis import Hypothesis, Tell, hypothesis
from experiments.discrepancy.latent import LatentForce
from railsim import effects as library
from railsim.effects.interface import Effect, Parameter, Prior
from railsim.model import Model
from railsim.registry import discover

STARTS = (0.7, 1.5)  # of the curve, which the smoother shrinks
LAW = "empirical_force"  # the effect that takes a table
OUTSIDE = "track"  # its name for what is no body
POINTS = 7  # of a table
REACH = 4.0  # times the curve's largest force, that a point may be
LEAST_FOLLOWED = 0.02  # share of the force's variance that a curve must have to be tried


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
        far, prior = REACH * self.size, Prior(0.0, self.size)
        one = Parameter("N or N m", -far, far, 0.0, 0.0, 0.1 * self.size, prior)
        return {f"force{number}": one for number in range(len(self.states))}

    def build(self, values: Mapping[str, float]) -> Effect:
        """The table with these values."""
        force = [float(values[f"force{number}"]) for number in range(len(self.states))]
        wide = 10.0 * max(abs(self.states[0]), abs(self.states[-1]), 1.0)
        if self.velocity:
            table = {"displacement": (-wide, wide), "velocity": self.states, "force": (tuple(force),) * 2}
        else:
            table = {"displacement": self.states, "velocity": (-wide, wide), "force": tuple((f, f) for f in force)}
        return self.kind.build({**dict(self.choices), **table, "scale": 1.0})


def tabled_law(context: Context, force: LatentForce, model: Model) -> tuple[TabledLaw, dict[str, float]] | None:
    """The law of a latent force and its values by the smoother; None where its curve says nothing."""
    kind = discover(library, Effect).get(LAW)
    if kind is None or len(force.curve) < POINTS or force.follows < LEAST_FOLLOWED:
        return None
    states = np.linspace(force.curve[0, 0], force.curve[-1, 0], POINTS)
    if np.diff(states).min() <= 0.0:
        return None
    values = -np.interp(states, force.curve[:, 0], force.curve[:, 1])  # the law opposes the movement
    joint = next((e for e in model.elements if {e.upper, e.lower} == {force.place.upper, force.place.lower}), None)
    own = model.bodies[model.index(force.place.upper)].position
    choices = (
        ("upper", force.place.upper),
        ("lower", force.place.lower or OUTSIDE),
        ("axis", force.place.direction),
        ("position", tuple(joint.position) if joint else own),
    )
    size = 2.0 * float(np.abs(values).max())
    if not 0.0 < size < math.inf:
        return None
    law = TabledLaw(kind, context, choices, tuple(states.tolist()), "velocity" in force.state, size)
    return law, {f"force{number}": float(value) for number, value in enumerate(values)}


def fit_empirical(
    problem: Problem, null: Hypothesis, context: Context, forces: Sequence[LatentForce], tell: Tell
) -> tuple[Hypothesis, LatentForce] | None:
    """The best of the places' laws, fitted with all nuisances, and where it acts; None where none helps."""
    setup = problem.forward.setup(null.fit.z)
    found: list[tuple[Hypothesis, LatentForce]] = []
    for force in forces:
        begun = tabled_law(context, force, setup.model)
        if begun is None:
            continue
        law, values = begun
        starts = [(null.fit.z, [{name: size * value for name, value in values.items()}]) for size in STARTS]
        fitted = hypothesis(problem, null.fit, (law,), starts, tell)
        if fitted is not None and held_out_gap(problem, fitted.fit) < held_out_gap(problem, null.fit):
            found.append((fitted, force))
            tell(f"{law.label}: {fitted.log_evidence - null.log_evidence:+.1f} nats")
    return max(found, key=lambda one: one[0].log_evidence, default=None)
