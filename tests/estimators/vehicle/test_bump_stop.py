"""Slope of the lateral bump stop on which the body leans, against the stop's law and a simulated curve."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from estimators.vehicle.bump_stop import FARTHEST, LEFT_OUT, SWAY, slope, steps
from railsim.vehicles.class175 import Class175

VEHICLE = Class175().nominal()


def test_balanced_curve_leaves_the_stop_alone():
    mean, spread = slope(VEHICLE, np.array([0.0, 0.1, -0.1]))
    assert mean == pytest.approx(np.zeros(3), abs=1.0)
    assert spread == pytest.approx(np.zeros(3), abs=1.0)
    assert steps(VEHICLE, np.zeros(2)).tolist() == [0, 0]


@pytest.mark.parametrize("unbalanced", [0.8, -1.1])
def test_slope_is_that_of_the_law_where_the_body_rests(unbalanced: float):
    """The mean of a parabola over the sway is its value at rest and the variance; the body's own lean adds a tenth."""
    p = VEHICLE
    height = p["body_height"] - p["secondary_height"]
    roll = 2.0 * p["secondary_vertical_stiffness"] * p["secondary_half_spacing"] ** 2 + p["roll_bar_stiffness"]
    leaning = 1.0 / (1.0 - p["body_mass"] * 9.81 * height / roll)
    force = p["body_mass"] * abs(unbalanced) * leaning

    def excess(x: float) -> float:
        into = max(x - p["bump_stop_gap"], 0.0)
        springs = 2.0 * p["secondary_lateral_stiffness"] * x
        return springs + p["bump_stop_stiffness"] * into + p["bump_stop_cubic"] * into**3 - force

    found: Any = brentq(excess, 0.0, FARTHEST)
    into = float(found) - p["bump_stop_gap"]
    assert into > 3.0 * SWAY  # all of the sway is on the stop
    mean, spread = slope(p, np.array([unbalanced]))
    assert mean[0] == pytest.approx(
        p["bump_stop_stiffness"] + 3.0 * p["bump_stop_cubic"] * (into**2 + SWAY**2), rel=0.01
    )
    assert spread[0] == pytest.approx(LEFT_OUT * 6.0 * p["bump_stop_cubic"] * into * SWAY, rel=0.05)


def test_vehicle_without_a_stop_has_none():
    without = {name: value for name, value in VEHICLE.items() if not name.startswith("bump_stop")}
    assert not slope(without, np.array([2.0]))[0].any()
