"""How a bogie follows the track sideways: linear plan view of two wheelsets, bogie and body on nominal parameters.

Wheelset i (lateral y, yaw psi; left +) on rails that lie at d to the left and roll it by phi (left up),
u = y + r phi - d, at speed V; Kalker's coefficients f11, f22, f23 of one wheel, conicity lambda, half gauge l,
radius r, change e of the contact angle with u, wheel load N (Wickens 2003; Ward et al. 2011, (16) and (17)):

    m y'' + 2 f22 ((y' + r phi')/V - psi) + 2 f23 psi'/V + 2 N e u + 2 N phi = lateral force of the primary suspension
    I psi'' + 2 f11 l (l psi'/V + lambda u / r) - 2 f23 ((y' + r phi')/V - psi) - 2 N l lambda psi = its yaw moment

The bogie's yaw over the track's slope, at the wave number k, is the transfer function that compensation divides by
(Ward et al. 2011, section 3.1 and reference [11] there); cross level turns the bogie too, and must be known.
"""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from railsim.contact.linear import CreepCoefficients, creep_coefficients
from railsim.errors import InputError

NEEDED = (
    "semi_wheelbase",
    "half_gauge",
    "wheel_radius",
    "wheelset_mass",
    "wheelset_yaw_inertia",
    "bogie_mass",
    "bogie_yaw_inertia",
    "body_mass",
    "primary_half_spacing",
    "primary_longitudinal_stiffness",
    "primary_lateral_stiffness",
    "primary_longitudinal_damping",
    "primary_lateral_damping",
    "secondary_half_spacing",
    "secondary_longitudinal_stiffness",
    "secondary_lateral_stiffness",
    "secondary_lateral_damping",
    "design_conicity",
    "design_contact_angle_rate",
    "design_contact_curvature",
    "design_wheel_load",
)
ROLL = (
    "bogie_roll_inertia",
    "body_roll_inertia",
    "primary_vertical_stiffness",
    "primary_vertical_damping",
    "secondary_vertical_stiffness",
    "secondary_vertical_damping",
    "roll_bar_stiffness",
)
Y1, YAW1, Y2, YAW2, BOGIE, BOGIE_YAW, BODY = range(7)
Shares = float | tuple[float, float, float]
"""Share of Kalker's creep coefficients, or one each of f11, f22 and f23."""


def fits(vehicle: Mapping[str, Any]) -> bool:
    """Whether about.json gives all parameters of the plan view."""
    return all(isinstance(vehicle.get(name), int | float) for name in NEEDED + ROLL)


def yaw_response(
    vehicle: Mapping[str, Any], speed: float, wave_number: np.ndarray, creep: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Bogie's yaw over the slope of the rails' lateral position, and over the slope of the height r phi, both complex.

    Parameters
    ----------
    vehicle : nominal parameters by field name, SI units.
    speed : V, m/s.
    wave_number : rad/m, shape (n,).
    creep : share of Kalker's coefficients.

    Returns
    -------
    For position and for roll under the bogie's centre, shape (n,) each; 1 and 0 at wave number 0.

    Raises
    ------
    InputError : a parameter is missing.
    """
    p = _parameters(vehicle)
    k = np.asarray(wave_number, dtype=float)
    s = 1j * k * speed
    mass, damping, stiffness, rail, roll, roll_rate = matrices(p, speed, creep)
    dynamic = s[:, None, None] ** 2 * mass + s[:, None, None] * damping + stiffness
    ends = np.exp(1j * k[:, None] * p["semi_wheelbase"] * np.array([1.0, -1.0]))
    tilt = (roll + s[:, None, None] * roll_rate) / p["wheel_radius"]
    force = np.stack([ends @ rail.T, np.einsum("ki,kji->kj", ends, tilt)], axis=-1)
    yaw = np.linalg.solve(dynamic, force)[:, BOGIE_YAW]
    slope = np.where(k == 0.0, np.inf, 1j * k)
    return np.where(k == 0.0, 1.0, yaw[:, 0] / slope), yaw[:, 1] / slope


def roll_response(vehicle: Mapping[str, Any], speed: float, wave_number: np.ndarray) -> np.ndarray:
    """Bogie's roll over that of the rails under its centre: mean of both wheelsets through the primary suspension.

    Parameters as `yaw_response`; needs the vertical suspension and the roll inertias too.
    """
    p = _parameters(vehicle, ROLL)
    s = 1j * np.asarray(wave_number, dtype=float) * speed
    primary = 4.0 * (p["primary_vertical_stiffness"] + s * p["primary_vertical_damping"])
    primary = primary * p["primary_half_spacing"] ** 2
    secondary = 2.0 * (p["secondary_vertical_stiffness"] + s * p["secondary_vertical_damping"])
    secondary = secondary * p["secondary_half_spacing"] ** 2 + p["roll_bar_stiffness"]
    body = p["body_roll_inertia"] * s**2
    carried = secondary * body / (secondary + body)
    follows = primary / (primary + p["bogie_roll_inertia"] * s**2 + carried)
    return np.cos(np.asarray(wave_number) * p["semi_wheelbase"]) * follows


def matrices(p: Mapping[str, float], speed: float, creep: Shares) -> tuple[np.ndarray, ...]:
    """Mass, damping, stiffness (7, 7); forces per metre of the rails under each wheelset, per radian of its roll, and
    per radian a second (7, 2).
    """
    mass = np.diag(
        [
            p["wheelset_mass"],
            p["wheelset_yaw_inertia"],
            p["wheelset_mass"],
            p["wheelset_yaw_inertia"],
            p["bogie_mass"],
            p["bogie_yaw_inertia"],
            p["body_mass"],
        ]
    )
    stiffness = _suspension(p, "stiffness")
    damping = _suspension(p, "damping")
    rail, roll, roll_rate = np.zeros((3, 7, 2))
    radius = p["wheel_radius"]
    f11, f22, f23 = slopes(p, creep)
    load, arm, conicity = p["design_wheel_load"], p["half_gauge"], p["design_conicity"]
    lateral = 2.0 * load * p["design_contact_angle_rate"]
    steering = 2.0 * f11 * arm * conicity / radius
    for number, (y, yaw) in enumerate(((Y1, YAW1), (Y2, YAW2))):
        damping[y, y] += 2.0 * f22 / speed
        damping[y, yaw] += 2.0 * f23 / speed
        damping[yaw, y] -= 2.0 * f23 / speed
        damping[yaw, yaw] += 2.0 * f11 * arm**2 / speed
        stiffness[y, y] += lateral
        stiffness[y, yaw] -= 2.0 * f22
        stiffness[yaw, y] += steering
        stiffness[yaw, yaw] += 2.0 * f23 - 2.0 * load * arm * conicity
        rail[y, number], rail[yaw, number] = lateral, steering
        roll[y, number], roll[yaw, number] = -lateral * radius - 2.0 * load, -steering * radius
        roll_rate[y, number], roll_rate[yaw, number] = -2.0 * f22 * radius / speed, 2.0 * f23 * radius / speed
    return mass, damping, stiffness, rail, roll, roll_rate


def slopes(p: Mapping[str, float], creep: Shares) -> CreepCoefficients:
    """Creep coefficients of one wheel under its nominal load; `creep`: share of Kalker's, or three of them."""
    kalker = _kalker(1.0 / p["wheel_radius"], p["design_contact_curvature"], p["design_wheel_load"])
    shares = creep if isinstance(creep, tuple) else (creep, creep, creep)
    return CreepCoefficients(*(share * one for share, one in zip(shares, kalker, strict=True)))


@lru_cache(maxsize=8)
def _kalker(along: float, across: float, load: float) -> CreepCoefficients:
    return creep_coefficients(along, across, load)


def _suspension(p: Mapping[str, float], kind: str) -> np.ndarray:
    total = np.zeros((7, 7))

    def connect(value: float, row: Mapping[int, float]) -> None:
        direction = np.zeros(7)
        for place, factor in row.items():
            direction[place] = factor
        total[:] += value * np.outer(direction, direction)

    for y, yaw, arm in ((Y1, YAW1, p["semi_wheelbase"]), (Y2, YAW2, -p["semi_wheelbase"])):
        connect(2.0 * p[f"primary_lateral_{kind}"], {y: 1.0, BOGIE: -1.0, BOGIE_YAW: -arm})
        turn = 2.0 * p[f"primary_longitudinal_{kind}"] * p["primary_half_spacing"] ** 2
        connect(turn, {yaw: 1.0, BOGIE_YAW: -1.0})
    connect(2.0 * p[f"secondary_lateral_{kind}"], {BOGIE: 1.0, BODY: -1.0})
    turn = 2.0 * p.get(f"secondary_longitudinal_{kind}", 0.0) * p["secondary_half_spacing"] ** 2
    if kind == "damping":
        turn += 2.0 * p.get("yaw_damper_damping", 0.0) * p.get("yaw_damper_half_spacing", 0.0) ** 2
    connect(turn, {BOGIE_YAW: 1.0})
    return total


def _parameters(vehicle: Mapping[str, Any], more: tuple[str, ...] = ()) -> dict[str, float]:
    for name in NEEDED + more:
        if not isinstance(vehicle.get(name), int | float):
            raise InputError(
                f"vehicle parameter '{name}' is {vehicle.get(name)!r}; about.json must give a number in SI"
            )
    return {name: float(value) for name, value in vehicle.items() if isinstance(value, int | float)}
