"""Lateral half vehicle of the suspension estimators: affine in the three parameters that they estimate.

The coordinates are those of the lateral reduction with roll (`vehicle.lateral_roll`), with wheelsets that roll by the
rails and by their contact angles at rest, whatever pushes them; otherwise their contacts are `contact.cones`. An
accelerometer shows g times the roll besides. With x = [q, q'] and the track's input w,

    x' = A x + B w,   y = C x + D w,   A = A0 + C_sy A1 + C_spsi A2 + conicity A3, B, C and D alike:

every matrix is affine in the three parameters. C_sy is the lateral damping between bogie and body (both dampers),
C_spsi that against yaw (both dampers, 2 c b^2), as in Fig. 6 of Ward et al. (2011).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from estimators.vehicle import plan_view
from estimators.vehicle.contact import ContactGeometry, cones, creep_forces, gyroscopic, relations, weight, wheelsets
from estimators.vehicle.creep import Shares, kalker_slopes
from estimators.vehicle.lateral_roll import NEEDED
from estimators.vehicle.linear_model import Kinematics, Reduced, reduce
from estimators.vehicle.parameters import Parameters, numbers
from estimators.vehicle.plan_view import RAILS
from estimators.vehicle.suspension import (
    half_vehicle_bogies,
    heights,
    masses,
    suspension_elements,
)
from railsim.constants import GRAVITY

COORDINATES = (*plan_view.COORDINATES, "bogie.roll", "body.roll")
"""Sigma points follow the order of the states: another order moves the results of `suspension_ukf` by up to 1 %."""
DEGREES = len(COORDINATES)
STATES = 2 * DEGREES
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


@dataclass(frozen=True)
class HalfVehicle:
    """Matrices of x' = A x + B w, y = C x + D w; first index: constant, then one for each of `PARAMETERS`.

    Attributes
    ----------
    A, B, C, D : shapes (4, 18, 18), (4, 18, 8), (4, m, 18), (4, m, 8).
    force : accelerations that unit forces and moments on the nine coordinates give, shape (18, 9).
    feedthrough : the same in the readings, shape (m, 9).
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    force: np.ndarray
    feedthrough: np.ndarray

    def at(self, parameters: Sequence[float] | np.ndarray) -> tuple[np.ndarray, ...]:
        """A, B, C, D for given parameters, in the order of `PARAMETERS`."""
        weights = np.array([1.0, *parameters])
        return tuple(np.tensordot(weights, part, axes=1) for part in (self.A, self.B, self.C, self.D))


def nominal(vehicle: Mapping[str, Any]) -> np.ndarray:
    """`PARAMETERS` of the vehicle as it was built, shape (3,)."""
    arm = float(vehicle.get("yaw_damper_half_spacing", 0.0))
    yaw = 2.0 * float(vehicle.get("yaw_damper_damping", 0.0)) * arm**2
    return np.array([2.0 * float(vehicle["secondary_lateral_damping"]), yaw, float(vehicle["design_conicity"])])


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
    p = numbers(vehicle, NEEDED)
    none = {**p, "secondary_lateral_damping": 0.0, "yaw_damper_damping": 0.0, "design_conicity": 0.0}
    units = (
        {"secondary_lateral_damping": 0.5},
        {"yaw_damper_damping": 0.5, "yaw_damper_half_spacing": 1.0},
        {"design_conicity": 1.0},
    )
    roll = p.get("design_contact_angle", p["design_conicity"]) / p["half_gauge"]
    zero = _first_order(none, speed, creep, roll)
    parts = [_first_order(none | unit, speed, creep, roll) for unit in units]
    A, B = (np.stack([constant, *(part[i] - constant for part in parts)]) for i, constant in enumerate(zero))
    C, D = _outputs(A, B, channels, _kinematics(p, replace(cones(p), roll=roll)))
    inverse = 1.0 / np.array(masses(p, half_vehicle_bogies(p), COORDINATES))
    force = np.vstack([np.zeros((DEGREES, DEGREES)), np.diag(inverse)])
    feedthrough = np.zeros((len(channels), DEGREES))
    for row, name in enumerate(channels):
        if "acceleration_y" in name:
            coordinate = COORDINATES.index(f"{name.partition('.')[0]}.y")
            feedthrough[row, coordinate] = inverse[coordinate]
    return HalfVehicle(A, B, C, D, force, feedthrough)


def _kinematics(p: Parameters, geometry: ContactGeometry) -> Kinematics:
    return Kinematics(COORDINATES, RAILS, relations(geometry, wheelsets(p, half_vehicle_bogies(p))))


def _equations(p: Parameters, speed: float, creep: Shares, roll: float) -> Reduced:
    """Equations of motion; `roll` : of a wheelset over its shift, rad/m."""
    bogies, above, slopes = half_vehicle_bogies(p), heights(p), kalker_slopes(p, creep)
    geometry = replace(cones(p), roll=roll)
    elements = suspension_elements(p, bogies, above)
    for wheelset in wheelsets(p, bogies):
        elements += creep_forces(wheelset, slopes, speed) + weight(wheelset, geometry) + gyroscopic(wheelset, speed)
    return reduce(elements, masses(p, bogies, COORDINATES), _kinematics(p, geometry), reactions=False)


def _first_order(p: Parameters, speed: float, creep: Shares, roll: float) -> tuple[np.ndarray, np.ndarray]:
    """A and B over `INPUTS`."""
    A, by_motion, by_rate = _equations(p, speed, creep, roll).first_order()
    return A, np.hstack([by_motion, by_rate[:, 2:], by_rate[:, :2]])


def _outputs(
    A: np.ndarray, B: np.ndarray, channels: Sequence[str], moving: Kinematics
) -> tuple[np.ndarray, np.ndarray]:
    """Specific force (acceleration and g times the roll) or yaw rate of each channel."""
    C, D = np.zeros((4, len(channels), STATES)), np.zeros((4, len(channels), len(INPUTS)))
    for row, name in enumerate(channels):
        body, _, quantity = name.partition(".")
        if quantity.startswith("rate_yaw"):
            C[0, row, DEGREES + COORDINATES.index(f"{body}.yaw")] = 1.0
            continue
        y = DEGREES + COORDINATES.index(f"{body}.y")
        C[:, row], D[:, row] = A[:, y], B[:, y]
        own, of_rails = moving.row({f"{body}.roll": GRAVITY})
        C[0, row, :DEGREES] += own
        D[0, row, : len(RAILS)] += of_rails
    return C, D
