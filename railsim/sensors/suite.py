"""A set of sensors: read from settings, measured together, each with its own random stream."""

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from railsim.errors import InputError
from railsim.sensors.interface import SENSORS, Sensor
from railsim.truth import TIME, Truth


def build_sensor(settings: Any, where: str = "sensors") -> Sensor:
    """A sensor from its settings: "kind" and the fields of that kind.

    Raises
    ------
    InputError : no or an unknown kind, an unknown key, a value out of bounds; the line begins with `where`.
    """
    if isinstance(settings, Sensor):
        return settings
    if not isinstance(settings, Mapping) or not isinstance(settings.get("kind"), str):
        raise InputError(f"{where}: a sensor needs a kind; give one of: {', '.join(SENSORS.classes())}")
    kind = SENSORS.pick(settings["kind"])
    given = {name: value for name, value in settings.items() if name != "kind"}
    return kind.build(given, f"{where}.{given['name']}" if isinstance(given.get("name"), str) else where)


def build_sensors(settings: Sequence[Any], where: str = "sensors") -> tuple[Sensor, ...]:
    """All sensors of a scenario; raises `InputError` as `build_sensor`, or where two give the same channel."""
    built = tuple(build_sensor(one, where) for one in settings)
    check_distinct(built)
    return built


def check_distinct(suite: Sequence[Sensor]) -> None:
    """Raise `InputError` that names the first channel that two sensors give."""
    owner: dict[str, Sensor] = {}
    for sensor in suite:
        for channel in sensor.channels():
            if channel in owner:
                kind = owner[channel].kind
                raise InputError(f"sensors: a {kind} and a {sensor.kind} both give '{channel}'; rename one of the two")
            owner[channel] = sensor


def random_stream(sensor: Sensor, seed: int) -> np.random.Generator:
    """The sensor's own random stream, by seed, kind and name: other sensors do not change it."""
    digest = hashlib.sha256(f"{sensor.kind}:{sensor.name}".encode()).digest()
    words = tuple(int(word) for word in np.frombuffer(digest[:16], dtype="<u4"))
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=words))


def measure_all(suite: Sequence[Sensor], truth: Truth, seed: int) -> dict[float, pd.DataFrame]:
    """What all sensors measure of a run: by sample rate in Hz, "time [s]" and the channels in the order of the suite.

    Raises
    ------
    InputError : two sensors give the same channel, a body that the run has not, a rate that does not divide the run's.
    """
    check_distinct(suite)
    for sensor in suite:
        sensor.step(truth)
    columns: dict[float, dict[str, np.ndarray]] = {}
    for sensor in suite:
        stream = random_stream(sensor, seed)
        table = logged(sensor, sensor.measure(truth, stream), stream)
        of_rate = columns.setdefault(sensor.rate, {TIME: table[TIME].to_numpy()})
        of_rate.update({name: table[name].to_numpy() for name in sensor.channels()})
    return {rate: pd.DataFrame(of_rate) for rate, of_rate in sorted(columns.items())}


def logged(sensor: Sensor, table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """A sensor's table as its logger writes it: packets, the order of bytes, the unit; the stamps stay."""
    logger, errors = sensor.errors.logger, sensor.errors
    if logger == type(logger)():
        return table
    rows = logger.rows(len(table), rng.spawn(1)[0])
    columns = {TIME: table[TIME].to_numpy()}
    for name in sensor.channels():
        values = table[name].to_numpy()
        values = logger.write(values, errors.resolution, errors.range)
        columns[name] = values if rows is None else values[rows]
    return pd.DataFrame(columns)


def data_sheets(suite: Sequence[Sensor]) -> list[dict[str, Any]]:
    """What about.json says about the sensors."""
    return [sensor.data_sheet() for sensor in suite]
