"""Short runs of a scenario with and without effects, in memory."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from railsim import load_scenario
from railsim.scenario import Scenario
from railsim.simulation import build_run
from tests.engines.rig import Rows, go

BASE = "straight_erri_high"
SENSORS = [
    {"kind": "accelerometer", "name": "bogie", "body": "bogie", "axes": ["x", "y", "z"], "rate": 256},
    {"kind": "gyro", "name": "bogie", "body": "bogie", "rate": 256},
    {"kind": "displacement", "name": "primary1_left", "rate": 256},
    {"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 64},
]


def scenario(effects: Sequence[Any], **changes: Any) -> Scenario:
    """Class 175 on rough straight track at 25 m/s for 2 s, ideal sensors."""
    given = {"vehicle": "class175", "speed.speed": 25.0, "duration": 2.0, "sensors": SENSORS, "effects": list(effects)}
    return load_scenario(BASE, {**given, **changes})


def rows(effects: Sequence[Any], engine: str = "compiled", **changes: Any) -> Rows:
    """Truth of such a run."""
    return go(engine, build_run(scenario(effects, **changes)))


def largest_difference(a: Rows, b: Rows) -> float:
    """Largest difference of any channel that both have, over the channel's largest value."""
    shared = [name for name in b.names if name in a.names]
    return max(float(np.abs(a[n] - b[n]).max() / max(float(np.abs(b[n]).max()), 1e-12)) for n in shared)
