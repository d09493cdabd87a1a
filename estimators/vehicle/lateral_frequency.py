"""Lateral motion of a half or a whole vehicle in the frequency domain, for the condition of its secondary dampers.

Coordinates are y and yaw of the wheelsets, y, roll and yaw of the bogies, y and roll of the body and, of a whole
vehicle, its yaw. With s = i w, rails w (lateral position and roll under each wheelset) and forces f,

    Z(s) q = F(s) w + f,   Z = s^2 M + s C + K + s c_y(s) P_y + s c_psi(s) P_psi,   y = O(s) q + N(s) w.

c_y and c_psi belong to the lateral and the yaw dampers of one bogie. A damper c in series with a mount k, and of the
gain g where it blows off, has g c / (1 + s g c / k) (Maxwell; statistical linearisation, Booton 1954). A share of it is
that of dampers and mounts together: as many as are left. Contacts are
those of `affine`: cones whose contact angle changes with the shift. Springs and weight are those of `suspension`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np

from estimators.vehicle.contact import cones, creep_forces, gyroscopic, relations, weight, wheelsets
from estimators.vehicle.creep import Shares, kalker_slopes
from estimators.vehicle.linear_model import Kinematics, reduce
from estimators.vehicle.parameters import Parameters
from estimators.vehicle.suspension import (
    Bogie,
    half_vehicle_bogies,
    heights,
    masses,
    suspension_elements,
    whole_vehicle_bogies,
)
from railsim.constants import GRAVITY

Place = tuple[float, float, float]
"""Of a sensor on its body, m from the centre of gravity of the empty body."""


class Channel(NamedTuple):
    """A reading: acceleration to the left with gravity's share by the roll, or yaw rate.

    Attributes
    ----------
    body : of its coordinates. kind : "acceleration_y" or "rate_yaw". position : m.
    """

    body: str
    kind: str
    position: Place


@dataclass(frozen=True)
class Lateral:
    """Matrices of one vehicle at one speed; n coordinates, m readings, w motions of rails.

    Attributes
    ----------
    mass, damping, stiffness : without the secondary lateral and yaw dampers, shape (n, n).
    input_damping, input_stiffness : of forces by the rails, shape (n, w).
    lateral, yaw : P_y and P_psi, shape (n, n).
    acceleration, tilt, rate : directions of the readings over the coordinates, shape (m, n).
    input_acceleration, input_tilt : over the rails, shape (m, w).
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    input_damping: np.ndarray
    input_stiffness: np.ndarray
    lateral: np.ndarray
    yaw: np.ndarray
    acceleration: np.ndarray
    tilt: np.ndarray
    rate: np.ndarray
    input_acceleration: np.ndarray
    input_tilt: np.ndarray

    def slope(self, other: Self, step: float) -> Self:
        """Difference of all matrices from another vehicle's over a step."""
        parts = {name: (getattr(self, name) - getattr(other, name)) / step for name in type(self).__dataclass_fields__}
        return replace(self, **parts)


def is_whole(vehicle: Mapping[str, Any]) -> bool | None:
    """Whether about.json gives the parameters of a whole vehicle; None where it leaves that open."""
    return True if "whole_body_mass" in vehicle else None


def bogies_of(p: Parameters, whole: bool) -> tuple[Bogie, ...]:
    """The bogies of a half or a whole vehicle, the leading one first."""
    return whole_vehicle_bogies(p, p["semi_bogie_spacing"]) if whole else half_vehicle_bogies(p)


def coordinates_of(bogies: Sequence[Bogie], whole: bool) -> tuple[str, ...]:
    """Names of the coordinates."""
    names = [f"{wheelset}.{axis}" for bogie in bogies for wheelset in bogie.wheelsets for axis in ("y", "yaw")]
    names += [f"{bogie.name}.{axis}" for bogie in bogies for axis in ("y", "roll", "yaw")]
    return (*names, "body.y", "body.roll", *(["body.yaw"] if whole else []))


def build(p: Parameters, whole: bool, speed: float, creep: Shares, channels: Sequence[Channel]) -> Lateral:
    """Matrices of a vehicle.

    Parameters
    ----------
    p : nominal parameters by field name, SI units; those of the body are the whole one's where `whole`.
    speed : m/s. creep : shares of Kalker's f11, f22 and f23.
    channels : positions are from the centre of gravity of the body that `p` describes.
    """
    bogies, above = bogies_of(p, whole), heights(p)
    names = coordinates_of(bogies, whole)
    roll = p.get("design_contact_angle", p["design_conicity"]) / p["half_gauge"]
    geometry, slopes, rolling = replace(cones(p), roll=roll), kalker_slopes(p, creep), wheelsets(p, bogies)
    rails = [f"{one.name}.{kind}" for kind in ("rail_y", "rail_roll") for one in rolling]
    moving = Kinematics(names, rails, relations(geometry, rolling))
    undamped = {**p, "secondary_lateral_damping": 0.0, "yaw_damper_damping": 0.0}
    elements = suspension_elements(undamped, bogies, above)
    for one in rolling:
        elements += creep_forces(one, slopes, speed) + weight(one, geometry) + gyroscopic(one, speed)
    reduced = reduce(elements, masses(p, bogies, names), moving, reactions=False)
    height = p.get("lateral_damper_height") or p["secondary_height"]
    shears = [
        {
            "body.y": 1.0, "body.roll": p["body_height"] - height, "body.yaw": one.position,
            f"{one.name}.y": -1.0, f"{one.name}.roll": height - p["bogie_height"],
        }
        for one in bogies
    ]  # fmt: skip
    turns = [{f"{one.name}.yaw": 1.0, "body.yaw": -1.0} for one in bogies]
    lateral, yaw = (sum(np.outer(row, row) for row in (moving.row(one)[0] for one in rows)) for rows in (shears, turns))
    rows = [[moving.row(direction) for direction in _directions(one)] for one in channels]
    (acceleration, felt), (tilt, tilted), (rate, _) = (
        tuple(np.stack([row[of][part] for row in rows]) for part in (0, 1)) for of in range(3)
    )
    return Lateral(
        reduced.mass, reduced.damping, reduced.stiffness, reduced.input_damping, reduced.input_stiffness,
        np.asarray(lateral), np.asarray(yaw), acceleration, tilt, rate, felt, tilted,
    )  # fmt: skip


def _directions(channel: Channel) -> tuple[dict[str, float], dict[str, float], dict[str, float]]:
    """What a channel feels: acceleration along, tilt, and rate."""
    body, kind, (x, _, z) = channel
    if kind == "rate_yaw":
        return {}, {}, {f"{body}.yaw": 1.0}
    along = {f"{body}.y": 1.0, f"{body}.yaw": x, f"{body}.roll": -z}
    return along, {f"{body}.roll": GRAVITY}, {}


@dataclass(frozen=True)
class Damper:
    """Nominal dampers of one bogie, both sides together.

    Attributes
    ----------
    damping : N s/m or N m s/rad; 1 where the vehicle has none. mount : series stiffness, N/m or N m/rad.
    gain : share of the damping that is left where they blow off.
    """

    damping: float
    mount: float = np.inf
    gain: float = 1.0

    def at(self, s: np.ndarray) -> np.ndarray:
        """Complex damping of the nominal dampers, shape (k,)."""
        c = self.gain * self.damping
        return c / (1.0 + s * c / self.mount)


class Response(NamedTuple):
    """Readings over the rails (k, m, w) and over forces on the coordinates (k, m, n), with what slopes need.

    Attributes
    ----------
    s : i w, shape (k,). inverse : Z^-1, shape (k, n, n). drive : F, shape (k, n, w).
    """

    rails: np.ndarray
    forces: np.ndarray
    s: np.ndarray
    inverse: np.ndarray
    drive: np.ndarray


def respond(model: Lateral, dampers: Sequence[Damper], shares: Sequence[float], s: np.ndarray) -> Response:
    """Transfer functions at s = i w, shape (k,); `dampers` and their `shares`: lateral, yaw."""
    at = s[:, None, None]
    dynamic = at**2 * model.mass + at * model.damping + model.stiffness
    for damper, share, pattern in zip(dampers, shares, (model.lateral, model.yaw), strict=True):
        dynamic = dynamic + (share * s * damper.at(s))[:, None, None] * pattern
    inverse = np.linalg.inv(dynamic)
    drive = _drive(model, at)
    out, direct = _outputs(model, at)
    forces = out @ inverse
    return Response(forces @ drive + direct, forces, s, inverse, drive)


def moved(now: Response, slope: Lateral, dampers: Sequence[Damper], shares: Sequence[float]) -> tuple[np.ndarray, ...]:
    """Slopes of both transfer functions where the matrices change by `slope`."""
    at = now.s[:, None, None]
    dynamic = at**2 * slope.mass + at * slope.damping + slope.stiffness
    for damper, share, pattern in zip(dampers, shares, (slope.lateral, slope.yaw), strict=True):
        if pattern.any():
            dynamic = dynamic + (share * now.s * damper.at(now.s))[:, None, None] * pattern
    out, direct = _outputs(slope, at)
    forces = (out - now.forces @ dynamic) @ now.inverse
    return direct + now.forces @ _drive(slope, at) + forces @ now.drive, forces


def damped(now: Response, pattern: np.ndarray, slope: np.ndarray) -> tuple[np.ndarray, ...]:
    """The same where the complex damping along a pattern changes by `slope`, shape (k,)."""
    forces = -(now.forces @ ((now.s * slope)[:, None, None] * pattern)) @ now.inverse
    return forces @ now.drive, forces


def _drive(model: Lateral, at: np.ndarray) -> np.ndarray:
    return -(at * model.input_damping + model.input_stiffness)


def _outputs(model: Lateral, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    out = at**2 * model.acceleration + model.tilt + at * model.rate
    return out, at**2 * model.input_acceleration + model.input_tilt
