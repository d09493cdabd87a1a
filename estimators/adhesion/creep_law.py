"""The half vehicle of `adhesion.creep_model` with Kalker's linear creep law at a share k of its slope.

The profiles are the nominal ones.

Creep and gravity are told apart by the nominal profile's contact functions: at the shift u = y + r phi - d of a
wheelset on rails that lie at d, gravity pushes it back by 2 N e u (e: change of the contact angle), and the difference
of the rolling radii 2 lambda u makes a longitudinal creepage. d is noise with the shape of ERRI's lateral spectrum
(ERRI B176, 1989). What the linear law leaves out (saturation, a worn profile) is first-order noise on each force and
moment.

States: q (7), v (7), errors of F1, M1, F2, M2 and of the secondary suspension (5), two of the rails under each
wheelset (4).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from estimators.adhesion.creep_model import (
    BODIES,
    COUNT,
    ON_WHEELSETS,
    ROLL_BODIES,
    SECONDARY_FORCE,
    Floating,
    roll_forces,
    suspended,
)
from estimators.filters.discretisation import held_inputs, van_loan
from estimators.filters.track_spectrum import ERRI_LATERAL, TrackSpectrum
from estimators.vehicle.contact import cones, creep_forces, relations, weight, wheelsets
from estimators.vehicle.creep import kalker_slopes
from estimators.vehicle.linear_model import Element, Kinematics, reduce
from estimators.vehicle.plan_view import COORDINATES
from estimators.vehicle.plan_view import RAILS as RAIL_MOTIONS
from estimators.vehicle.suspension import half_vehicle_bogies, masses
from railsim.constants import GRAVITY
from railsim.track.spectra import WC

ERRORS = slice(2 * COUNT, 2 * COUNT + 4)
SECONDARY = 2 * COUNT + 4
RAILS = (2 * COUNT + 5, 2 * COUNT + 7)
STATES = 2 * COUNT + 9
LATERAL = ON_WHEELSETS[::2]


@dataclass(frozen=True)
class LawShaping:
    """Errors of the law as shaped noise: standard deviations, and shares of what the law itself gives."""

    force: float = 250.0  # N
    moment: float = 250.0  # N m
    time: float = 0.3  # s
    secondary: float = 5e2  # N
    secondary_time: float = 0.5  # s
    leak: float = 5.0  # s


@dataclass(frozen=True)
class ForceOutputs:
    """Rows that give forces by the states and inputs: creep forces and moments F1, M1, F2, M2, then gravity's on both.

    Attributes
    ----------
    rows : (6, states). inputs : (6, 8).
    """

    rows: np.ndarray
    inputs: np.ndarray


def with_law(
    p: Mapping[str, float], rate: float, speed: float, share: float, level: float, corner: float, shaping: LawShaping
) -> tuple[Floating, ForceOutputs]:
    """Model at one speed (m/s), share of Kalker's slope and level of the track (1: ERRI low, lateral).

    Parameters
    ----------
    corner : of the high-pass that the channels went through, Hz: the rails' place is known above it only.
    """
    creep, weights, geometry, slopes = [], [], cones(p), kalker_slopes(p, share)
    for wheelset in wheelsets(p, half_vehicle_bogies(p)):
        creep += creep_forces(wheelset, slopes, speed)
        weights += weight(wheelset, geometry, along_axle=True)
    by_creep, by_weight = _by_states(p, creep), _by_states(p, weights)
    by_creep.rows[ON_WHEELSETS, ERRORS] = np.eye(4)
    free = suspended(p)
    forces = by_creep.rows + by_weight.rows
    forces[:, :COUNT] -= free.stiffness
    forces[:, COUNT : 2 * COUNT] -= free.damping
    forces[:, SECONDARY] = SECONDARY_FORCE
    inverse = np.linalg.inv(free.mass)
    by_roll = inverse @ (by_creep.inputs + by_weight.inputs + roll_forces(free))
    model = _discretised(inverse @ forces, by_roll, rate, speed, level, corner, shaping)
    shown = [np.vstack([one[ON_WHEELSETS], other[LATERAL]]) for one, other in zip(by_creep, by_weight, strict=True)]
    return model, ForceOutputs(*shown)


class _ByStates(NamedTuple):
    """Forces (7,) on the coordinates by the states (7, states) and by the rolls and their rates (7, 8)."""

    rows: np.ndarray
    inputs: np.ndarray


def _by_states(p: Mapping[str, float], elements: Sequence[Element]) -> _ByStates:
    """Forces of some elements of the contacts."""
    bogies = half_vehicle_bogies(p)
    moving = Kinematics(COORDINATES, RAIL_MOTIONS, relations(cones(p), wheelsets(p, bogies)))
    reduced = reduce(elements, masses(p, bogies, COORDINATES), moving, reactions=False)
    rows, inputs = np.zeros((COUNT, STATES)), np.zeros((COUNT, 2 * len(ROLL_BODIES)))
    rows[:, :COUNT], rows[:, COUNT : 2 * COUNT] = -reduced.stiffness, -reduced.damping
    rows[:, RAILS] = -reduced.input_stiffness[:, :2]
    for column, part in ((0, reduced.input_stiffness), (len(ROLL_BODIES), reduced.input_damping)):
        inputs[:, column : column + 2] = -part[:, 2:]
    return _ByStates(rows, inputs)


def _discretised(
    acceleration: np.ndarray,
    by_roll: np.ndarray,
    rate: float,
    speed: float,
    level: float,
    corner: float,
    shaping: LawShaping,
) -> Floating:
    continuous = np.zeros((STATES, STATES))
    continuous[:COUNT, COUNT : 2 * COUNT] = np.eye(COUNT)
    continuous[COUNT : 2 * COUNT] = acceleration
    for first in (0, COUNT):
        continuous[first : first + COUNT, first : first + COUNT] -= np.eye(COUNT) / shaping.leak
    continuous[ERRORS, ERRORS] = -np.eye(4) / shaping.time
    continuous[SECONDARY, SECONDARY] = -1.0 / shaping.secondary_time
    drive = np.zeros((STATES, STATES))
    spread = np.zeros(STATES)
    spread[:COUNT], spread[COUNT : 2 * COUNT] = 0.005, 0.05  # m and rad; m/s and rad/s
    spread[ERRORS] = [shaping.force, shaping.moment] * 2
    spread[SECONDARY] = shaping.secondary
    start = np.diag(spread**2)
    for state in [*range(ERRORS.start, ERRORS.stop), SECONDARY]:
        time = shaping.time if state != SECONDARY else shaping.secondary_time
        drive[state, state] = 2.0 / time * spread[state] ** 2
    rails = TrackSpectrum(level * ERRI_LATERAL.amplitude, 0, (2.0 * np.pi * corner / speed, WC))
    for state in RAILS:
        both = slice(state, state + 2)
        continuous[both, both] = rails.matrix * speed
        drive[both, both] = rails.intensity * speed
        start[both, both] = rails.stationary()
    inputs = np.zeros((STATES, by_roll.shape[1]))
    inputs[COUNT : 2 * COUNT] = by_roll
    for column, name in enumerate(ROLL_BODIES):
        inputs[COUNT + BODIES[name][0], column] -= GRAVITY
    A, Q = van_loan(continuous, drive, 1.0 / rate)
    return Floating(A, Q, held_inputs(continuous, inputs, 1.0 / rate), acceleration, by_roll, start)
