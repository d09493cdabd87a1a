"""Force laws without a name: at each place between two bodies a force over how far the place opens, or over how fast.

The force is a sum of polynomials, each of mean 0 and rms 1 over the states that the nominal model takes, and none of
them along another; beyond these states it is held (force-state mapping, Masri and Caughey 1979, Journal of Applied
Mechanics 46). A latent force has the same power in every frame and no phase; a law knows when it pushes and which way,
so that a fraction of its force is enough to tell it.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.core.model import Coordinate, Effect
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.railway.answers import Place, opened_by
from experiments.discrepancy.railway.record import DROPPED
from experiments.discrepancy.railway.system import Railway
from railsim.effects.empirical_force import EmpiricalForce
from railsim.effects.interface import Effect as Plugin
from railsim.truth import HeldTruth

TERMS = 4  # polynomials of a law
POINTS = 65  # of its table
DISPLACEMENT, VELOCITY = STATES = ("displacement", "velocity")
ANY = 1e3  # m/s, m: ends of the axis on which a law does not depend


@dataclass(frozen=True, eq=False)
class Law:
    """How a law is made from the factors of its polynomials: `forces` (TERMS, POINTS) [N or N m] over `states`
    (POINTS,) of `state`, of each factor 1; `row`: how far the place opens with each channel of truth.
    """

    place: Place
    row: Mapping[str, float]
    state: str
    states: np.ndarray
    forces: np.ndarray

    def force(self, values: np.ndarray) -> np.ndarray:
        """(POINTS,) by which the law opposes the opening."""
        return np.asarray(values) @ self.forces

    def acting(self, values: np.ndarray, truth: HeldTruth) -> np.ndarray:
        """(n,) force on the upper body in a run [N or N m]."""
        return -np.interp(states_of(self.row, truth)[self.state], self.states, self.force(values))

    def make(self, values: np.ndarray) -> Plugin:
        """The effect with these factors.

        Raises
        ------
        InputError : a value is not finite.
        """
        force = [float(one) for one in self.force(values)]
        along, ends = [float(one) for one in self.states], [-ANY, ANY]
        displacement, velocity = (along, ends) if self.state == DISPLACEMENT else (ends, along)
        rows = [[one, one] for one in force] if self.state == DISPLACEMENT else [force, force]
        return EmpiricalForce.build({
            "upper": self.place.upper, "lower": self.place.lower, "axis": self.place.axis, "position": self.place.at,
            "displacement": displacement, "velocity": velocity, "force": rows,
        })  # fmt: skip


def states_of(row: Mapping[str, float], truth: HeldTruth) -> dict[str, np.ndarray]:
    """(n,) how far a place opens in a run [m or rad], and how fast."""
    opened = sum((factor * truth[name] for name, factor in row.items()), np.zeros(1))
    return dict(zip(STATES, (opened, np.gradient(opened, 1.0 / truth.rate)), strict=True))


def laws(system: Railway) -> Iterator[tuple[Effect, Law]]:
    """Of every place between two bodies, over both states; `shown` by linear answers of the nominal model."""
    truth, simulated, record = system.simulated.nominal_truth, system.simulated, system.record
    shown = simulated.shown(simulated.nominal, 0.0)
    if truth is None or shown is None:
        return
    spread = Policy.unknown_median / math.sqrt(TERMS)
    own = tuple(Coordinate(f"term {k + 1}", "of what acts there", 0.0, spread) for k in range(TERMS))
    joints = [(number, one) for number, one in enumerate(system.answers[0].places) if one.lower]
    for number, place in joints:
        scale = float(np.std(record.course(system.answers[0].acting(place, shown.acting))))
        row = opened_by(simulated.nominal.model, place)
        for state, values in states_of(row, truth).items():
            shapes = _shapes(values[round(DROPPED * truth.rate) :])
            if shapes is None or not scale:
                continue
            law = Law(place, row, state, shapes[0], scale * shapes[1])
            pushes = [law.acting(spread * one, truth) for one in np.eye(TERMS)]
            frames = np.stack([record.modelled(one, truth.rate) for one in pushes])
            changes = tuple(
                (frames[:, :, part, None] * answers.forces[None, :, None, :, number]).astype(np.complex64)
                for answers, part in zip(system.answers, record.sections, strict=True)
            )
            name = f"unknown: {place.name} over its {state}"
            yield Effect(name, name, own=own, place=place.name, kind="law", shown=changes), law


def _shapes(values: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """States (POINTS,) of a table, and polynomials (TERMS, POINTS) there, by the samples of a state; None where it does
    not move.
    """
    middle, spread = float(values.mean()), float(values.std())
    if not spread > 0.0:
        return None
    scaled = (values - middle) / spread
    powers = np.vander(scaled, TERMS + 1, increasing=True)
    _, upper = np.linalg.qr(powers / math.sqrt(len(values)))
    low, high = float(scaled.min()), float(scaled.max())
    at = np.linspace(low, high, POINTS)
    return middle + spread * at, np.linalg.solve(upper.T, np.vander(at, TERMS + 1, increasing=True).T)[1:]
