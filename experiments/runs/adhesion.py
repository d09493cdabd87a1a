"""Runs for the adhesion estimators: full sensors as in Fig. 6 of Ward et al. (2011) and roll gyros, or part of them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from railsim import measure, simulate
from railsim.contact.adhesion import CONDITIONS
from railsim.measurements import Measurements
from railsim.scenario import Scenario
from railsim.scratch import scratch_folder
from railsim.truth import Truth

AXLEBOX = {"preset": "axlebox", "bandwidth": 100.0}  # as the other sensors, for samples at 256 Hz
START = 25.0  # m
CLEAR = 20.0  # m, start of runs with vehicles off their nominal parameters: all wheels on even track


def sensors(grade: str = "mems", wheelsets: bool = True, apart: float | None = None) -> list[dict[str, Any]]:
    """Lateral accelerometers, yaw and roll gyros on wheelsets, bogie and body; tachometer, its wheel worn by 0.5 %.

    `apart` : of a whole vehicle, distance of the bogies from the body's centre, m; both bogies bear sensors then, and
    the body above each.
    """
    suite: list[dict[str, Any]] = []
    if apart is None:
        bodies = [(body, body, 0.0) for body in ("wheelset1", "wheelset2", "bogie", "body")]
    else:
        bodies = [(body, body, 0.0) for body in (*(f"wheelset{number}" for number in range(1, 5)), "bogie", "bogie2")]
        bodies += [("body", "body", apart), ("body_rear", "body", -apart)]
    for name, body, ahead in bodies:
        if not wheelsets and body.startswith("wheelset"):
            continue
        shared: dict[str, Any] = {"name": name, "body": body, "rate": 256}
        errors = AXLEBOX if body.startswith("wheelset") else grade
        place = {"position": [ahead, 0.0, 0.0]} if ahead else {}
        suite.append({"kind": "accelerometer", "axes": ["y"], "errors": errors, **shared, **place})
        suite.append(
            {"kind": "gyro", "axes": ["roll"] if body == "body" else ["roll", "yaw"], "errors": grade, **shared}
        )
    suite.append({"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 64, "radius_error": 0.005})
    return suite


def scenario(
    settings: Mapping[str, Any], speed: float, duration: float, suite: list[dict[str, Any]], rate: float = 512.0
) -> Scenario:
    """A run at constant speed (m/s) with these sensors; `settings`: vehicle, track and what else differs."""
    values: dict[str, Any] = {
        "speed": {"kind": "constant", "speed": speed},
        "start": START,
        "duration": duration,
        "output_rate": rate,
        "sensors": suite,
    }
    return Scenario.build({**values, **settings})


def run(
    simulated: Scenario, seed: int, engine: str = "compiled", stated: Scenario | None = None
) -> tuple[Truth, Measurements]:
    """Truth and what is measured of it; `stated`: the scenario that the recording knows, where it is another."""
    truth = simulate(simulated, engine=engine)
    return truth, measure(truth, stated or simulated, seed).measurements


def recording(
    settings: Mapping[str, Any],
    speed: float,
    duration: float,
    suite: list[dict[str, Any]],
    seed: int,
    unknown: Mapping[str, Any] = MappingProxyType({}),
    effects: Sequence[Mapping[str, Any]] = (),
) -> Measurements:
    """What is measured of a run by the compiled engine, of which nothing else is kept.

    `unknown`: settings of the vehicle in truth that the recording does not know, instead of its nominal ones; as
    little as it knows the `effects`.
    """
    stated = scenario(settings, speed, duration, suite)
    real = {**settings, "vehicle": {**settings["vehicle"], **unknown}} | ({"effects": list(effects)} if effects else {})
    true_scenario = scenario(real, speed, duration, suite)
    with scratch_folder() as folder:
        truth = simulate(true_scenario, "compiled", Path(folder) / "truth")
        return measure(truth, stated, seed).measurements


def between(first: str, second: str) -> dict[str, float]:
    """Adhesion settings half way between two presets: geometric means of friction and of the reduction factors."""
    lower, upper = CONDITIONS[first].parameters(), CONDITIONS[second].parameters()
    return {name: float(np.sqrt(lower[name] * upper[name])) for name in lower}


def spliced(before: Measurements, after: Measurements, time: float) -> Measurements:
    """One recording from two runs over the same track at the same speed: the second one from `time` [s] on.

    A change of adhesion with its creep slopes, which a track's friction column cannot make. The vehicle's place jumps
    by what the runs differ, a millimetre or so, and its accelerations and rates with it.
    """
    tables: dict[float, dict[str, np.ndarray]] = {}
    for name in before.channels:
        times = before.time(name)
        table = tables.setdefault(before.rate(name), {"time [s]": times})
        table[name] = np.where(times < time, before[name], after[name])
    return Measurements(before.about, tables)
