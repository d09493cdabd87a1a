"""Linear answer of the channels to forces and moments between the bodies, on straight track at constant speed."""

from dataclasses import dataclass

import numpy as np

from railsim.analysis.linear import Linearised, linearise
from railsim.constants import GRAVITY
from railsim.model import Model
from railsim.sensors.errors import low_pass
from railsim.sensors.interface import Sensor

DIRECTIONS = ("y", "z", "roll", "pitch", "yaw")
READING = "reading"
LOWEST = 0.25  # Hz; below it stiffness in place of the answer


@dataclass(frozen=True)
class Place:
    """Where something can be missing: a force along one direction between two bodies, or on one body from outside
    (`lower` empty); or in what a channel shows (direction "reading", `upper` its name).
    """

    upper: str
    lower: str
    direction: str

    @property
    def label(self) -> str:
        """In words."""
        if self.direction == READING:
            return f"reading of {self.upper}"
        what = "moment" if self.direction in ("roll", "pitch", "yaw") else "force"
        where = f"between {self.upper} and {self.lower}" if self.lower else f"on {self.upper} from outside"
        return f"{self.direction} {what} {where}"

    @property
    def unit(self) -> str:
        """Of the force."""
        if self.direction == READING:
            return "unit of the channel"
        return "N m" if self.direction in ("roll", "pitch", "yaw") else "N"


def places(model: Model) -> list[Place]:
    """Every direction of every joint, and every free direction of every body."""
    joints = {(element.upper, element.lower) for element in model.elements}
    free = set(model.names)
    found = [
        Place(upper, lower, direction)
        for upper, lower in sorted(joints)
        for direction in DIRECTIONS
        if f"{upper}.{direction}" in free or f"{lower}.{direction}" in free
    ]
    return found + [
        Place(body.name, "", direction)
        for body in model.bodies
        for direction in DIRECTIONS
        if f"{body.name}.{direction}" in free
    ]


def readings(channels: tuple[str, ...], f: np.ndarray) -> tuple[list[Place], np.ndarray]:
    """Every channel as a place of its own, and its answers (channels, f, channels) to itself."""
    own = np.repeat(np.eye(len(channels), dtype=complex)[:, None, :], len(f), axis=1)
    return [Place(name.split(" [")[0], "", READING) for name in channels], own


def answers(
    model: Model,
    speed: float,
    found: list[Place],
    sensors: tuple[Sensor, ...],
    channels: tuple[str, ...],
    f: np.ndarray,
) -> np.ndarray:
    """(places, f, channels) complex answer of each channel to one newton (newton metre) at each place."""
    linear = linearise(model, speed)
    names = list(linear.names)
    omega = 2.0 * np.pi * np.maximum(f, LOWEST)
    dynamic = -(omega[:, None, None] ** 2) * linear.mass + 1j * omega[:, None, None] * linear.damping + linear.stiffness
    held = [i for i in range(len(names)) if linear.stiffness[:, i].any()]
    dynamic, names = dynamic[np.ix_(range(len(f)), held, held)], [names[i] for i in held]
    loads = np.zeros((len(found), len(names)))
    for row, place in enumerate(found):
        for body, sign in ((place.upper, 1.0), (place.lower, -1.0)):
            loads[row] += sign * _load(model, names, body, place)
    motion = np.linalg.solve(dynamic, np.broadcast_to(loads.T, (len(f), *loads.T.shape)))  # (f, n, places)
    rows = np.stack([_read(model, names, sensors, name, omega) for name in channels])  # (channels, f, n)
    return np.einsum("cfn,fnp->pfc", rows, motion)


def _load(model: Model, names: list[str], body: str, place: Place) -> np.ndarray:
    """Generalised forces on the free coordinates of one body."""
    load = np.zeros(len(names))
    key = f"{body}.{place.direction}"
    if key in names:
        load[names.index(key)] = 1.0
    joint = next((e for e in model.elements if {e.upper, e.lower} == {place.upper, place.lower}), None)
    if joint is None or not body:
        return load
    arm = np.subtract(joint.position, model.bodies[model.index(body)].position)
    moments = {"y": {"roll": -arm[2], "yaw": arm[0]}, "z": {"roll": arm[1], "pitch": -arm[0]}}
    for axis, lever in moments.get(place.direction, {}).items():
        if f"{body}.{axis}" in names:
            load[names.index(f"{body}.{axis}")] += lever
    return load


def _read(model: Model, names: list[str], sensors: tuple[Sensor, ...], channel: str, omega: np.ndarray) -> np.ndarray:
    """(f, n) what a channel shows of small motion, its filter included."""
    sensor = next(one for one in sensors if channel in one.channels())
    row = np.zeros((len(omega), len(names)), complex)

    def add(body: str, axis: str, factor: np.ndarray) -> None:
        if f"{body}.{axis}" in names:
            row[:, names.index(f"{body}.{axis}")] += factor

    quantity = channel.split(".")[1].split(" ")[0]
    one = np.ones_like(omega)
    x, y, z = sensor.position
    second = -(omega**2) + 0j
    if quantity == "acceleration_y":
        add(sensor.body, "y", second)
        add(sensor.body, "yaw", second * x)
        add(sensor.body, "roll", -second * z + GRAVITY * one)
    elif quantity == "acceleration_z":
        add(sensor.body, "z", second)
        add(sensor.body, "roll", second * y)
        add(sensor.body, "pitch", -second * x)
    elif quantity.startswith("rate_"):
        add(sensor.body, quantity.removeprefix("rate_"), 1j * omega)
    elif quantity == "displacement":
        _displacement(model, getattr(sensor, "across", None) or sensor.name, add, one)
    return row * _filter(sensor, omega)[:, None]


def _displacement(model: Model, name: str, add: object, one: np.ndarray) -> None:
    """Vertical opening of a primary spring."""
    number = int(name[len("primary")]) if name.startswith("primary") else 0
    if not 0 < number <= len(model.wheelsets) or not callable(add):
        return
    wheelset = model.wheelsets[number - 1]
    x = model.bodies[model.index(wheelset.body)].position[0]
    half = wheelset.axlebox_half_spacing * (1.0 if name.endswith("left") else -1.0)
    for axis, factor in (("z", 1.0), ("pitch", -x), ("roll", half)):
        add(model.reference, axis, factor * one)
    for axis, factor in (("z", -1.0), ("roll", -half)):
        add(wheelset.body, axis, factor * one)


def _filter(sensor: Sensor, omega: np.ndarray) -> np.ndarray:
    """Butterworth low-pass and latency."""
    errors = sensor.errors
    answer = np.exp(-1j * omega * errors.latency)
    if errors.bandwidth is None:
        return answer
    return answer * low_pass(omega, errors.bandwidth, errors.bandwidth_order)


__all__ = ["Linearised", "Place", "answers", "places", "readings"]
