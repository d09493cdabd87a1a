"""Sensors that stand askew: their three channels are turned to the axes of the body."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from railsim.errors import InputError
from railsim.field.tables import Notes

_CHANNELS = {
    "accelerometer": ("acceleration_x [m/s2]", "acceleration_y [m/s2]", "acceleration_z [m/s2]"),
    "gyro": ("rate_roll [rad/s]", "rate_pitch [rad/s]", "rate_yaw [rad/s]"),
}


def turned(
    sensors: Sequence[Mapping[str, Any]], frames: dict[float, pd.DataFrame], notes: Notes
) -> list[dict[str, Any]]:
    """Turn the channels of every sensor with `rotation` in place; returns the sensors without that key.

    `rotation` is roll, pitch and yaw of the sensor's axes on its body, deg, one after the other about the body's x, y
    and z: a value in the body's axes is that rotation times the value in the sensor's.

    Raises
    ------
    InputError : no three angles, or not all three channels are there at one rate.
    """
    plain = []
    for number, given in enumerate(sensors):
        sensor = dict(given)
        rotation = sensor.pop("rotation", None)
        plain.append(sensor)
        if rotation is not None:
            _turn(sensor, _angles(rotation, f"sensors.{number}.rotation"), frames, f"sensors.{number}.rotation", notes)
    return plain


def _angles(given: Any, where: str) -> list[float]:
    if (
        not isinstance(given, list | tuple)
        or len(given) != 3
        or not all(isinstance(one, int | float) and not isinstance(one, bool) and np.isfinite(one) for one in given)
    ):
        raise InputError(f"{where}: give roll, pitch and yaw in deg, as [0, -11, 0]")
    return [float(one) for one in given]


def _turn(
    sensor: Mapping[str, Any], angles: list[float], frames: dict[float, pd.DataFrame], where: str, notes: Notes
) -> None:
    quantities = _CHANNELS.get(str(sensor.get("kind")))
    if quantities is None:
        raise InputError(f"{where}: only {' and '.join(_CHANNELS)} can be turned; leave it out")
    names = [f"{sensor.get('name')}.{quantity}" for quantity in quantities]
    frame = next((one for one in frames.values() if set(names) <= set(one.columns)), None)
    if frame is None:
        raise InputError(f"{where}: needs {', '.join(names)} in one table; map all three")
    frame[names] = Rotation.from_euler("xyz", angles, degrees=True).apply(np.array(frame[names], dtype=np.float64))
    notes.repair(f"{names[0].split('.')[0]}: {sensor['kind']} turned by rotation {angles} deg to its body's axes")
