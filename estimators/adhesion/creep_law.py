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

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from estimators.adhesion.creep_model import BODIES, COUNT, ROLL_BODIES, Floating, roll_forces, shape_row
from estimators.filters.discretisation import held_inputs, van_loan
from estimators.filters.track_spectrum import CORNERS, Prior
from estimators.vehicle.plan_view import BODY, BOGIE, Y1, Y2, YAW1, YAW2, matrices
from railsim.constants import GRAVITY
from railsim.contact.linear import creep_coefficients

ERRORS = slice(2 * COUNT, 2 * COUNT + 4)
SECONDARY = 2 * COUNT + 4
RAILS = (2 * COUNT + 5, 2 * COUNT + 7)
STATES = 2 * COUNT + 9
LEVEL = 2.119e-7 * CORNERS[1] ** 2  # ERRI low, lateral, over the product of the corners' factors
WHEELS = ((Y1, YAW1), (Y2, YAW2))


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
class Contact:
    """Rows that give forces by the states and inputs: creep forces and moments F1, M1, F2, M2, then gravity's on both.

    Attributes
    ----------
    rows : (6, states). inputs : (6, 8).
    """

    rows: np.ndarray
    inputs: np.ndarray


def with_law(
    p: Mapping[str, float], rate: float, speed: float, share: float, level: float, corner: float, shaping: LawShaping
) -> tuple[Floating, Contact]:
    """Model at one speed (m/s), share of Kalker's slope and level of the track (1: ERRI low, lateral).

    Parameters
    ----------
    corner : of the high-pass that the channels went through, Hz: the rails' place is known above it only.
    """
    mass, damping, stiffness, rail, roll, roll_rate = matrices(p, speed, share)
    spin = _spin_stiffness(p, share)
    for number, (y, _) in enumerate(WHEELS):
        stiffness[y, y] -= spin
        rail[y, number] -= spin
        roll[y, number] += spin * p["wheel_radius"]
    free = {**p, "design_conicity": 0.0, "design_contact_angle_rate": 0.0}
    _, bare_damping, bare_stiffness, *_ = matrices(free, speed, 0.0)
    inverse = np.linalg.inv(mass)
    for number, (y, _) in enumerate(WHEELS):
        roll[y, number] += 2.0 * p["design_wheel_load"]  # a load that leans is no force
    contact = np.zeros((COUNT, STATES))
    contact[:, :COUNT], contact[:, COUNT : 2 * COUNT] = bare_stiffness - stiffness, bare_damping - damping
    for number, place in enumerate(RAILS):
        contact[:, place] = rail[:, number]
    contact[[Y1, YAW1, Y2, YAW2], ERRORS] = np.eye(4)
    inputs = np.zeros((COUNT, 2 * len(ROLL_BODIES)))
    inputs[:, :2], inputs[:, len(ROLL_BODIES) : len(ROLL_BODIES) + 2] = roll, roll_rate
    forces = contact.copy()
    forces[:, :COUNT] -= bare_stiffness
    forces[:, COUNT : 2 * COUNT] -= bare_damping
    forces[:, SECONDARY] = shape_row({BOGIE: 1.0, BODY: -1.0})
    acceleration = inverse @ forces
    seen = inverse @ (inputs + roll_forces(p))
    model = _discretised(acceleration, seen, rate, speed, level, corner, shaping)
    return model, _contact(p, contact, inputs)


def _spin_stiffness(p: Mapping[str, float], share: float) -> float:
    """Lateral force by spin over the shift, N/m: a wheelset aside rolls on contacts turned by e u (Wickens 2003)."""
    across, load = p["design_contact_curvature"], p["design_wheel_load"]
    f23 = creep_coefficients(1.0 / p["wheel_radius"], across, load, share).f23
    return 2.0 * f23 * p["design_contact_angle_rate"] / p["wheel_radius"]


def _contact(p: Mapping[str, float], contact: np.ndarray, inputs: np.ndarray) -> Contact:
    """Creep alone: the contact's forces less gravity's, 2 N e u."""
    lateral = 2.0 * p["design_wheel_load"] * p["design_contact_angle_rate"]
    turning = 2.0 * p["design_wheel_load"] * p["half_gauge"] * p["design_conicity"]
    rows, direct = np.zeros((6, STATES)), np.zeros((6, inputs.shape[1]))
    for number, (y, yaw) in enumerate(WHEELS):
        gravity, leaning = rows[4 + number], direct[4 + number]
        gravity[y], gravity[RAILS[number]], leaning[number] = -lateral, lateral, -lateral * p["wheel_radius"]
        rows[2 * number], direct[2 * number] = contact[y] - gravity, inputs[y] - leaning
        rows[2 * number + 1], direct[2 * number + 1] = contact[yaw], inputs[yaw]
        rows[2 * number + 1, yaw] -= turning
    return Contact(rows, direct)


def _discretised(
    acceleration: np.ndarray,
    seen: np.ndarray,
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
    for place in [*range(ERRORS.start, ERRORS.stop), SECONDARY]:
        time = shaping.time if place != SECONDARY else shaping.secondary_time
        drive[place, place] = 2.0 / time * spread[place] ** 2
    rails = Prior(level * LEVEL, (2.0 * np.pi * corner / speed, CORNERS[1]))
    for place in RAILS:
        both = slice(place, place + 2)
        continuous[both, both] = rails.matrix * speed
        drive[both, both] = rails.intensity * speed
        start[both, both] = rails.stationary()
    inputs = np.zeros((STATES, seen.shape[1]))
    inputs[COUNT : 2 * COUNT] = seen
    for column, name in enumerate(ROLL_BODIES):
        inputs[COUNT + BODIES[name][0], column] -= GRAVITY
    A, Q = van_loan(continuous, drive, 1.0 / rate)
    return Floating(A, Q, held_inputs(continuous, inputs, 1.0 / rate), acceleration, seen, start)
