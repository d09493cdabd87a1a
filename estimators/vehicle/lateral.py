"""Lateral half vehicle of the suspension estimators: wheelsets, bogie and body, linear, on nominal parameters only.

`vehicle.plan_view` gives wheelsets, bogie and body sideways and in yaw (Wickens 2003; Ward et al. 2011, (16) and (17));
here bogie and body roll too, because their suspensions stand above and below their centres of gravity, and an
accelerometer shows g times the roll. A wheelset that stands aside by u on wheels of contact angle delta rolls by delta
u / l more than the rails (Wickens 2003). With x = [q, q'] and the track's input w,

    x' = A x + B w,   y = C x + D w,   A = A0 + C_sy A1 + C_spsi A2 + conicity A3, B, C and D alike:

every matrix is affine in the three parameters that are estimated. C_sy is the lateral damping between bogie and body
(both dampers), C_spsi that against yaw (both dampers, 2 c b^2), as in Fig. 6 of Ward et al. (2011).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimators.vehicle.plan_view import BOGIE, BOGIE_YAW, NEEDED, ROLL, Y1, Y2, YAW1, YAW2, Shares, matrices, slopes
from railsim.constants import GRAVITY
from railsim.errors import InputError

BODY, BOGIE_ROLL, BODY_ROLL = 6, 7, 8
DEGREES = 9
STATES = 2 * DEGREES
MORE = ("body_height", "bogie_height", "secondary_height", "wheelset_spin_inertia")
PARAMETERS = ("secondary_lateral_damping [N s/m]", "secondary_yaw_damping [N m s/rad]", "conicity [-]")
INPUTS = ("lateral 1", "lateral 2", "roll 1", "roll 2", "roll rate 1", "roll rate 2", "side rate 1", "side rate 2")
"""Rails under the leading (1) and trailing wheelset: position to the left, m; roll to the left side up, rad, rad/s;
speed of the first, m/s."""

FULL = (
    "wheelset1.acceleration_y [m/s2]",
    "wheelset1.rate_yaw [rad/s]",
    "wheelset2.acceleration_y [m/s2]",
    "wheelset2.rate_yaw [rad/s]",
    "bogie.acceleration_y [m/s2]",
    "bogie.rate_yaw [rad/s]",
    "body.acceleration_y [m/s2]",
)
"""The paper's full set: lateral acceleration and yaw rate of all that moves sideways."""
WITHOUT_WHEELSETS = FULL[4:]
"""The reduced set: bogie and body."""
PLACES = {"wheelset1": (Y1, YAW1), "wheelset2": (Y2, YAW2), "bogie": (BOGIE, BOGIE_YAW), "body": (BODY, BODY)}


@dataclass(frozen=True)
class HalfVehicle:
    """Matrices of x' = A x + B w, y = C x + D w; first index: constant, then one for each of `PARAMETERS`.

    Attributes
    ----------
    A, B, C, D : shapes (4, 18, 18), (4, 18, 8), (4, m, 18), (4, m, 8).
    force : accelerations that unit forces and moments on the nine degrees of freedom give, shape (18, 9).
    felt : the same in the readings, shape (m, 9).
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    force: np.ndarray
    felt: np.ndarray

    def at(self, parameters: Sequence[float] | np.ndarray) -> tuple[np.ndarray, ...]:
        """A, B, C, D for given parameters, in the order of `PARAMETERS`."""
        weights = np.array([1.0, *parameters])
        return tuple(np.tensordot(weights, one, axes=1) for one in (self.A, self.B, self.C, self.D))


def fits(vehicle: Mapping[str, Any]) -> bool:
    """Whether about.json gives all parameters."""
    return all(isinstance(vehicle.get(name), int | float) for name in NEEDED + ROLL + MORE)


def nominal(vehicle: Mapping[str, Any]) -> np.ndarray:
    """`PARAMETERS` of the vehicle as it was built, shape (3,)."""
    turn = 2.0 * float(vehicle.get("yaw_damper_damping", 0.0)) * float(vehicle.get("yaw_damper_half_spacing", 0.0)) ** 2
    return np.array([2.0 * float(vehicle["secondary_lateral_damping"]), turn, float(vehicle["design_conicity"])])


def half_vehicle(vehicle: Mapping[str, Any], speed: float, channels: Sequence[str], creep: Shares) -> HalfVehicle:
    """Build the matrices.

    Parameters
    ----------
    vehicle : nominal parameters by field name, SI units.
    speed : m/s.
    channels : what is measured, names out of `FULL`.
    creep : share of Kalker's coefficients, or one each of f11, f22 and f23.

    Raises
    ------
    InputError : a parameter of the vehicle is missing.
    """
    for name in NEEDED + ROLL + MORE:
        if not isinstance(vehicle.get(name), int | float):
            raise InputError(
                f"vehicle parameter '{name}' is {vehicle.get(name)!r}; about.json must give it in SI units"
            )
    p = {name: float(value) for name, value in vehicle.items() if isinstance(value, int | float)}
    base = {**p, "secondary_lateral_damping": 0.0, "yaw_damper_damping": 0.0, "design_conicity": 0.0}
    zero = _mechanics(base, speed, creep)
    ends = (
        {"secondary_lateral_damping": 0.5},
        {"yaw_damper_damping": 0.5, "yaw_damper_half_spacing": 1.0},
        {"design_conicity": 1.0},
    )
    parts = [zero] + [
        tuple(one - none for one, none in zip(_mechanics(base | end, speed, creep), zero, strict=True)) for end in ends
    ]
    mass = np.linalg.inv(_mass(p))
    A, B = np.zeros((4, STATES, STATES)), np.zeros((4, STATES, len(INPUTS)))
    A[0, :DEGREES, DEGREES:] = np.eye(DEGREES)
    for i, (damping, stiffness, inputs) in enumerate(parts):
        A[i, DEGREES:, :DEGREES], A[i, DEGREES:, DEGREES:], B[i, DEGREES:] = (
            -mass @ stiffness,
            -mass @ damping,
            mass @ inputs,
        )
    C, D = _outputs(A, B, channels)
    _rolled(A, B, p)
    _rolled(C, D, p)
    felt = np.array(
        [np.zeros(DEGREES) if "rate_yaw" in name else mass[PLACES[name.partition(".")[0]][0]] for name in channels]
    )
    return HalfVehicle(A, B, C, D, np.vstack([np.zeros((DEGREES, DEGREES)), mass]), felt)


def _mass(p: Mapping[str, float]) -> np.ndarray:
    m, w = p["wheelset_mass"], p["wheelset_yaw_inertia"]
    return np.diag(
        [m, w, m, w]
        + [p[name] for name in ("bogie_mass", "bogie_yaw_inertia", "body_mass")]
        + [p["bogie_roll_inertia"], p["body_roll_inertia"]]
    )


def _mechanics(p: Mapping[str, float], speed: float, creep: Shares) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Damping, stiffness (9, 9) and forces of the inputs (9, 8), the roll being that of the wheelsets."""
    _, flat_damping, flat_stiffness, rail, roll, roll_rate = matrices(p, speed, creep)
    damping, stiffness, inputs = (
        np.zeros((DEGREES, DEGREES)),
        np.zeros((DEGREES, DEGREES)),
        np.zeros((DEGREES, len(INPUTS))),
    )
    damping[:7, :7], stiffness[:7, :7] = flat_damping, flat_stiffness
    inputs[:7, 0:2], inputs[:7, 2:4], inputs[:7, 4:6] = rail, roll, roll_rate
    _spin(p, creep, stiffness, inputs)
    for number, yaw in enumerate((YAW1, YAW2)):  # gyroscopic: the wheels turn at V / r while the rails roll them
        inputs[yaw, 4 + number] -= p["wheelset_spin_inertia"] * speed / p["wheel_radius"]
    for kind, total, column in (("stiffness", stiffness, 2), ("damping", damping, 4)):
        _lift(total, 2.0 * p[f"primary_lateral_{kind}"], _primaries(p, flat=True), _primaries(p))
        _lift(total, 2.0 * p[f"secondary_lateral_{kind}"], [_secondary(p, flat=True)], [_secondary(p)])
        turn = 2.0 * p[f"primary_vertical_{kind}"] * p["primary_half_spacing"] ** 2
        total[BOGIE_ROLL, BOGIE_ROLL] += 2.0 * turn
        inputs[BOGIE_ROLL, column : column + 2] += turn
        turn = 2.0 * p[f"secondary_vertical_{kind}"] * p["secondary_half_spacing"] ** 2
        turn += p["roll_bar_stiffness"] if kind == "stiffness" else 0.0
        total[np.ix_([BOGIE_ROLL, BODY_ROLL], [BOGIE_ROLL, BODY_ROLL])] += turn * np.array([[1.0, -1.0], [-1.0, 1.0]])
    _preloads(p, stiffness, inputs)
    return damping, stiffness, inputs


def _spin(p: Mapping[str, float], creep: Shares, stiffness: np.ndarray, inputs: np.ndarray) -> None:
    """Lateral creep force of the spin that a wheel has by its contact angle: it takes off most of what gravity gives.

    A wheel of contact angle delta spins by -delta / r more (Wickens 2003): 2 f23 e u / r, u as in `vehicle.plan_view`.
    """
    pull = 2.0 * slopes(p, creep).f23 * p["design_contact_angle_rate"] / p["wheel_radius"]
    for number, y in enumerate((Y1, Y2)):
        stiffness[y, y] -= pull
        inputs[y, number] -= pull
        inputs[y, 2 + number] += pull * p["wheel_radius"]


def _lift(total: np.ndarray, value: float, before: list[np.ndarray], after: list[np.ndarray]) -> None:
    """Put springs of `value` that stand at their height in the place of those at the centres of gravity."""
    for old, new in zip(before, after, strict=True):
        total += value * (np.outer(new, new) - np.outer(old, old))


def _primaries(p: Mapping[str, float], flat: bool = False) -> list[np.ndarray]:
    """What stretches the lateral primary springs; they stand at axle height."""
    rows = []
    below = 0.0 if flat else p["bogie_height"] - p["wheel_radius"]
    for y, arm in ((Y1, p["semi_wheelbase"]), (Y2, -p["semi_wheelbase"])):
        row = np.zeros(DEGREES)
        row[[y, BOGIE, BOGIE_YAW, BOGIE_ROLL]] = 1.0, -1.0, -arm, -below
        rows.append(row)
    return rows


def _secondary(p: Mapping[str, float], flat: bool = False) -> np.ndarray:
    """What stretches the lateral secondary springs and dampers: body less bogie at their height."""
    row = np.zeros(DEGREES)
    row[[BODY, BOGIE]] = 1.0, -1.0
    if not flat:
        row[BODY_ROLL] = p["body_height"] - p["secondary_height"]
        row[BOGIE_ROLL] = p["secondary_height"] - p["bogie_height"]
    return row


def _preloads(p: Mapping[str, float], stiffness: np.ndarray, inputs: np.ndarray) -> None:
    """Weight P that a suspension carries between two bodies of roll a (upper) and b: P [(a + b) w + h a^2 - k b^2] / 2.

    w is the lateral stretch, h and k the heights of the spring over the upper and the lower body's centre of gravity.
    """
    body, bogie, axle, spring = (p[f"{n}"] for n in ("body_height", "bogie_height", "wheel_radius", "secondary_height"))
    weight = p["body_mass"] * GRAVITY
    half = np.zeros(DEGREES)
    half[[BODY_ROLL, BOGIE_ROLL]] = 0.5
    stretch = _secondary(p)
    stiffness += weight * (np.outer(half, stretch) + np.outer(stretch, half))
    stiffness[BODY_ROLL, BODY_ROLL] += weight * (spring - body)
    stiffness[BOGIE_ROLL, BOGIE_ROLL] -= weight * (spring - bogie)
    weight = (p["body_mass"] + p["bogie_mass"]) * GRAVITY / 2.0
    for number, row in enumerate(_primaries(p)):
        half = np.zeros(DEGREES)
        half[BOGIE_ROLL] = 0.5
        stiffness -= weight * (np.outer(half, row) + np.outer(row, half))
        inputs[:, 2 + number] += 0.5 * weight * row
        stiffness[BOGIE_ROLL, BOGIE_ROLL] += weight * (axle - bogie)


def _rolled(states: np.ndarray, inputs: np.ndarray, p: Mapping[str, float]) -> None:
    """Roll of the wheelsets put by that of the rails: phi + s (y + r phi - d), s = (delta / l) / (1 - r delta / l)."""
    slope = p.get("design_contact_angle", p["design_conicity"]) / p["half_gauge"]
    slope /= 1.0 - p["wheel_radius"] * slope
    for number, y in enumerate((Y1, Y2)):
        for first, place, side in ((2, y, number), (4, DEGREES + y, 6 + number)):
            roll = inputs[..., first + number].copy()
            states[..., place] += slope * roll
            inputs[..., first + number] += slope * p["wheel_radius"] * roll
            inputs[..., side] -= slope * roll


def _outputs(A: np.ndarray, B: np.ndarray, channels: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Specific force (acceleration and g times the roll) or yaw rate of each channel."""
    rolls = {"bogie": BOGIE_ROLL, "body": BODY_ROLL}
    C, D = np.zeros((4, len(channels), STATES)), np.zeros((4, len(channels), len(INPUTS)))
    for row, name in enumerate(channels):
        body, _, what = name.partition(".")
        y, yaw = PLACES[body]
        if what.startswith("rate_yaw"):
            C[0, row, DEGREES + yaw] = 1.0
            continue
        C[:, row], D[:, row] = A[:, DEGREES + y], B[:, DEGREES + y]
        if body in rolls:
            C[0, row, rolls[body]] += GRAVITY
        else:
            D[0, row, 2 if y == Y1 else 3] += GRAVITY
    return C, D
