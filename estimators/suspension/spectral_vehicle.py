"""What the spectral estimator fits of a vehicle: its unknowns with their priors, and the matrices that belong to them.

Dampers are shares of the nominal ones. What the field does not know is fitted beside them: conicity, payload, one
factor of the creep coefficients, the change of the contact angle and the lateral stiffness. What has a tolerance and is
not fitted is considered (Schmidt 1966): the estimate does not follow it, but the stated deviation contains it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from estimators.vehicle.affine import nominal
from estimators.vehicle.lateral_frequency import Channel, Damper, Lateral, Place, build
from estimators.vehicle.lateral_roll import NEEDED
from estimators.vehicle.parameters import Parameters, numbers
from estimators.vehicle.suspension import whole_body_yaw_inertia
from railsim.constants import GRAVITY
from railsim.vehicles.payload import PASSENGER, SPREAD, STANDING, Payload

TWICE = float(np.log(2.0))  # a factor of two is one standard deviation: what wear and weather do to contacts (choice)
SPRING, RUBBER, INERTIA, LENGTH = 0.1, 0.2, 0.05, 0.05  # tolerances, logarithmic standard deviations (choice)
PAYLOAD = 0.15  # of the empty body's mass, mean and standard deviation where about.json names no seats (choice)
LATERAL, YAW, CONICITY, LOAD, CREEP = "lateral dampers", "yaw dampers", "conicity", "payload", "creep"
ANGLES, STIFFNESS = "design_contact_angle_rate", "secondary_lateral_stiffness"
MOST = 3.0  # largest share of a nominal damper
TOLERATED: Mapping[str, float] = {
    STIFFNESS: SPRING,
    "primary_lateral_stiffness": SPRING,
    "primary_longitudinal_stiffness": SPRING,
    "body_height": LENGTH,
}
"""Fields that are fitted within their tolerances: those that the dampers' estimates depend on most."""
CONSIDERED: Mapping[str, float] = {
    "secondary_longitudinal_stiffness": SPRING,
    "secondary_vertical_stiffness": SPRING,
    "roll_bar_stiffness": SPRING,
    "secondary_vertical_damping": RUBBER,
    "yaw_damper_series_stiffness": SPRING,
    "body_roll_inertia": INERTIA,
    "body_yaw_inertia": INERTIA,
    "bogie_yaw_inertia": INERTIA,
    "bogie_mass": INERTIA,
    "secondary_height": LENGTH,
}
"""Fields that keep their nominal values, and the logarithmic standard deviation that they count with. The mounts of yaw
dampers are here and not fitted: fitted, they follow what worn wheels add (S1002 worn by 0.3: C_spsi 0.84 +- 0.03)."""


class Unknown(NamedTuple):
    """An unknown with its prior: dampers are shares, payload a share of the empty body, all others natural logarithms.

    Attributes
    ----------
    name : as in this module. mean, std : of the prior; infinite where there is none. low, high : bounds.
    """

    name: str
    mean: float
    std: float
    low: float
    high: float


@dataclass(frozen=True)
class Nominal:
    """A vehicle as about.json gives it, as half or as whole vehicle.

    Attributes
    ----------
    p : parameters, those of the body the whole one's where `whole`. creep : shares of Kalker's coefficients.
    channels : readings. dampers : lateral, yaw. unknowns : in the order of the vector that is fitted.
    """

    p: dict[str, float]
    whole: bool
    creep: tuple[float, float, float]
    channels: tuple[Channel, ...]
    dampers: tuple[Damper, Damper]
    unknowns: tuple[Unknown, ...]

    @property
    def ahead(self) -> tuple[float, ...]:
        """Wheelsets before the leading bogie's centre, m."""
        return wheelsets_ahead(self.p, self.whole)

    def shares(self, values: Sequence[float] | np.ndarray) -> tuple[float, float]:
        """Shares of the lateral and yaw dampers among the unknowns' values."""
        by_name = dict(zip((one.name for one in self.unknowns), values, strict=False))
        return float(by_name[LATERAL]), float(by_name.get(YAW, 0.0))

    def matrices(self, values: Sequence[float] | np.ndarray, speed: float, used: Sequence[int]) -> Lateral:
        """Of the vehicle with the unknowns' values at a speed, m/s, for some of the channels."""
        return self.changed({one.name: float(x) for one, x in zip(self.unknowns, values, strict=False)}, speed, used)

    def changed(self, by_name: Mapping[str, float], speed: float, used: Sequence[int]) -> Lateral:
        """The same; names may be any parameter's, with its logarithm."""
        p, creep = dict(self.p), self.creep
        for name, value in by_name.items():
            if name == CONICITY:
                p["design_conicity"] *= float(np.exp(value))
            elif name == CREEP:
                creep = (creep[0] * np.exp(value), creep[1] * np.exp(value), creep[2] * np.exp(value))
            elif name in p:
                p[name] *= float(np.exp(value))
        p = loaded(p, by_name.get(LOAD, 0.0), self.whole)
        risen = p["body_height"] - self.p["body_height"]
        channels = [_lowered(self.channels[j], risen) for j in used]
        return build(p, self.whole, speed, creep, channels)


def wheelsets_ahead(p: Parameters, whole: bool) -> tuple[float, ...]:
    """Wheelsets before the leading bogie's centre, m, the leading one first."""
    arm, apart = p["semi_wheelbase"], 2.0 * p.get("semi_bogie_spacing", 0.0)
    return (arm, -arm, arm - apart, -arm - apart) if whole else (arm, -arm)


def loaded(p: dict[str, float], share: float, whole: bool) -> dict[str, float]:
    """The vehicle with a payload of a share of the empty body's mass, seated passengers' height and spread."""
    mass, empty = share * p["body_mass"], p["body_mass"]
    up, reduced = Payload().height - p["body_height"], mass * empty / (mass + empty)
    wheels = 8.0 if whole else 4.0
    carried = p["design_wheel_load"] + mass * GRAVITY / wheels
    changes = {
        "body_mass": empty + mass,
        "body_height": p["body_height"] + mass / (mass + empty) * up,
        "body_roll_inertia": p["body_roll_inertia"] + reduced * up**2 + mass * SPREAD**2,
        "design_wheel_load": carried,
    }
    if "body_yaw_inertia" in p:
        changes["body_yaw_inertia"] = p["body_yaw_inertia"] * (1.0 + share)
    return p | changes


def can_be_whole(vehicle: Mapping[str, Any]) -> bool:
    """Whether the distance of the bogies is known."""
    return isinstance(vehicle.get("semi_bogie_spacing"), int | float)


def nominal_vehicle(
    vehicle: Mapping[str, Any],
    places: Mapping[str, Place],
    channels: Sequence[str],
    whole: bool,
    creep: tuple[float, float, float],
    gains: tuple[float, float],
) -> Nominal:
    """Nominal vehicle of a recording.

    Parameters
    ----------
    vehicle : parameters, as about.json gives them. places : of the sensors by channel, at the centre where not given.
    channels : that are read. creep : shares of Kalker's coefficients at the start.
    gains : shares of the lateral and yaw dampers' force that are left where they blow off.

    Raises
    ------
    InputError : a parameter is missing; all of them are named.
    """
    p = numbers(vehicle, NEEDED)
    stated_whole = "whole_body_mass" in p
    if whole:
        p["body_yaw_inertia"] = whole_body_yaw_inertia(p)
        p["body_mass"] = p.get("whole_body_mass", 2.0 * p["body_mass"])
        p["body_roll_inertia"] = p.get("whole_body_roll_inertia", 2.0 * p["body_roll_inertia"])
    shift = p.get("semi_bogie_spacing", 0.0) * (whole - stated_whole)
    found = []
    for name in channels:
        body, _, rest = name.partition(".")
        x, y, z = places.get(name, (0.0, 0.0, 0.0))
        found.append(Channel(body, rest.partition(" [")[0], (x + shift * (body == "body"), y, z)))
    built = nominal(vehicle)
    lateral = Damper(float(built[0]) or 1.0, 2.0 * p.get("lateral_damper_series_stiffness", np.inf), gains[0])
    mount = 2.0 * p.get("yaw_damper_series_stiffness", np.inf) * p.get("yaw_damper_half_spacing", 0.0) ** 2
    yaw = Damper(float(built[1]) or 1.0, mount if mount > 0.0 else np.inf, gains[1])
    return Nominal(p, whole, creep, tuple(found), (lateral, yaw), _unknowns(p, bool(built[1] > 0.0)))


def _unknowns(p: Parameters, yaw_dampers: bool) -> tuple[Unknown, ...]:
    full = p.get("seats", 0.0) * PASSENGER + p.get("standing_area", 0.0) * STANDING
    half = 0.5 * full / p["body_mass"] if full > 0.0 else PAYLOAD
    none = np.inf
    return (
        Unknown(LATERAL, 1.0, none, 0.0, MOST),
        *((Unknown(YAW, 1.0, none, 0.0, MOST),) if yaw_dampers else ()),
        Unknown(CONICITY, 0.0, TWICE, np.log(0.01 / p["design_conicity"]), np.log(1.0 / p["design_conicity"])),
        Unknown(LOAD, half, half, -0.1, 1.0),
        Unknown(CREEP, 0.0, TWICE, -4.0 * TWICE, 2.0 * TWICE),
        Unknown(ANGLES, 0.0, TWICE, -4.0 * TWICE, 4.0 * TWICE),
        *(Unknown(name, 0.0, std, -4.0 * std, 4.0 * std) for name, std in TOLERATED.items()),
    )


def _lowered(channel: Channel, risen: float) -> Channel:
    """A sensor on the body stays where it is while the body's centre of gravity rises."""
    x, y, z = channel.position
    return channel._replace(position=(x, y, z - risen)) if channel.body == "body" else channel
