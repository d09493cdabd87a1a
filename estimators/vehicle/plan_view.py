"""Plan view of the half vehicle: lateral position and yaw of two wheelsets and the bogie, lateral position of the body.

Springs act at the centres of gravity, nothing rolls but the wheelsets, and these as the rails do: a linear model of how
a bogie follows the track sideways (Wickens 2003; Ward et al. 2011, (16) and (17)). Its contacts are `contact.cones`.

The bogie's yaw over the track's slope, at the wave number k, is the transfer function that compensation divides by
(Ward et al. 2011, section 3.1 and reference [11] there); cross level turns the bogie too, and must be known.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from estimators.vehicle.contact import cones, creep_forces, relations, weight, wheelsets
from estimators.vehicle.creep import WHOLE, Shares, kalker_slopes
from estimators.vehicle.linear_model import Element, Kinematics, Reduced, reduce
from estimators.vehicle.parameters import Parameters, numbers
from estimators.vehicle.suspension import LEVEL, Heights, half_vehicle_bogies, lateral_springs, masses, yaw_springs

COORDINATES = (
    "wheelset1.y", "wheelset1.yaw", "wheelset2.y", "wheelset2.yaw", "bogie.y", "bogie.yaw", "body.y",
)  # fmt: skip
RAILS = ("wheelset1.rail_y", "wheelset2.rail_y", "wheelset1.rail_roll", "wheelset2.rail_roll")
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


def plan_view(p: Parameters, speed: float, share: Shares) -> Reduced:
    """Equations of motion over the rails' lateral position and roll under each wheelset.

    Parameters
    ----------
    p : nominal parameters. speed : V, m/s. share : of Kalker's creep coefficients.
    """
    bogies, geometry, slopes = half_vehicle_bogies(p), cones(p), kalker_slopes(p, share)
    elements = suspension(p, LEVEL)
    for wheelset in wheelsets(p, bogies):
        elements += creep_forces(wheelset, slopes, speed, spin_of_angles=False) + weight(wheelset, geometry)
    moving = Kinematics(COORDINATES, RAILS, relations(geometry, wheelsets(p, bogies)))
    return reduce(elements, masses(p, bogies, COORDINATES), moving, reactions=False)


def suspension(p: Parameters, above: Heights) -> list[Element]:
    """Springs and dampers that act in plan view."""
    bogies = half_vehicle_bogies(p)
    return lateral_springs(p, bogies, above) + yaw_springs(p, bogies)


def yaw_response(
    vehicle: Mapping[str, Any], speed: float, wave_number: np.ndarray, creep: float = WHOLE
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
    p = numbers(vehicle, NEEDED)
    k = np.asarray(wave_number, dtype=float)
    ahead = np.exp(1j * k * p["semi_wheelbase"])
    none = np.zeros_like(ahead)
    rails = np.stack([[ahead, 1.0 / ahead, none, none], [none, none, ahead, 1.0 / ahead]]).T
    yaw = plan_view(p, speed, creep).response(1j * k * speed, rails)[:, COORDINATES.index("bogie.yaw")]
    slope = np.where(k == 0.0, np.inf, 1j * k)
    return np.where(k == 0.0, 1.0, yaw[:, 0] / slope), yaw[:, 1] / slope / p["wheel_radius"]
