"""Linear answers of the channels to forces between the bodies, and the force that a run has at each of these places.

Straight track, constant speed; equations of small motion about the steady state by `railsim.analysis.linear`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from railsim.analysis.linear import Linearised, linearise
from railsim.constants import GRAVITY
from railsim.model import TRACK, LinearElement, Model, NonlinearElement
from railsim.sensors.displacement import Displacement
from railsim.sensors.errors import low_pass
from railsim.sensors.inertial import InertialSensor
from railsim.sensors.interface import Sensor
from railsim.sensors.lateral_displacement import LateralDisplacement
from railsim.vehicles.draw_gear import TRAIN

Row = dict[str, complex | np.ndarray]
"""Factors by the names of coordinates."""

AXES = {"x": 0, "y": 1, "z": 2, "roll": 3, "yaw": 5}
"""Of forces and moments, with their place in an element's matrices."""


@dataclass(frozen=True)
class Place:
    """A force or moment between two bodies that elements join, or of the rails on a wheelset (`lower` empty)."""

    name: str
    upper: str
    lower: str
    axis: str
    at: tuple[float, float, float]


def places(model: Model) -> tuple[Place, ...]:
    """Axes along which something acts between two bodies of the vehicle that a linear element joins; and contacts."""
    found: dict[str, Place] = {}
    for one in (one for one in model.elements if TRAIN not in (one.upper, one.lower)):
        for axis in AXES:
            place = Place(f"{one.name} {axis}", one.upper, one.lower, axis, one.position)
            if np.any(_impedance(model, place, np.ones(1))) and _opens(model, place):
                found.setdefault(f"{one.upper} {one.lower} {axis}", place)
    contacts = [
        Place(
            f"contact of {one.body} {axis}",
            one.body,
            "",
            axis,
            (model.bodies[model.index(one.body)].position[0], 0.0, 0.0),
        )
        for one in model.wheelsets
        for axis in ("y", "z", "yaw")
    ]
    return (*found.values(), *contacts)


def _opens(model: Model, place: Place) -> bool:
    """Whether the place can open; along the track, only where one of its bodies moves along it."""
    moved = opening(model, place)
    return any(name.endswith(".x") for name in moved) if place.axis == "x" else bool(moved)


def needed(model: Model) -> tuple[str, ...]:
    """Channels of truth that tell the forces at all places."""
    return tuple(dict.fromkeys(one for place in places(model) for one in _needed(model, place)))


@dataclass(frozen=True)
class Answers:
    """Small motion of a model at a speed [m/s], at frequencies f [Hz] (F,); `channels`: the sensor of each."""

    model: Model
    speed: float
    channels: Mapping[str, Sensor]
    f: np.ndarray

    @cached_property
    def places(self) -> tuple[Place, ...]:
        """Where forces act."""
        return places(self.model)

    @cached_property
    def forces(self) -> np.ndarray:
        """(F, channels, places) of each channel to 1 N or 1 N m at each place, upwards (or to the left) on its upper
        body.
        """
        linear, omega = linearise(self.model, self.speed), 2.0 * np.pi * self.f
        dynamic, names = _dynamic(linear, omega), list(linear.names)
        kept = [k for k in range(len(names)) if linear.stiffness[:, k].any()]
        loads = np.stack([_vector(names, opening(self.model, one)) for one in self.places], axis=1)
        shape = (len(omega), len(kept), len(self.places))
        motion = np.linalg.solve(dynamic[:, kept][:, :, kept], np.broadcast_to(loads[kept], shape))
        rows = np.stack([_vector(names, read(self.model, n, one, omega), omega) for n, one in self.channels.items()], 1)
        return rows[:, :, kept] @ motion

    def acting(self, place: Place, frames: Mapping[str, np.ndarray]) -> np.ndarray:
        """(F, frames) the force that acts at a place; `frames`: (F, frames) of what is needed, by name."""
        if place.lower:
            return _impedance(self.model, place, 2.0 * np.pi * self.f)[:, None] * self.opened(place, frames)
        left, right = (frames[name] for name in _needed(self.model, place))
        return (right - left) * self._half_gauge(place) if place.axis == "yaw" else left + right

    def opened(self, place: Place, frames: Mapping[str, np.ndarray]) -> np.ndarray:
        """(F, frames) [m or rad] how far a place between two bodies opens."""
        row = opened_by(self.model, place)
        return sum((factor * frames[name] for name, factor in row.items()), np.zeros(1))

    def _half_gauge(self, place: Place) -> float:
        return next(one.axlebox_half_spacing for one in self.model.wheelsets if one.body == place.upper)


def _dynamic(linear: Linearised, omega: np.ndarray) -> np.ndarray:
    """(F, n, n), with the states of elements taken out."""
    s, count = 1j * omega[:, None, None], len(linear.names)
    found = s**2 * linear.mass + s * linear.damping + linear.stiffness
    if linear.state_forces.shape[1]:
        by_place, by_rate, own = np.split(linear.state_rates, [count, 2 * count], axis=1)
        states = np.linalg.solve(s * np.eye(len(own)) - own, by_place + s * by_rate)
        found = found - linear.state_forces @ states
    return found


def _needed(model: Model, place: Place) -> list[str]:
    if place.lower:
        return list(opened_by(model, place))
    number = 1 + [one.body for one in model.wheelsets].index(place.upper)
    quantity = {"z": "normal_force", "y": "creep_force_y", "yaw": "creep_force_x"}[place.axis]
    return [f"wheel{number}_{side}.{quantity} [N]" for side in ("left", "right")]


def opening(model: Model, place: Place) -> dict[str, float]:
    """How far a place opens with each coordinate, by name; the generalised forces of 1 N there (virtual work)."""
    row = model.relative(place.upper, place.lower or TRACK, place.at)[AXES[place.axis], model.free]
    return {name: float(factor) for name, factor in zip(model.names, row, strict=True) if factor}


def opened_by(model: Model, place: Place) -> dict[str, float]:
    """The same with each channel of truth."""
    return {f"{name} [{'m' if name.rpartition('.')[2] in ('x', 'y', 'z') else 'rad'}]": factor
            for name, factor in opening(model, place).items()}  # fmt: skip


def _impedance(model: Model, place: Place, omega: np.ndarray) -> np.ndarray:
    """(F,) force over opening of all that joins the two bodies along an axis."""
    pair, k = {place.upper, place.lower}, AXES[place.axis]
    found = np.zeros(len(omega), complex)
    for one in (*model.elements, *model.nonlinear):
        if {one.upper, one.lower} != pair:
            continue
        if isinstance(one, LinearElement):
            found += one.stiffness[k, k] + 1j * omega * one.damping[k, k]
        else:
            arm = {("x", "yaw"): one.position[1], (place.axis, place.axis): 1.0}.get((one.axis, place.axis), 0.0)
            found += arm**2 * _damper(one, omega)
    return found


def _damper(one: NonlinearElement, omega: np.ndarray) -> np.ndarray:
    """Small motion of a damper, with its spring in series; nothing of other laws."""
    damping, spring = getattr(one.law, "damping", 0.0), getattr(one.law, "stiffness", np.inf)
    if not damping or not hasattr(one.law, "velocity"):
        return np.zeros(len(omega), complex)
    return 1.0 / (1.0 / (1j * omega * damping) + 1.0 / spring)


def _vector(
    names: Sequence[str], row: Mapping[str, complex | np.ndarray], omega: np.ndarray | None = None
) -> np.ndarray:
    """(coordinates,) or, over frequencies, (F, coordinates)."""
    found = np.zeros(len(names)) if omega is None else np.zeros((len(omega), len(names)), complex)
    for name, factor in row.items():
        if name in names:
            found[..., names.index(name)] += factor
    return found


def read(model: Model, channel: str, sensor: Sensor, omega: np.ndarray) -> Row:
    """What a channel shows of small motion, its filter and latency included."""
    if isinstance(sensor, InertialSensor):
        row = _inertial(sensor, channel.partition(" ")[0].rpartition("_")[2], omega)
    elif isinstance(sensor, Displacement):
        row = _spring(model, sensor.element)
    elif isinstance(sensor, LateralDisplacement):
        row = {f"{sensor.body}.y": 1.0, f"{sensor.body}.yaw": sensor.arm, f"{sensor.other}.y": -1.0}
    else:
        row = {}
    answer = np.exp(-1j * omega * sensor.errors.latency)
    if sensor.errors.bandwidth is not None:
        answer = answer * low_pass(omega, sensor.errors.bandwidth, sensor.errors.bandwidth_order)
    return {name: factor * answer for name, factor in row.items()}


def _inertial(sensor: InertialSensor, axis: str, omega: np.ndarray) -> Row:
    """Acceleration at the sensor's place with what gravity adds as the body turns; or a rate."""
    body, (x, y, z), squared = sensor.body, sensor.position, -(omega**2)
    rows: dict[str, Row] = {
        "x": {"x": squared, "pitch": squared * z - GRAVITY, "yaw": -squared * y},
        "y": {"y": squared, "roll": GRAVITY - squared * z, "yaw": squared * x},
        "z": {"z": squared, "roll": squared * y, "pitch": -squared * x},
    }
    row = rows.get(axis, {axis: 1j * omega})
    return {f"{body}.{name}": factor for name, factor in row.items()}


def _spring(model: Model, name: str) -> Row:
    """Opening of a primary spring: frame less wheelset at the axlebox."""
    number, _, side = name.removeprefix("primary").partition("_")
    wheelset = model.wheelsets[int(number) - 1]
    aside = wheelset.axlebox_half_spacing * (1.0 if side == "left" else -1.0)
    frame = wheelset.frame or model.reference
    ahead, _, high = model.bodies[model.index(wheelset.body)].position
    return dict(opening(model, Place("", frame, wheelset.body, "z", (ahead, aside, high))))
