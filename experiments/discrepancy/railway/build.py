"""Coordinates of a healthy vehicle and its sensors: build within tolerance, payload, alignment, mounting."""

from collections.abc import Mapping, Sequence
from functools import reduce
from typing import Any

import numpy as np

from experiments.discrepancy.core.model import DIFFERENCE, Coordinate
from experiments.discrepancy.railway.creep_law import as_run
from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.tolerances import REAR, SPRINGS, Tolerance, tolerances, within
from railsim.effects.interface import Effect as Plugin
from railsim.effects.interface import Setup
from railsim.effects.payload import Payload
from railsim.errors import InputError
from railsim.speed import Profile
from railsim.track.track import Track
from railsim.vehicles.interface import Vehicle

PAYLOAD = 1500.0  # kg; spread of what nobody has weighed
OFFSET, WANDER = 0.3, 0.02  # m at mid-run and of each slow sine, after registration
SCALE = 2e-3  # of the speed, after registration
ROLLING = 0.2  # of what the nominal vehicle's wheel rolls: twelve builds drawn within their tolerances in a curve
PERIOD = 8.0  # s of the run for each slow sine
GAIN, DELAY = 0.01, 2e-4  # -, s; where the data sheet states no spread of the scale
TURN = -np.cross(np.eye(3)[None], np.eye(3)[:, None])
"""(turn about, axis that shows, axis of the body): what a small turn of a sensor lets its axes show."""


def named(one: Tolerance) -> str:
    """Name of a build's coordinate."""
    return f"log {one.key}"


def built_coordinates(vehicle: Vehicle) -> list[Coordinate]:
    """Logs of a build's numbers, and the payload. What may be no larger than the sheet has it is varied downwards."""
    logs = [
        Coordinate(named(one), "-", 0.0, one.spread, None if one.most > DIFFERENCE else -DIFFERENCE * one.spread)
        for one in tolerances(vehicle)
    ]
    return [*logs, Coordinate("load", "kg", 0.0, PAYLOAD)]


def leading_alone(coordinates: Sequence[Coordinate]) -> list[tuple[tuple[str, float], ...]]:
    """Coordinates that together are a number of the leading bogie alone: that of both, less the rear one's factor."""
    names = [one.name for one in coordinates]
    pairs = [(name, name.replace("log ", f"log {REAR}.", 1)) for name in names]
    return [((both, 1.0), (rear, -1.0)) for both, rear in pairs if rear != both and rear in names]


def vehicle_at(vehicle: Vehicle, values: Mapping[str, float]) -> Any:
    """The vehicle with these logs of its numbers, each within what it may be. Heights that it leaves to that of the
    springs stay where they are when springs act higher.
    """
    moved: dict[str, dict[str, Any]] = {}
    higher = values.get(f"log {SPRINGS}", 0.0) != 0.0
    for one in tolerances(vehicle):
        owner, change = vehicle if one.part == "vehicle" else getattr(vehicle, one.part), values.get(named(one), 0.0)
        if change or (higher and getattr(owner, one.name) is None):
            moved.setdefault(one.part, {})[one.name] = within(one.value(change), owner, one.name)
    parts = {part: getattr(vehicle, part).but(**numbers) for part, numbers in moved.items() if part != "vehicle"}
    return vehicle.but(**moved.get("vehicle", {}), **parts) if moved else vehicle


def along_coordinates(record: Record) -> list[Coordinate]:
    """Alignment with the track: place at mid-run, scale of the speed, slow sines; how the tachometer's wheel rolls."""
    sines = max(2, round(record.duration / PERIOD))
    scale = max(SCALE, 0.2 * record.evidence.speed.scale_std)
    return [
        Coordinate("offset", "m", 0.0, OFFSET, 1e-3), Coordinate("speed", "-", 0.0, scale, 1e-5),
        *(Coordinate(f"wander {k + 1}", "m", 0.0, WANDER, 1e-3) for k in range(sines)),
        *([Coordinate("rolling", "-", 0.0, ROLLING)] if record.evidence.speed.wheel else []),
    ]  # fmt: skip


def sensor_coordinates(record: Record) -> list[Coordinate]:
    """Gains and delays of channels, turns of sensors: no run is needed for them."""
    gains = [
        Coordinate(f"gain {name}", "-", 0.0, max(one.errors.scale_error_std, GAIN), cheap=True)
        for name, one in record.channels.items()
    ]
    delays = [Coordinate(f"delay {name}", "s", 0.0, DELAY, cheap=True) for name in record.channels]
    turns = [
        Coordinate(f"turn {sensor.kind} {sensor.name} {axis}", "rad", 0.0, sensor.errors.misalignment_std, cheap=True)
        for sensor in dict.fromkeys(record.channels.values())
        if record.mounted(sensor)
        for axis in "xyz"
    ]
    return [*gains, *delays, *turns]


def turns(record: Record) -> tuple[list[str], np.ndarray]:
    """Components that the ideal sensors show, and what the channels are of them: (1 + turns, channels, components),
    first without turns, then by each of them [1/rad].
    """
    components = [name for one in record.ideal for name in one.channels()]
    whole = np.zeros((1, len(record.channels), len(components)))
    for row, name in enumerate(record.channels):
        whole[0, row, components.index(name)] = 1.0
    found = [whole]
    for sensor in (one for one in record.ideal if record.mounted(_own(record, one))):
        names, part = sensor.channels(), np.zeros((3, *whole.shape[1:]))
        for axis, name in enumerate(names):
            if name in record.channels:
                row = list(record.channels).index(name)
                part[:, row, [components.index(one) for one in names]] = TURN[:, axis]
        found.append(part)
    return components, np.concatenate(found)


def _own(record: Record, ideal: Any) -> Any:
    return next(one for one in record.channels.values() if (one.kind, one.name) == (ideal.kind, ideal.name))


def setup_at(record: Record, track: Track, values: Mapping[str, float], effects: tuple[Plugin, ...]) -> Setup:
    """The setup with these coordinates over a track, with the effects of the nominal scenario and these.

    Raises
    ------
    InputError : an effect does not fit, or there is no such vehicle to install it on.
    """
    scenario = record.scenario
    setup = Setup(
        vehicle_at(as_run(scenario.vehicle), values), track, record.ideal, speed_at(record, values), scenario.traction,
        float(record.clock.model(np.array(record.duration))), flexible_track=scenario.flexible_track,
    )  # fmt: skip
    laden = values.get("load", 0.0)
    load = (Payload.build({"mass": float(np.clip(laden, -2000.0, 10e3))}),) if laden else ()
    try:
        return reduce(lambda made, effect: effect.install(made), (*scenario.effects, *load, *effects), setup)
    except ValueError as error:  # as a wheel that does not fit its rail
        raise InputError(str(error)) from error


def speed_at(record: Record, values: Mapping[str, float]) -> Profile:
    """Speed over the model's time with its scale and its slow sines."""
    return _profile(*record.clock.profile(*_speed(record, values)))


def recorded_speed(record: Record, values: Mapping[str, float]) -> Profile:
    """The same over the recording's time."""
    return _profile(*_speed(record, values))


def _speed(record: Record, values: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    time, speed = record.speed
    sizes = np.array([value for name, value in values.items() if name.startswith("wander")])
    turn = np.pi * np.arange(1, len(sizes) + 1) / record.duration
    rolled = record.registration.rolling ** values.get("rolling", 0.0)
    moved = speed * (1.0 + values.get("speed", 0.0)) / rolled + (sizes * turn) @ np.cos(turn[:, None] * time)
    return time, np.clip(moved, 0.0, 119.0)


def _profile(time: np.ndarray, speed: np.ndarray) -> Profile:
    return Profile(kind="profile", time=tuple(time.tolist()), speed=tuple(speed.tolist()))
