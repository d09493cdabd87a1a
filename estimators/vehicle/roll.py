"""How a bogie rolls with its wheelsets, sideways motion and all: linear, from nominal parameters.

Bogie and body have a lateral place (left +) and a roll (left side up): q = [y, phi, Y, Phi]. A point z above a centre
of gravity lies at y - z phi. Springs and dampers: vertical primary at +-d, lateral primary at axle height, secondary at
its own height h, roll bar; the weight of the body tips what it stands on. The wheelsets' mean roll phi_w comes from the
rails, and because wheels that roll do not slip sideways within a few metres, their axles move by -r phi_w:

    M q'' + C q' + K q = (C_w s + K_w) phi_w

The body on soft springs and the lateral dampers above the bogie's centre are why the roll of the bogie is neither the
wheelsets' nor that of a bogie below a body at rest.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from railsim.constants import GRAVITY
from railsim.errors import InputError

NEEDED = (
    "body_mass",
    "body_roll_inertia",
    "body_height",
    "bogie_mass",
    "bogie_roll_inertia",
    "bogie_height",
    "wheel_radius",
    "primary_half_spacing",
    "primary_vertical_stiffness",
    "primary_vertical_damping",
    "primary_lateral_stiffness",
    "secondary_half_spacing",
    "secondary_height",
    "secondary_lateral_stiffness",
    "secondary_lateral_damping",
    "secondary_vertical_stiffness",
    "secondary_vertical_damping",
)
"""Nominal parameters without which there is no model, SI units; all positive."""


def roll_response(p: Mapping[str, float], omega: np.ndarray) -> np.ndarray:
    """Bogie's roll over the wheelsets' mean roll at angular frequencies in rad/s, complex, shape (n,).

    Parameters
    ----------
    p : the parameters `NEEDED`; "roll_bar_stiffness" and "primary_lateral_damping" are 0 where not given.
    """
    s = 1j * np.asarray(omega)[:, None, None]
    mass = np.diag([p["bogie_mass"], p["bogie_roll_inertia"], p["body_mass"], p["body_roll_inertia"]])
    low = p["bogie_height"] - p["wheel_radius"]
    above, below = p["secondary_height"] - p["bogie_height"], p["body_height"] - p["secondary_height"]
    arms = {
        "primary_vertical": (4 * p["primary_half_spacing"] ** 2, np.array([0.0, 1.0, 0.0, 0.0]), 1.0),
        "primary_lateral": (4.0, np.array([1.0, low, 0.0, 0.0]), -p["wheel_radius"]),
        "secondary_lateral": (2.0, np.array([1.0, -above, -1.0, -below]), 0.0),
        "secondary_vertical": (2 * p["secondary_half_spacing"] ** 2, np.array([0.0, 1.0, 0.0, -1.0]), 0.0),
    }
    matrix, push = s**2 * mass, np.zeros((len(s), 4), dtype=complex)
    for name, (factor, arm, wheel) in arms.items():
        stiff = factor * (p[f"{name}_stiffness"] + s * p.get(f"{name}_damping", 0.0))
        matrix = matrix + stiff * np.outer(arm, arm)
        push += stiff[:, 0] * arm * wheel
    bar, tip = np.array([0.0, 1.0, 0.0, -1.0]), np.array([0.0, 0.0, 0.0, 1.0])
    load = p["body_mass"] * GRAVITY
    matrix = matrix + p.get("roll_bar_stiffness", 0.0) * np.outer(bar, bar) - load * below * np.outer(tip, tip)
    return np.linalg.solve(matrix, push[:, :, None])[:, 1, 0]


def over_track(vehicle: Mapping[str, Any], speed: float, wave_number: np.ndarray) -> np.ndarray:
    """Bogie's roll over that of the rails under its centre, complex, shape (n,): through the mean of both wheelsets.

    Parameters
    ----------
    speed : m/s. wave_number : rad/m, shape (n,).

    Raises
    ------
    InputError : a parameter is missing or not positive.
    """
    k = np.asarray(wave_number, dtype=float)
    p = parameters(vehicle, "semi_wheelbase")
    return np.cos(k * p["semi_wheelbase"]) * roll_response(p, k * speed)


def parameters(vehicle: Mapping[str, Any], *further: str) -> dict[str, float]:
    """`NEEDED` and further nominal parameters, and those that may be 0.

    Raises
    ------
    InputError : one is missing or not positive.
    """
    found: dict[str, float] = {}
    for name in (*NEEDED, *further):
        value = vehicle.get(name)
        if not isinstance(value, int | float) or not value > 0:
            raise InputError(
                f"vehicle parameter '{name}' is {value!r}; about.json must give a positive number in SI units"
            )
        found[name] = float(value)
    return found | {name: float(vehicle.get(name, 0.0)) for name in ("roll_bar_stiffness", "primary_lateral_damping")}
