"""Roll reduction of the half vehicle: how bogie and body roll with the wheelsets, their sideways motion and all.

Coordinates y and roll of the bogie and of the body; bogie and wheelsets do not yaw. The wheelsets' mean roll comes from
the rails, and because wheels that roll do not slip sideways within a few metres, their axles move by -r times it. Of
the weight only that of the body is taken, which tips what it stands on. The body on soft springs and the lateral
dampers above the bogie's centre are why the roll of the bogie is neither the wheelsets' nor that of a bogie below a
body at rest.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from estimators.vehicle.linear_model import Kinematics, reduce
from estimators.vehicle.parameters import positive_numbers
from estimators.vehicle.suspension import (
    body_above_springs,
    half_vehicle_bogies,
    heights,
    lateral_springs,
    masses,
    roll_springs,
)

COORDINATES = ("bogie.y", "bogie.roll", "body.y", "body.roll")
WHEELSETS = "wheelsets.roll"
NEEDED = (
    "body_mass", "body_roll_inertia", "body_height", "bogie_mass", "bogie_roll_inertia", "bogie_height",
    "wheel_radius", "semi_wheelbase", "primary_half_spacing", "primary_vertical_stiffness",
    "primary_vertical_damping", "primary_lateral_stiffness", "secondary_half_spacing", "secondary_height",
    "secondary_lateral_stiffness", "secondary_lateral_damping", "secondary_vertical_stiffness",
    "secondary_vertical_damping",
)  # fmt: skip
"""Nominal parameters without which there is no model, SI units; all positive."""
OPTIONAL = ("roll_bar_stiffness", "primary_lateral_damping")
"""Those that are 0 where not given."""


def parameters(vehicle: Mapping[str, Any]) -> dict[str, float]:
    """`NEEDED` and `OPTIONAL` parameters.

    Raises
    ------
    InputError : one is missing or not positive.
    """
    return positive_numbers(vehicle, NEEDED) | {name: float(vehicle.get(name, 0.0)) for name in OPTIONAL}


def roll_response(p: Mapping[str, float], omega: np.ndarray) -> np.ndarray:
    """Bogie's roll over the wheelsets' mean roll at angular frequencies in rad/s, complex, shape (n,).

    Parameters
    ----------
    p : nominal parameters, see `parameters`.
    """
    bogies, above = half_vehicle_bogies(p), heights(p)
    elements = [
        *lateral_springs(p, bogies, above), *roll_springs(p, bogies), *body_above_springs(p, bogies, above),
    ]  # fmt: skip
    names = [name for bogie in bogies for name in bogie.wheelsets]
    relations = {f"{name}.roll": {WHEELSETS: 1.0} for name in names}
    relations |= {f"{name}.y": {WHEELSETS: -p["wheel_radius"]} for name in names}
    reduced = reduce(elements, masses(p, bogies, COORDINATES), Kinematics(COORDINATES, (WHEELSETS,), relations))
    return reduced.response_of("bogie.roll", omega)[:, 0]


def over_track(vehicle: Mapping[str, Any], speed: float, wave_number: np.ndarray) -> np.ndarray:
    """Bogie's roll over that of the rails under its centre, complex, shape (n,): through the mean of both wheelsets.

    Parameters
    ----------
    speed : m/s. wave_number : rad/m, shape (n,).

    Raises
    ------
    InputError : a parameter is missing or not positive.
    """
    k, p = np.asarray(wave_number, dtype=float), parameters(vehicle)
    return np.cos(k * p["semi_wheelbase"]) * roll_response(p, k * speed)
