"""Truth whose channels are closed forms of time."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from railsim.constants import GRAVITY
from railsim.truth import Truth, TruthWriter

RADIUS = 0.45
BODIES = ("body", "bogie", "wheelset1")


def times(duration: float, rate: float = 1024.0) -> np.ndarray:
    return np.arange(round(duration * rate) + 1) / rate


def write_truth(
    folder: Path, channels: Mapping[str, np.ndarray] | None = None, duration: float = 2.0, rate: float = 1024.0
) -> Truth:
    """A run at 20 m/s on straight level track, at rest but for the `channels` given."""
    time = times(duration, rate)
    nothing = np.zeros_like(time)
    columns = {"time [s]": time, "speed [m/s]": nothing + 20, "position.east [m]": 20 * time}
    columns |= {"position.north [m]": nothing, "position.up [m]": nothing}
    columns |= {"primary1_left.displacement [m]": 1e-3 * np.sin(6 * time)}
    for number, body in enumerate(BODIES):
        columns[f"{body}.y [m]"] = 1e-3 * np.sin((number + 3) * time)
        for axis in "xyz":
            columns[f"{body}.specific_force_{axis} [m/s2]"] = nothing + GRAVITY * (axis == "z")
            columns[f"{body}.angular_velocity_{axis} [rad/s]"] = nothing
            columns[f"{body}.angular_acceleration_{axis} [rad/s2]"] = nothing
    columns |= {"wheelset1.spin [rad/s]": nothing + 20 / RADIUS, "wheelset1.spin_angle [rad]": 20 / RADIUS * time}
    columns |= channels or {}
    about = {"vehicle": {"name": "test", "wheel_radius [m]": RADIUS}}
    with TruthWriter(folder, list(columns), rate, about) as writer:
        writer.append(np.column_stack(list(columns.values())))
    return Truth.open(folder)
