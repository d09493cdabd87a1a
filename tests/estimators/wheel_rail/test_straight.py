"""Curves are found by the yaw gyro, told, and what was estimated in them is not valid."""

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from estimators.wheel_rail.straight import curves, told_of_curves
from estimators.wheel_rail.wheelset_motion import YAW
from railsim.measurements import Measurements

RATE, SPEED = 100.0, 25.0
TIME = np.arange(0.0, 60.0, 1.0 / RATE)


def _measured(curvature: np.ndarray, bias: float = 0.0, stated: float = 1e-3) -> Measurements:
    noise = 2e-3 * np.random.default_rng(3).normal(size=len(TIME))
    irregular = 0.01 * np.sin(2.0 * np.pi * SPEED * TIME / 20.0)
    table = {"time [s]": TIME, YAW: SPEED * curvature + irregular + noise + bias}
    table["wheelset1.speed [m/s]"] = np.full(len(TIME), SPEED)
    sheet = {"name": "gyro", "channels": [YAW], "errors": {"bias_std": stated}}
    return Measurements({"origin": "test", "vehicle": {"wheel_radius": 0.45}, "sensors": [sheet]}, {RATE: table})


def _estimate() -> Estimate:
    times = np.arange(0.0, 60.0, 1.0)
    return Estimate("one", pd.DataFrame({"time [s]": times, "conicity [-]": np.full(60, 0.15)}), {"settings": {}})


def test_a_curve_is_named_and_what_lies_in_it_is_not_valid():
    measured = _measured(np.where((TIME > 20.0) & (TIME < 40.0), 1.0 / 800.0, 0.0))
    told = told_of_curves(_estimate(), measured)
    valid, times = told.series["valid [-]"].to_numpy() > 0.5, told.series["time [s]"].to_numpy()
    assert not valid[(times >= 20.0) & (times <= 40.0)].any()
    assert valid[(times < 16.0) | (times > 44.0)].all()  # 60 m on either side, and half of the average
    (text,) = told.about["warnings"]
    assert "between 1" in text and "straight" in text


def test_straight_track_and_a_usual_bias_are_no_curve():
    measured = _measured(np.zeros(len(TIME)), bias=1e-3)
    assert not curves(measured)[1].any()
    assert "warnings" not in told_of_curves(_estimate(), measured).about


def test_a_bias_beyond_the_data_sheet_is_told_as_that_or_a_curve():
    told = told_of_curves(_estimate(), _measured(np.zeros(len(TIME)), bias=0.0175))
    assert "bias is beyond its data sheet" in told.about["warnings"][0]
