"""Half vehicle in plan view that floats on its contacts: what the rails do to a wheelset are unknown inputs.

Ward et al. (2011), section 4.2: net lateral force and net yaw moment of each wheelset, all else rigid bodies and the
nominal suspension. States: lateral places and yaws q (7), their rates v (7), forces f = F1, M1, F2, M2 of the rails on
the wheelsets, and an error S of the secondary suspension's lateral force, each first-order shaped noise:

    q' = v - q / T,   M v' = -C v - K q + E f + e S + roll terms,   f' = -f / t + w

The shaping may add other unknown forces (`estimators.adhesion.force_budget`), each a state more.

T, a leak much longer than the motions that matter, keeps the place of the whole vehicle, which nothing measures, from
growing without bound. Rolls are known inputs: measured roll rates, integrated. A roll tilts an accelerometer, so that
it shows y'' + g roll, and moves the ends of the springs sideways, which do not stand at the bodies' centres.
Forces are along the axle (the tilted frame), so that a load that leans with the vehicle is no force.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from estimators.filters.discretisation import held_inputs, van_loan
from estimators.vehicle.lateral_frequency import is_whole
from estimators.vehicle.linear_model import Kinematics, Reduced, reduce
from estimators.vehicle.parameters import numbers
from estimators.vehicle.plan_view import COORDINATES, NEEDED, suspension
from estimators.vehicle.suspension import half_vehicle_bogies, heights, masses
from railsim.constants import GRAVITY

COUNT = len(COORDINATES)
FORCES = slice(2 * COUNT, 2 * COUNT + 4)
SECONDARY = 2 * COUNT + 4
HEIGHTS = ("bogie_height", "body_height", "secondary_height")
ROLL_BODIES = ("wheelset1", "wheelset2", "bogie", "body")
BODIES: Mapping[str, tuple[int, int | None]] = {
    name: (COORDINATES.index(f"{name}.y"), None if name == "body" else COORDINATES.index(f"{name}.yaw"))
    for name in ROLL_BODIES
}
"""Coordinates of each body: lateral position, yaw."""
ON_WHEELSETS = [COORDINATES.index(f"wheelset{number}.{axis}") for number in (1, 2) for axis in ("y", "yaw")]
"""Coordinates on which F1, M1, F2, M2 act."""
SECONDARY_FORCE = Kinematics(COORDINATES).row({"bogie.y": 1.0, "body.y": -1.0})[0]
"""Generalised forces (7,) of the error S."""


@dataclass(frozen=True)
class Shaping:
    """Unknown inputs as shaped noise: standard deviations and correlation times."""

    force: float = 5e3  # N, of a wheelset in ordinary running on dry rails
    moment: float = 5e3  # N m
    secondary: float = 5e2  # N, error of the secondary suspension's force
    time: float = 0.1  # s, of force and moment
    secondary_time: float = 0.5  # s
    leak: float = 5.0  # s
    others: "tuple[UnknownForce, ...]" = ()


class UnknownForce(NamedTuple):
    """A force that the nominal vehicle does not give, as first-order noise.

    Attributes
    ----------
    direction : generalised forces by one newton or newton metre of it, (7,). std : N or N m. time : correlation, s.
    within : which of F1, M1, F2, M2 it acts beside and cannot be told from; None where what moves tells.
    """

    direction: np.ndarray
    std: float
    time: float
    within: int | None = None


@dataclass(frozen=True)
class Floating:
    """The model at one sample rate.

    Attributes
    ----------
    A : transition, (states, states); 19 states, and one for each of the shaping's `others`.
    Q : covariance of a step, (states, states).
    B : of the inputs (rolls of `ROLL_BODIES`, then their rates) held over a step, (states, 8).
    acceleration : rows of v' for the states, (7, states); acceleration_input : the same for the inputs, (7, 8), without
        gravity's share, as an accelerometer shows it.
    start : covariance at the start, (states, states).
    """

    A: np.ndarray
    Q: np.ndarray
    B: np.ndarray
    acceleration: np.ndarray
    acceleration_input: np.ndarray
    start: np.ndarray


def needed_parameters(vehicle: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of the nominal parameters that the model needs; of a whole vehicle also where its bogies are."""
    return (*NEEDED, *HEIGHTS, *(("semi_bogie_spacing",) if is_whole(vehicle) else ()))


def parameters(vehicle: Mapping[str, Any]) -> dict[str, float]:
    """Nominal parameters that the model needs.

    Raises
    ------
    InputError : one is missing.
    """
    return numbers(vehicle, needed_parameters(vehicle))


def floating(p: Mapping[str, float], rate: float, shaping: Shaping) -> Floating:
    """The model for samples at `rate` Hz."""
    free = suspended(p)
    inverse = np.linalg.inv(free.mass)
    unknown = _unknown_forces(shaping)
    states = 2 * COUNT + len(unknown)
    acceleration = np.zeros((COUNT, states))
    acceleration[:, :COUNT] = -inverse @ free.stiffness
    acceleration[:, COUNT : 2 * COUNT] = -inverse @ free.damping
    acceleration[:, 2 * COUNT :] = inverse @ np.stack([one.direction for one in unknown], axis=1)
    by_roll = inverse @ roll_forces(free)
    continuous = np.zeros((states, states))
    continuous[:COUNT, COUNT : 2 * COUNT] = np.eye(COUNT)
    continuous[:COUNT, :COUNT] = -np.eye(COUNT) / shaping.leak
    continuous[COUNT : 2 * COUNT] = acceleration
    continuous[COUNT : 2 * COUNT, COUNT : 2 * COUNT] -= np.eye(COUNT) / shaping.leak
    drive = np.zeros((states, states))
    for state, one in enumerate(unknown, 2 * COUNT):
        continuous[state, state] = -1.0 / one.time
        drive[state, state] = 2.0 / one.time * one.std**2
    inputs = np.zeros((states, 2 * len(ROLL_BODIES)))
    inputs[COUNT : 2 * COUNT] = by_roll
    for column, name in enumerate(ROLL_BODIES):
        inputs[COUNT + BODIES[name][0], column] -= GRAVITY
    A, Q = van_loan(continuous, drive, 1.0 / rate)
    start = np.array([0.005] * COUNT + [0.05] * COUNT + [one.std for one in unknown])
    return Floating(A, Q, held_inputs(continuous, inputs, 1.0 / rate), acceleration, by_roll, np.diag(start**2))


def _unknown_forces(shaping: Shaping) -> list[UnknownForce]:
    """F1, M1, F2, M2, S and the shaping's others, in the order of the states."""
    sizes = [shaping.force, shaping.moment] * 2
    rails = [
        UnknownForce(np.eye(COUNT)[coordinate], size, shaping.time)
        for coordinate, size in zip(ON_WHEELSETS, sizes, strict=True)
    ]
    secondary = UnknownForce(SECONDARY_FORCE, shaping.secondary, shaping.secondary_time)
    return [*rails, secondary, *shaping.others]


def suspended(p: Mapping[str, float]) -> Reduced:
    """Plan view without contacts, springs at their heights; the rolls of `ROLL_BODIES` are given."""
    elements, bogies = suspension(p, heights(p)), half_vehicle_bogies(p)
    moving = Kinematics(COORDINATES, [f"{name}.roll" for name in ROLL_BODIES])
    return reduce(elements, masses(p, bogies, COORDINATES), moving)


def roll_forces(free: Reduced) -> np.ndarray:
    """Generalised forces (7, 8) by the rolls and roll rates of `ROLL_BODIES`: springs that do not stand at centres."""
    return -np.hstack([free.input_stiffness, free.input_damping])
