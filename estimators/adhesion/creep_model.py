"""Half vehicle in plan view that floats on its contacts: what the rails do to a wheelset are unknown inputs.

Ward et al. (2011), section 4.2: net lateral force and net yaw moment of each wheelset, all else rigid bodies and the
nominal suspension. States: lateral places and yaws q (7), their rates v (7), forces f = F1, M1, F2, M2 of the rails on
the wheelsets, and an error S of the secondary suspension's lateral force, each first-order shaped noise:

    q' = v - q / T,   M v' = -C v - K q + E f + e S + roll terms,   f' = -f / t + w

T, a leak much longer than the motions that matter, keeps the place of the whole vehicle, which nothing measures, from
growing without bound. Rolls are known inputs: measured roll rates, integrated. A roll tilts an accelerometer, so that
it shows y'' + g roll, and moves the ends of the springs sideways, which do not stand at the bodies' centres.
Forces are along the axle (the tilted frame), so that a load that leans with the vehicle is no force.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimators.filters.discretisation import held_inputs, van_loan
from estimators.vehicle.plan_view import BODY, BOGIE, BOGIE_YAW, NEEDED, Y1, Y2, YAW1, YAW2, matrices
from railsim.constants import GRAVITY
from railsim.errors import InputError

COUNT = 7
FORCES = slice(2 * COUNT, 2 * COUNT + 4)
SECONDARY = 2 * COUNT + 4
STATES = 2 * COUNT + 5
HEIGHTS = ("bogie_height", "body_height", "secondary_height")
ROLL_BODIES = ("wheelset1", "wheelset2", "bogie", "body")
BODIES: Mapping[str, tuple[int, int | None]] = {
    "wheelset1": (Y1, YAW1),
    "wheelset2": (Y2, YAW2),
    "bogie": (BOGIE, BOGIE_YAW),
    "body": (BODY, None),
}
"""Coordinates of each body: lateral place, yaw."""


@dataclass(frozen=True)
class Shaping:
    """Unknown inputs as shaped noise: standard deviations and correlation times."""

    force: float = 5e3  # N, of a wheelset in ordinary running on dry rails
    moment: float = 5e3  # N m
    secondary: float = 5e2  # N, error of the secondary suspension's force
    time: float = 0.1  # s, of force and moment
    secondary_time: float = 0.5  # s
    leak: float = 5.0  # s


@dataclass(frozen=True)
class Floating:
    """The model at one sample rate.

    Attributes
    ----------
    A : transition, (19, 19). Q : covariance of a step, (19, 19).
    B : of the inputs (rolls of `ROLL_BODIES`, then their rates) held over a step, (19, 8).
    acceleration : rows of v' for the states, (7, 19); acceleration_input : the same for the inputs, (7, 8), without
        gravity's share, as an accelerometer shows it.
    start : covariance at the start, (19, 19).
    """

    A: np.ndarray
    Q: np.ndarray
    B: np.ndarray
    acceleration: np.ndarray
    acceleration_input: np.ndarray
    start: np.ndarray


def parameters(vehicle: Mapping[str, Any]) -> dict[str, float]:
    """Nominal parameters that the model needs.

    Raises
    ------
    InputError : one is missing.
    """
    for name in (*NEEDED, *HEIGHTS):
        if not isinstance(vehicle.get(name), int | float):
            raise InputError(
                f"vehicle parameter '{name}' is {vehicle.get(name)!r}; about.json must give a number in SI"
            )
    return {name: float(value) for name, value in vehicle.items() if isinstance(value, int | float)}


def floating(p: Mapping[str, float], rate: float, shaping: Shaping) -> Floating:
    """The model for samples at `rate` Hz."""
    free = {**p, "design_conicity": 0.0, "design_contact_angle_rate": 0.0}
    mass, damping, stiffness, *_ = matrices(free, 1.0, 0.0)
    inverse = np.linalg.inv(mass)
    acceleration = np.zeros((COUNT, STATES))
    acceleration[:, :COUNT] = -inverse @ stiffness
    acceleration[:, COUNT : 2 * COUNT] = -inverse @ damping
    acceleration[:, FORCES] = inverse[:, [Y1, YAW1, Y2, YAW2]]
    acceleration[:, SECONDARY] = inverse @ shape_row({BOGIE: 1.0, BODY: -1.0})
    seen = inverse @ roll_forces(p)
    continuous = np.zeros((STATES, STATES))
    continuous[:COUNT, COUNT : 2 * COUNT] = np.eye(COUNT)
    continuous[:COUNT, :COUNT] = -np.eye(COUNT) / shaping.leak
    continuous[COUNT : 2 * COUNT] = acceleration
    continuous[COUNT : 2 * COUNT, COUNT : 2 * COUNT] -= np.eye(COUNT) / shaping.leak
    continuous[FORCES, FORCES] = -np.eye(4) / shaping.time
    continuous[SECONDARY, SECONDARY] = -1.0 / shaping.secondary_time
    inputs = np.zeros((STATES, 2 * len(ROLL_BODIES)))
    inputs[COUNT : 2 * COUNT] = seen
    for column, name in enumerate(ROLL_BODIES):
        inputs[COUNT + BODIES[name][0], column] -= GRAVITY
    A, Q = van_loan(continuous, np.diag(_intensity(shaping)), 1.0 / rate)
    return Floating(A, Q, held_inputs(continuous, inputs, 1.0 / rate), acceleration, seen, _start(shaping))


def shape_row(places: Mapping[int, float]) -> np.ndarray:
    """A row over the coordinates from its entries."""
    row = np.zeros(COUNT)
    for place, value in places.items():
        row[place] = value
    return row


def roll_forces(p: Mapping[str, float]) -> np.ndarray:
    """Generalised forces (7, 8) by the rolls and roll rates of `ROLL_BODIES`: springs that do not stand at centres."""
    below = p["bogie_height"] - p["wheel_radius"]
    above = p["secondary_height"] - p["bogie_height"]
    under = p["body_height"] - p["secondary_height"]
    forces = np.zeros((COUNT, 2 * len(ROLL_BODIES)))
    for kind, offset in (("stiffness", 0), ("damping", len(ROLL_BODIES))):
        bogie, body = ROLL_BODIES.index("bogie") + offset, ROLL_BODIES.index("body") + offset
        primary, secondary = 2.0 * p[f"primary_lateral_{kind}"], 2.0 * p[f"secondary_lateral_{kind}"]
        forces[:, bogie] += primary * below * shape_row({Y1: 1.0, Y2: 1.0, BOGIE: -2.0})
        forces[:, bogie] += secondary * above * shape_row({BOGIE: 1.0, BODY: -1.0})
        forces[:, body] += secondary * under * shape_row({BOGIE: 1.0, BODY: -1.0})
    return forces


def _intensity(shaping: Shaping) -> np.ndarray:
    """Density of the noise that drives the states, diagonal."""
    drive = np.zeros(STATES)
    drive[FORCES] = 2.0 / shaping.time * np.array([shaping.force, shaping.moment] * 2) ** 2
    drive[SECONDARY] = 2.0 / shaping.secondary_time * shaping.secondary**2
    return drive


def _start(shaping: Shaping) -> np.ndarray:
    spread = np.zeros(STATES)
    spread[:COUNT] = 0.005  # m, rad: within the flange clearance
    spread[COUNT : 2 * COUNT] = 0.05  # m/s, rad/s
    spread[FORCES] = [shaping.force, shaping.moment] * 2
    spread[SECONDARY] = shaping.secondary
    return np.diag(spread**2)
