"""Runs that the figures of section 5 share: bogie sensors at 1 ms on a Class 175-like half vehicle, true and
estimated speed.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from estimators.interface import Estimator
from estimators.speed.speed_plain import SpeedPlain
from estimators.speed.speed_refined import SpeedRefined
from experiments.reporting.units import KMH
from experiments.scoring.speed import speed_errors
from railsim import measure, simulate
from railsim.scenario import Scenario
from railsim.truth import SPEED

SAMPLING = 1000.0  # Hz; "a sampling interval of 1 ms is used" (Ward et al. 2011, section 5.2)
WHEELBASE = 2.6  # m, the same place; twice the semi wheelbase of class175
GRADES: dict[str, Any] = {"": {}, " industrial": "industrial", " consumer": "mems"}
"""Column suffixes and error presets of the bogie's sensors: ideal; industrial MEMS (23 ug/sqrt(Hz), 0.0025
degrees/s/sqrt(Hz));
consumer MEMS (75 ug/sqrt(Hz), 0.005 degrees/s/sqrt(Hz)); both with drift, scale errors and 100 Hz bandwidth."""


def speed_table(
    case: str,
    values: dict[str, Any],
    fast: bool,
    window: float = 4.0,
    slowest: float = 3.0,
    tachometer: bool = False,
    forward: bool = False,
) -> pd.DataFrame:
    """One run with bogie sensors of all grades: true, plain and refined speed [km/h] over time.

    Parameters
    ----------
    case : goes into the column "case".
    values : scenario keys besides vehicle, sensors and rates.
    fast : the compiled engine instead of Exudyn.
    window, slowest : of the plain variant [s], [m/s].
    tachometer : adds the wheelset's tachometer.
    forward : adds "refined forward [km/h]": industrial sensors with a longitudinal accelerometer.

    Returns
    -------
    Columns "case", "time [s]", "s [m]", then speeds "true [km/h]", "plain [km/h]" and "refined [km/h]" (ideal sensors),
    and the same with the suffixes of `GRADES`; NaN where not valid.
    """
    base = {"vehicle": "class175", "output_rate": SAMPLING, "start": 25.0, "seed": 18, **values}
    scenario = Scenario.build({**base, "sensors": _sensors({}, tachometer)})
    truth = simulate(scenario, engine="compiled" if fast else "exudyn")
    true = KMH * truth[SPEED]
    table = pd.DataFrame({"case": case, "time [s]": truth.time, "s [m]": truth["s [m]"], "true [km/h]": true})
    estimators: dict[str, Estimator] = {"plain": SpeedPlain(window=window, slowest=slowest), "refined": SpeedRefined()}
    for suffix, errors in GRADES.items():
        suite = Scenario.build({**base, "sensors": _sensors(errors, tachometer)})
        measured = measure(truth, suite).measurements
        for name, estimator in estimators.items():
            time, error = speed_errors(estimator.estimate(measured), truth)
            table[f"{name}{suffix} [km/h]"] = true + KMH * np.interp(truth.time, time, error)
        if tachometer:
            wheel = "wheelset1.speed [m/s]"
            table["tachometer [km/h]"] = KMH * np.interp(truth.time, measured.time(wheel), measured[wheel])
    if forward:
        suite = Scenario.build({**base, "sensors": _sensors("industrial", False, ["x", "z"])})
        time, error = speed_errors(SpeedRefined().estimate(measure(truth, suite).measurements), truth)
        table["refined forward [km/h]"] = true + KMH * np.interp(truth.time, time, error)
    return table


def rows_where(table: pd.DataFrame, mask: Any) -> pd.DataFrame:
    """The rows of a table for which `mask` holds."""
    return table.loc[np.asarray(mask)]


def error(table: pd.DataFrame, column: str) -> np.ndarray:
    """Error of a column in km/h, NaN where not valid."""
    return (table[f"{column} [km/h]"] - table["true [km/h]"]).to_numpy()


def truncation(speed: float) -> tuple[float, float]:
    """Lowest and highest error [km/h] that a delay of a whole number of samples leaves at a speed [km/h]: eq. (9)."""
    delay = WHEELBASE / (speed / KMH)
    samples = np.array([np.floor(delay * SAMPLING), np.ceil(delay * SAMPLING)])
    errors = KMH * WHEELBASE * SAMPLING / samples - speed
    return float(errors.min()), float(errors.max())


def _sensors(errors: Any, tachometer: bool, axes: Sequence[str] = ("z",)) -> list[dict[str, Any]]:
    common = {"name": "bogie", "body": "bogie", "rate": SAMPLING, "errors": errors}
    sensors = [{"kind": "accelerometer", "axes": list(axes), **common}, {"kind": "gyro", "axes": ["pitch"], **common}]
    if tachometer:
        sensors.append({"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 50.0})
    return sensors
