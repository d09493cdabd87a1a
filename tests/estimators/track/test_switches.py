"""Switches and crossings: the shipped crossover from noisy sensors, and what is not one."""

import numpy as np
import pytest

from estimators.interface import Estimate
from estimators.track.switches import Switches, find_crossovers, levelled
from experiments.scoring.switches import SwitchScorer
from railsim import load_scenario, measure, simulate
from railsim.track.switches import Crossover
from railsim.truth import Truth

SPACING = 0.125
SHAPE = Crossover()


@pytest.fixture(scope="module")
def run() -> tuple[Estimate, Truth]:
    scenario = load_scenario("crossover", {"duration": 40})
    truth = simulate(scenario, engine="compiled")
    return Switches().estimate(measure(truth, scenario, seed=4).measurements), truth


def test_every_part_is_found_where_it_is(run) -> None:
    estimate, truth = run
    assert "".join(event["label"] for event in estimate.about["events"]) == "ABCDEF"
    scores = SwitchScorer().score(estimate, truth)
    assert scores["features found [-]"] == 1
    assert scores["largest error of place [m]"] < 0.1
    assert scores["largest error of distance from middle [m]"] < 0.5


def test_crossing_angle_is_one_in_thirteen(run) -> None:
    entry = run[0].about["crossovers"][0]
    assert entry["crossing_angle [rad]"] == pytest.approx(1 / 13, rel=0.02)
    assert entry["largest_yaw [rad]"] == pytest.approx(0.077, rel=0.02)


def test_wheelbase_gives_the_odometers_error(run) -> None:
    entry = run[0].about["crossovers"][0]
    assert entry["odometer_scale [-]"] == pytest.approx(0.01, abs=3 * entry["odometer_scale_std [-]"])
    assert entry["odometer_scale_std [-]"] < 0.005


@pytest.mark.parametrize("drift", [0.0, 2e-4])
def test_turn_is_found_whatever_the_gyro_drifts(drift: float) -> None:
    s = np.arange(0.0, 400.0, SPACING)
    heading = np.cumsum(SHAPE.curvature(s - 100.0)) * SPACING + drift * s
    found = find_crossovers(heading, np.ones(s.size, dtype=bool), SPACING, 0.03)
    assert [turn.middle * SPACING for turn in found] == [pytest.approx(SHAPE.middle + 100.0, abs=1.0)]
    level = levelled(heading, found[0], SPACING)
    assert level[found[0].middle] == pytest.approx(1 / 13, rel=0.01)
    assert np.abs(level[[0, -1]]).max() < 1e-3


def test_a_plain_curve_is_no_crossover() -> None:
    s = np.arange(0.0, 600.0, SPACING)
    heading = np.cumsum(np.clip((s - 100) / 60, 0, 1) / 400 * (s < 500)) * SPACING
    assert find_crossovers(heading, np.ones(s.size, dtype=bool), SPACING, 0.03) == []
