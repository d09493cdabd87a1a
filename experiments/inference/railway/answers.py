"""Linear answers of vertical channels to forces between the bodies, and the predicted force at each of these places.

Straight track, constant speed; equations of small motion about the steady state by `railsim.analysis.linear`.
"""

from dataclasses import dataclass

import numpy as np

from railsim.analysis.linear import Linearised, linearise
from railsim.model import Model
from railsim.sensors.errors import low_pass
from railsim.sensors.interface import Sensor


@dataclass(frozen=True)
class Place:
    """Vertical force between two bodies that an element joins, or on a body from its contacts (`lower` empty)."""

    name: str
    upper: str
    lower: str
    ahead: float
    stiffness: float = 0.0
    damping: float = 0.0

    @property
    def needs(self) -> tuple[str, ...]:
        """Channels of truth that tell the force."""
        if not self.lower:
            number = self.upper.removeprefix("wheelset")
            return tuple(f"wheel{number}_{side}.normal_force [N]" for side in ("left", "right"))
        ends = (self.upper, self.lower)
        return tuple(f"{one}.{axis}" for one in ends for axis in ("z [m]", "pitch [rad]"))


def places(model: Model) -> tuple[Place, ...]:
    """Joints that have a vertical stiffness, and the contacts of each wheelset."""
    found = [
        Place(one.name, one.upper, one.lower, one.position[0], one.stiffness[2, 2], one.damping[2, 2])
        for one in model.elements
        if one.stiffness[2, 2] > 0.0
    ]
    found += [Place(f"contact of {one.body}", one.body, "", 0.0) for one in model.wheelsets]
    return tuple(found)


@dataclass(frozen=True)
class Answers:
    """(F, channels, places) of each channel to 1 N at each place [channel/N]."""

    places: tuple[Place, ...]
    forces: np.ndarray

    @classmethod
    def of(cls, model: Model, speed: float, channels: dict[str, Sensor], f: np.ndarray) -> "Answers":
        """At frequencies f [Hz]; `channels`: the sensor of each."""
        linear, found, omega = linearise(model, speed), places(model), 2.0 * np.pi * f
        names = list(linear.names)
        dynamic = _dynamic(linear, omega)
        kept = [k for k, name in enumerate(names) if linear.stiffness[:, k].any()]
        loads = np.stack([_load(model, names, one) for one in found], axis=1)
        shape = (len(f), len(kept), len(found))
        motion = np.linalg.solve(dynamic[:, kept][:, :, kept], np.broadcast_to(loads[kept], shape))
        rows = np.stack([_read(model, names, one, name, omega) for name, one in channels.items()], axis=1)
        return cls(found, rows[:, :, kept] @ motion)


def _dynamic(linear: Linearised, omega: np.ndarray) -> np.ndarray:
    s = 1j * omega[:, None, None]
    return s**2 * linear.mass + s * linear.damping + linear.stiffness


def _ahead(model: Model, body: str) -> float:
    return model.bodies[model.index(body)].position[0]


def _load(model: Model, names: list[str], place: Place) -> np.ndarray:
    """Generalised forces of 1 N upwards on the upper body and downwards on the lower one."""
    load = np.zeros(len(names))
    for body, sign in ((place.upper, 1.0), (place.lower, -1.0)):
        for axis, arm in (("z", 1.0), ("pitch", -(place.ahead - _ahead(model, body)) if body and place.lower else 0.0)):
            if f"{body}.{axis}" in names:
                load[names.index(f"{body}.{axis}")] += sign * arm
    return load


def _read(model: Model, names: list[str], sensor: Sensor, channel: str, omega: np.ndarray) -> np.ndarray:
    """(F, coordinates) what a channel shows of small motion, its filter and latency included."""
    row = np.zeros((len(omega), len(names)), complex)
    quantity = channel.split(".")[1].split(" ")[0]

    def add(body: str, axis: str, factor: complex | np.ndarray) -> None:
        if f"{body}.{axis}" in names:
            row[:, names.index(f"{body}.{axis}")] += factor

    if quantity == "acceleration_z":
        for axis, arm in (("z", 1.0), ("roll", sensor.position[1]), ("pitch", -sensor.position[0])):
            add(sensor.body, axis, -(omega**2) * arm)
    elif quantity == "displacement":
        _spring(model, sensor.name, add)
    errors = sensor.errors
    answer = np.exp(-1j * omega * errors.latency)
    if errors.bandwidth is not None:
        answer = answer * low_pass(omega, errors.bandwidth, errors.bandwidth_order)
    return row * answer[:, None]


def _spring(model: Model, name: str, add: object) -> None:
    """Opening of a primary spring: frame less wheelset at the axlebox."""
    number, _, side = name.removeprefix("primary").partition("_")
    wheelset = model.wheelsets[int(number) - 1]
    aside = wheelset.axlebox_half_spacing * (1.0 if side == "left" else -1.0)
    ahead = _ahead(model, wheelset.body)
    assert callable(add)
    for body, sign in ((model.reference, 1.0), (wheelset.body, -1.0)):
        arms = (("z", 1.0), ("roll", aside), ("pitch", -(ahead - _ahead(model, body))))
        for axis, arm in arms:
            add(body, axis, sign * arm)


def force_of(place: Place, model: Model, channels: dict[str, np.ndarray], f: np.ndarray) -> np.ndarray:
    """(F, frames) the force that acts at a place; `channels`: (F, frames) of what it needs, by name."""
    if not place.lower:
        return sum((channels[name] for name in place.needs), np.zeros(1))
    opening = np.zeros(1)
    for body, sign in ((place.upper, 1.0), (place.lower, -1.0)):
        arm = -(place.ahead - _ahead(model, body))
        if f"{body}.z [m]" in channels:
            opening = opening + sign * channels[f"{body}.z [m]"]
        if f"{body}.pitch [rad]" in channels and f"{body}.pitch" in model.names:
            opening = opening + sign * arm * channels[f"{body}.pitch [rad]"]
    return (place.stiffness + 2j * np.pi * f[:, None] * place.damping) * opening
