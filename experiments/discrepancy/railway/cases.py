"""Recordings of half vehicles on straight track whose truth the inference is not told; and its verdicts on them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from experiments.discrepancy.railway.build import named, vehicle_at
from experiments.discrepancy.railway.tolerances import tolerances
from railsim.effects.payload import Payload
from railsim.measurements import Measurements
from railsim.scenario import Scenario, load_scenario
from railsim.simulation import REFERENCE, about_recording, measure, simulate_held

BASE = "straight_erri_low"
SURVEY = 1e-4  # m; errors of the track file as stated
DURATION = 12.0  # s
VERTICAL: tuple[dict[str, Any], ...] = (
    {"kind": "accelerometer", "name": "bogie", "body": "bogie", "axes": ["z"], "rate": 256, "errors": "industrial"},
    {"kind": "accelerometer", "name": "body", "body": "body", "axes": ["z"], "rate": 256, "errors": "industrial"},
    *({"kind": "accelerometer", "name": f"axlebox{k}_left", "body": f"wheelset{k}", "position": [0, 1.0, 0],
       "axes": ["z"], "rate": 1024, "errors": "axlebox"} for k in (1, 2)),
    {"kind": "displacement", "name": "primary1_left", "rate": 256, "errors": "transducer"},
)  # fmt: skip
ALL: tuple[dict[str, Any], ...] = (
    *({**one, "axes": ["y", "z"]} if "axes" in one else one for one in VERTICAL),
    {"kind": "gyro", "name": "bogie", "body": "bogie", "axes": ["roll", "pitch", "yaw"], "rate": 256,
     "errors": "industrial"},
)  # fmt: skip
SETTINGS = ("home", "laden", "survey quiet", "survey loud", "other engine", "noise twice", "other law", "whole")


def nominal(setting: str = "home", sensors: Sequence[dict[str, Any]] = VERTICAL) -> Scenario:
    """What the inference is told: a half vehicle, or where the setting says so a whole one."""
    errors = {f"{kind}_std": SURVEY for kind in ("vertical", "cross_level", "lateral", "gauge")}
    vehicle = "class175_whole" if setting == "whole" else "class175"
    settings = {"vehicle": vehicle, "duration": DURATION, "track_errors": errors, "sensors": list(sensors)}
    return load_scenario(BASE, settings)


def recorded(
    rng: np.random.Generator,
    setting: str,
    effects: Sequence[dict[str, Any]],
    sensors: Sequence[dict[str, Any]] = VERTICAL,
) -> Measurements:
    """A recording of a vehicle within its data sheet's tolerances, laden or not, with these effects."""
    told = nominal(setting, sensors)
    builds = {named(one): one.spread * rng.standard_normal() for one in tolerances(told.vehicle) if one.built}
    load = Payload.build({"mass": float(rng.uniform(1000.0, 2500.0) if setting == "laden" else 0.0)}).settings()
    times = {"survey quiet": 0.4, "survey loud": 2.5}.get(setting, 1.0)
    louder = 2.0 if setting == "noise twice" else 1.0
    true = told.but(
        track_errors=told.track_errors.but(
            **{name: times * value for name, value in told.track_errors.model_dump().items()}
        ),
        sensors=tuple(
            one.but(errors=one.errors.but(noise_density=louder * one.errors.noise_density)) for one in told.sensors
        ),
    )
    vehicle = vehicle_at(told.vehicle, builds)
    if setting == "other law":
        vehicle = vehicle.but(adhesion=vehicle.adhesion.but(law="fastsim"))
    true = true.but(vehicle=vehicle)
    values = true.values() | {
        "effects": [load, *effects], "start": told.start + 0.2 * float(rng.standard_normal()),
        "speed": {"kind": "constant", "speed": 20.0 * (1.0 + 1e-3 * float(rng.standard_normal()))},
        "seed": int(rng.integers(1, 2**31)),
    }  # fmt: skip
    return as_measured(Scenario.build(values), told, "exudyn" if setting == "other engine" else "compiled")


def as_measured(true: Scenario, told: Scenario, engine: str = REFERENCE, *, stated: bool = True) -> Measurements:
    """What sensors record of a run, with the data sheets that are told; `stated`: and the errors of the track file."""
    found = measure(simulate_held(true, engine), true).measurements
    about = about_recording(told)
    if not stated:
        about.pop("track", None)
    tables: dict[float, dict[str, np.ndarray]] = {}
    for name in found.channels:
        rate = found.rate(name)
        tables.setdefault(rate, {"time [s]": found.time(name)})[name] = found[name]
    return Measurements(about, tables, found.track)
