"""Plan view of the half vehicle: lateral position and yaw of two wheelsets and the bogie, lateral position of the body.

Springs act at the centres of gravity, nothing rolls but the wheelsets, and these as the rails do: a linear model of how
a bogie follows the track sideways (Wickens 2003; Ward et al. 2011, (16) and (17)). Its contacts are `contact.cones`.

The bogie's yaw over the track's slope, at the wave number k, is the transfer function that compensation divides by
(Ward et al. 2011, section 3.1 and reference [11] there); cross level turns the bogie too, and must be known.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from estimators.vehicle.contact import ContactGeometry, cones, creep_forces, relations, weight, wheelsets
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


def suspension(p: Parameters, above: Heights) -> list[Element]:
    """Springs and dampers that act in plan view."""
    bogies = half_vehicle_bogies(p)
    return lateral_springs(p, bogies, above) + yaw_springs(p, bogies)


class PlanView:
    """Plan view of one vehicle: springs and masses, which no contact changes, are put together once.

    Parameters
    ----------
    vehicle : nominal parameters by field name, SI units.

    Raises
    ------
    InputError : a parameter is missing.
    """

    def __init__(self, vehicle: Mapping[str, Any]) -> None:
        self.p = numbers(vehicle, NEEDED)
        self._bogies = half_vehicle_bogies(self.p)
        self._masses = masses(self.p, self._bogies, COORDINATES)
        self._suspended = reduce(suspension(self.p, LEVEL), self._masses, Kinematics(COORDINATES, RAILS))

    def on_rails(self, share: Shares = WHOLE, geometry: ContactGeometry | None = None) -> "OnRails":
        """The vehicle on its contacts.

        Parameters
        ----------
        share : of Kalker's creep coefficients. geometry : of the contacts; by `contact.cones` where None.
        """
        geometry, slopes = geometry or cones(self.p), kalker_slopes(self.p, share)
        elements, rolling = [], wheelsets(self.p, self._bogies)
        for wheelset in rolling:
            elements += creep_forces(wheelset, slopes, 1.0, spin_of_angles=False) + weight(wheelset, geometry)
        moving = Kinematics(COORDINATES, RAILS, relations(geometry, rolling))
        contacts = reduce(elements, self._masses, moving, reactions=False)
        return OnRails(self._suspended, contacts, self.p["semi_wheelbase"], self.p["wheel_radius"])


@dataclass(frozen=True)
class OnRails:
    """Plan view of a vehicle on its contacts, for any speed: the damping of creep forces goes with 1 / speed.

    Attributes
    ----------
    suspended : without contacts. contacts : what they add at 1 m/s. semi_wheelbase, wheel_radius : m.
    """

    suspended: Reduced
    contacts: Reduced
    semi_wheelbase: float
    wheel_radius: float

    def at(self, speed: float) -> Reduced:
        """Equations of motion over the rails' lateral position and roll under each wheelset; speed in m/s."""
        return replace(
            self.suspended,
            damping=self.suspended.damping + self.contacts.damping / speed,
            stiffness=self.suspended.stiffness + self.contacts.stiffness,
            input_damping=self.contacts.input_damping / speed,
            input_stiffness=self.contacts.input_stiffness,
        )

    def yaw_by_position(self, speed: float, wave_number: np.ndarray) -> np.ndarray:
        """Bogie's yaw over the slope of the rails' lateral position under its centre, complex; 1 at wave number 0.

        Parameters
        ----------
        speed : V, m/s. wave_number : rad/m, shape (n,).
        """
        k = np.asarray(wave_number, dtype=float)
        return np.where(k == 0.0, 1.0, self._yaw(speed, k, 0) / np.where(k == 0.0, np.inf, 1j * k))

    def yaw_by_roll(self, speed: float, wave_number: np.ndarray) -> np.ndarray:
        """The same over the slope of the height r phi that the rails' roll phi makes; 0 at wave number 0."""
        k = np.asarray(wave_number, dtype=float)
        return self._yaw(speed, k, 2) / np.where(k == 0.0, np.inf, 1j * k) / self.wheel_radius

    def _yaw(self, speed: float, k: np.ndarray, first: int) -> np.ndarray:
        """Bogie's yaw by a wave of the inputs `first` and `first` + 1, of the leading and the trailing wheelset."""
        ahead = np.exp(1j * k * self.semi_wheelbase)
        wave = np.zeros((len(k), len(RAILS), 1), dtype=complex)
        wave[:, first, 0], wave[:, first + 1, 0] = ahead, 1.0 / ahead
        return self.at(speed).response(1j * k * speed, wave)[:, COORDINATES.index("bogie.yaw"), 0]
