"""Lateral reduction with roll of the half vehicle: wheelsets that run on creep, bogie and body, over a measured track.

Coordinates are y and yaw of both wheelsets, y, roll and yaw of the bogie, y and roll of the body. Wheelsets keep to the
rails: their roll follows from the rails and from their shift on them (`contact.arcs`), and what rolls them pushes them
sideways in turn. Inputs are the rails' path d to the left and their cross level x, right rail higher, under each
wheelset. Creep forces are those of Polach's law about the wheels' spin at rest (`creep.polach_slopes`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from estimators.vehicle.contact import (
    ContactGeometry,
    Wheelset,
    arcs,
    creep_forces,
    gyroscopic,
    relations,
    weight,
    wheelsets,
)
from estimators.vehicle.creep import polach_slopes
from estimators.vehicle.linear_model import Kinematics, Reduced, Row, reduce
from estimators.vehicle.parameters import VEHICLES, Parameters, numbers
from estimators.vehicle.state_space import Output, System, responses
from estimators.vehicle.suspension import (
    PIVOT,
    half_vehicle_bogies,
    heights,
    masses,
    suspension_elements,
    whole_vehicle_bogies,
)
from railsim.constants import GRAVITY

COORDINATES = (
    "wheelset1.y", "wheelset1.yaw", "wheelset2.y", "wheelset2.yaw", "bogie.y", "bogie.roll", "bogie.yaw", "body.y",
    "body.roll",
)  # fmt: skip
COUNT = len(COORDINATES)
WHOLE = (*COORDINATES, "body.yaw")
"""With a whole body, which also yaws."""
BOTH = (
    *WHOLE, "wheelset3.y", "wheelset3.yaw", "wheelset4.y", "wheelset4.yaw", "bogie2.y", "bogie2.roll", "bogie2.yaw",
)  # fmt: skip
"""With the other bogie too."""
WHEELSETS = ("wheelset1", "wheelset2")
NEEDED = (
    "body_mass", "body_roll_inertia", "body_height", "bogie_mass", "bogie_roll_inertia", "bogie_yaw_inertia",
    "bogie_height", "wheelset_mass", "wheelset_yaw_inertia", "wheelset_spin_inertia", "wheel_radius", "half_gauge",
    "semi_wheelbase", "primary_half_spacing", "primary_longitudinal_stiffness", "primary_longitudinal_damping",
    "primary_lateral_stiffness", "primary_lateral_damping", "primary_vertical_stiffness", "primary_vertical_damping",
    "secondary_half_spacing", "secondary_height", "secondary_longitudinal_stiffness", "secondary_lateral_stiffness",
    "secondary_lateral_damping", "secondary_vertical_stiffness", "secondary_vertical_damping", "roll_bar_stiffness",
    "design_conicity", "design_contact_angle_rate", "design_contact_curvature", "design_wheel_load",
)  # fmt: skip
"""Nominal parameters of the reduction, SI units."""


def lateral(vehicle: Parameters, outputs: Sequence[Output], speed: float) -> System:
    """States: the coordinates (m, rad), then their rates; inputs path and cross level under the leading wheelset, then
    under the trailing one. The coordinates are `COORDINATES`, or `WHOLE` where `PIVOT` is among the parameters.
    """
    return _system(vehicle, outputs, speed, WHOLE if PIVOT in vehicle else COORDINATES, 1)


def both_bogies(vehicle: Parameters, outputs: Sequence[Output], speed: float) -> System:
    """A whole vehicle whose other bogie runs too: coordinates `BOTH`, inputs under the wheelsets 1 to 4."""
    return _system(vehicle, outputs, speed, BOTH, 2)


def along_the_track(vehicle: Parameters, outputs: Sequence[Output], speed: float, k: np.ndarray) -> np.ndarray:
    """Outputs of a whole vehicle with both bogies on the same track, over its path and cross level under the leading
    wheelset, complex, shape (k, outputs, 2).

    Parameters
    ----------
    vehicle : with `PIVOT`. speed : m/s. k : wave numbers, rad/m, shape (k,).
    """
    pivot, base = vehicle[PIVOT], 2.0 * vehicle["semi_wheelbase"]
    by_each = both_bogies(vehicle, outputs, speed).response(k * speed)
    late = np.exp(-1j * np.outer(k, [0.0, base, 2.0 * pivot, 2.0 * pivot + base]))
    return np.einsum("kmwq,kw->kmq", by_each.reshape(len(k), len(outputs), 4, 2), late)


def _system(
    vehicle: Parameters, outputs: Sequence[Output], speed: float, coordinates: tuple[str, ...], rolling: int
) -> System:
    """The system of some coordinates; `rolling` : bogies whose wheelsets roll, from the first on; others are held."""
    parts = _parts(frozenset(vehicle.items()), coordinates, rolling)
    moving = parts.moving
    A, B, E = parts.at(speed).first_order()
    rows = [_row(vehicle, output, A, B, E, moving) for output in outputs]
    C, D, G, J, feels = (np.array(part) for part in zip(*rows, strict=True))
    return System(A, B, E, C, D, G, J if J.any() else None, feels)


def followed(
    vehicle: Mapping[str, Any], speed: float, wave_number: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bogie's yaw over the slope of the rails' path, and over that of the height r phi; its roll over the rails' roll
    phi. Everything under the bogie's centre, complex, shapes (n,); 1, 0, 1 at wave number 0.

    Parameters
    ----------
    vehicle : nominal parameters by field name, SI units. speed : V, m/s. wave_number : rad/m, shape (n,).

    Raises
    ------
    InputError : a parameter is missing.
    """
    p, k = numbers(vehicle, NEEDED), np.asarray(wave_number, dtype=float)
    moving = np.where(k == 0.0, 1.0, k)
    systems = [lateral(p, [Output("angle", axis=axis) for axis in ("yaw", "roll")], speed)]
    lead, trail = np.split(responses(systems, moving * speed)[0], 2, axis=-1)
    ahead = np.exp(1j * moving * p["semi_wheelbase"])[:, None, None]
    angles = lead * ahead + trail / ahead
    by_roll = -2.0 * p["half_gauge"] * angles[:, :, 1]
    path, height = angles[:, 0, 0] / (1j * moving), by_roll[:, 0] / (1j * moving * p["wheel_radius"])
    still = k == 0.0
    return np.where(still, 1.0, path), np.where(still, 0.0, height), np.where(still, 1.0, by_roll[:, 1])


def equations(p: Parameters, speed: float) -> Reduced:
    """Equations of motion at a speed, m/s."""
    return _parts(frozenset(p.items()), WHOLE if PIVOT in p else COORDINATES, 1).at(speed)


class _Parts(NamedTuple):
    """Equations of motion by how their damping depends on the speed.

    Attributes
    ----------
    moving : kinematics. held : whatever the speed. creeping : damping over the speed. spinning : damping times it.
    """

    moving: Kinematics
    held: Reduced
    creeping: Reduced
    spinning: Reduced

    def at(self, speed: float) -> Reduced:
        """At a speed, m/s."""
        held, creep, spin = self.held, self.creeping, self.spinning
        return replace(
            held,
            damping=held.damping + creep.damping / speed + spin.damping * speed,
            stiffness=held.stiffness + creep.stiffness,
            input_damping=held.input_damping + creep.input_damping / speed + spin.input_damping * speed,
            input_stiffness=held.input_stiffness + creep.input_stiffness,
        )


@lru_cache(maxsize=VEHICLES)
def _parts(vehicle: frozenset[tuple[str, float]], coordinates: tuple[str, ...], rolling: int) -> _Parts:
    """Of a vehicle whose first bogies roll, `rolling` of them."""
    p = dict(vehicle)
    geometry, above = arcs(p), heights(p)
    bogies, body = half_vehicle_bogies(p), p
    if PIVOT in p:
        bogies = whole_vehicle_bogies(p, p[PIVOT])  # one that has no coordinates is held
        body = {**p, "body_mass": 2.0 * p["body_mass"], "body_roll_inertia": 2.0 * p["body_roll_inertia"]}
    of, slopes = wheelsets(p, bogies[:rolling]), polach_slopes(p, geometry.angle)
    moving = _kinematics(p, geometry, coordinates, of)
    held = suspension_elements(body, bogies, above) + [one for each in of for one in weight(each, geometry)]
    creep = [one for each in of for one in creep_forces(each, slopes, 1.0, moment_of_spin=False)]
    spin = [one for each in of for one in gyroscopic(each, 1.0)]
    inertias = masses(body, bogies, coordinates)
    return _Parts(moving, *(reduce(some, inertias, moving) for some in (held, creep, spin)))


def _kinematics(
    p: Parameters, geometry: ContactGeometry, coordinates: Sequence[str], rolling: Sequence[Wheelset]
) -> Kinematics:
    """Wheelsets that keep to the rails' path and cross level."""
    leaning: dict[str, Row] = {
        f"{one.name}.rail_roll": {f"{one.name}.cross_level": -0.5 / p["half_gauge"]} for one in rolling
    }
    rails = [f"{one.name}.{motion}" for one in rolling for motion in ("rail_y", "cross_level")]
    return Kinematics(coordinates, rails, leaning | relations(geometry, rolling))


def _row(
    p: Parameters, output: Output, A: np.ndarray, B: np.ndarray, E: np.ndarray, moving: Kinematics
) -> tuple[np.ndarray, ...]:
    """C, D, G, J of one output, and how it feels the coordinates' accelerations."""
    count = len(moving.coordinates)
    still, deaf, x, y, z = np.zeros(len(moving.inputs)), np.zeros(count), *output.position
    wheelset = WHEELSETS[0 if x > 0 else 1]

    def specific_force(direction: Row, tilt: Row) -> tuple[np.ndarray, ...]:
        """Acceleration along a direction with gravity's share by the roll."""
        (moved, of_rails), (rolled, rolled_rails) = moving.row(direction), moving.row(tilt)
        states = moved @ A[count:]
        states[:count] += GRAVITY * rolled
        return states, moved @ B[count:] + GRAVITY * rolled_rails, moved @ E[count:], of_rails, moved

    if output.kind in ("rate", "angle"):
        turned = moving.row({f"bogie.{output.axis}": 1.0})[0]
        states = np.append(deaf, turned) if output.kind == "rate" else np.append(turned, deaf)
        return states, still, still, still, deaf
    if output.kind == "acceleration":
        return specific_force({"bogie.y": 1.0, "bogie.roll": -z, "bogie.yaw": x}, {"bogie.roll": 1.0})
    if output.kind == "axlebox":
        return specific_force({f"{wheelset}.y": 1.0}, {f"{wheelset}.roll": 1.0})
    if output.kind == "lift":
        return specific_force({f"{wheelset}.roll": y}, {})
    arm = p["primary_half_spacing"]
    moved, of_rails = moving.row({"bogie.roll": arm, f"{wheelset}.roll": -arm})
    return np.append(moved, deaf), of_rails, still, still, deaf
