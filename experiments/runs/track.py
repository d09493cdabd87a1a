"""Runs and errors that figures of section 3 share: bogie and axlebox sensors over one track at several speeds."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd

from estimators.interface import Estimator
from estimators.signals.bands import bands_of, response
from experiments.scoring.score import score
from railsim import measure, simulate
from railsim.measurements import Measurements
from railsim.scenario import Scenario
from railsim.truth import Truth

TRACK = "straight_erri_low"
LONGEST = 240.0  # s of a run
RADIUS_ERROR = 0.005
SHARE = np.hypot(0.875, 0.125)  # noise of a rail's height over that of one axlebox: 0.75 m against 1 m from the middle
POSITIONS = (-1.28, -0.64, 0.0, 0.64, 1.28)  # m before the bogie's centre; the outer ones are above the wheelsets


def sensors(grade: str) -> list[dict[str, Any]]:
    """Accelerometers and gyros along the bogie; at the leading wheelset displacement and axleboxes; tachometer."""
    shared = {"body": "bogie", "rate": 256, "errors": grade}
    axlebox = {"kind": "accelerometer", "body": "wheelset1", "axes": ["z"], "rate": 1024, "errors": "axlebox"}
    return [
        {"kind": "accelerometer", "name": "bogie", **shared},
        *(
            {"kind": "accelerometer", "name": sensor_name(x), "axes": ["z"], "position": [x, 0.0, 0.0], **shared}
            for x in POSITIONS
        ),
        {"kind": "gyro", "name": "bogie", **shared},
        *(
            {"kind": "gyro", "name": sensor_name(x), "axes": ["pitch"], "position": [x, 0.0, 0.0], **shared}
            for x in POSITIONS
        ),
        {**axlebox, "name": "axlebox1_left", "position": [0.0, 1.0, 0.0]},
        {**axlebox, "name": "axlebox1_right", "position": [0.0, -1.0, 0.0]},
        {"kind": "displacement", "name": "primary1_left", "rate": 256, "errors": "transducer"},
        {"kind": "displacement", "name": "primary1_right", "rate": 256, "errors": "transducer"},
        {"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 64, "radius_error": RADIUS_ERROR},
    ]


def sensor_name(x: float) -> str:
    """Name of the bogie's sensors at x m before its centre."""
    return f"bogie_{'m' if x < 0 else 'p'}{round(100 * abs(x)):03d}"


def gyro_at(x: float, recording: Measurements) -> Measurements:
    """The recording with the gyro at that position in the role of the bogie's."""
    wanted, given = "bogie.rate_pitch [rad/s]", f"{sensor_name(x)}.rate_pitch [rad/s]"
    tables: dict[float, dict[str, np.ndarray]] = {}
    for name in (wanted, "wheelset1.speed [m/s]"):
        source = given if name == wanted else name
        table = tables.setdefault(recording.rate(source), {"time [s]": recording.time(source)})
        table[name] = recording[source]
    about = dict(recording.about)
    about["sensors"] = [
        dict(sheet) | {"channels": [wanted]} for sheet in about["sensors"] if given in sheet["channels"]
    ]
    return Measurements(about, tables)


def run(
    speed: float, fast: bool, length: float, grades: Iterable[str], specimens: int = 3
) -> tuple[Truth, dict[str, list[Measurements]]]:
    """One run and what sensors of each grade give of it, some specimens each (random seeds)."""
    values = {
        "track": TRACK,
        "vehicle": "manchester",
        "speed": {"kind": "constant", "speed": speed},
        "start": 24.0,
        "duration": round(min(LONGEST, length / speed), 1),
    }
    measured: dict[str, list[Measurements]] = {}
    truth = simulate(Scenario.build(values), engine="compiled" if fast else "exudyn")
    for grade in grades:
        suite = Scenario.build({**values, "sensors": sensors(grade)})
        measured[grade] = [measure(truth, suite, seed).measurements for seed in range(1, 1 + specimens)]
    return truth, measured


def errors(estimator: Estimator, recordings: list[Measurements], truth: Truth, label: str) -> pd.DataFrame:
    """Errors of every band that is scored: rms over the recordings.

    Returns
    -------
    Columns "estimator" (the label), "quantity", "band", "error [mm]", "true [mm]".
    """
    scores = [score(estimator.estimate(one), truth) for one in recordings]
    rows = []
    for key in scores[0]:
        if key.endswith(" rms error [mm]") and f"{key.removesuffix(' rms error [mm]')} true rms [mm]" in scores[0]:
            name = key.removesuffix(" rms error [mm]")
            quantity, band = name.split(" ")
            error = float(np.sqrt(np.mean([one[key] ** 2 for one in scores])))
            rows.append((label, quantity, band, error, scores[0][f"{name} true rms [mm]"]))
    return pd.DataFrame(rows, columns=["estimator", "quantity", "band", "error [mm]", "true [mm]"])


def noise_limit(density: float, speed: float, quantity: str, band: str, derivatives: int) -> float:
    """Error that white sensor noise alone leaves in a band, m rms: the least that the sensor allows.

    S(n) = density^2 V / (V^derivatives (2 pi n)^2)^2 for n in cycles/m, times the band's response squared, integrated.

    Parameters
    ----------
    density : one-sided, m/s2/sqrt(Hz) for an accelerometer, rad/s/sqrt(Hz) for a gyro.
    derivatives : of the height, by distance, that the sensor measures: 2 for an accelerometer, 1 for a gyro.
    """
    n = np.geomspace(1e-4, 4.0, 20000)
    gain = response(2.0 * np.pi * n, bands_of(quantity)[band.lower()])
    power = density**2 * speed / (speed**derivatives * (2.0 * np.pi * n) ** 2) ** 2 * gain**2
    return float(np.sqrt(np.trapezoid(power, n)))
