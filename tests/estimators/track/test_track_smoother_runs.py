"""Fused track geometry on runs of the simulator: traction that pitches the bogie, and sensors without any error."""

import numpy as np
import pytest

from estimators.track.track_smoother import TrackSmoother
from experiments.runs.track_accuracy import scenario as curved
from experiments.scoring.score import score
from experiments.scoring.track import band_errors
from railsim import load_scenario, measure, simulate
from railsim.scenario import Scenario


def scores(scenario: Scenario) -> dict[str, float]:
    truth = simulate(scenario, engine="compiled")
    return score(TrackSmoother().estimate(measure(truth, scenario).measurements), truth)


@pytest.mark.parametrize("ideal", [False, True], ids=["industrial", "ideal"])
def test_acceleration_that_pitches_the_bogie_is_not_taken_for_track(ideal: bool) -> None:
    """0.6 m/s2 moves the bogie by some 0.3 mm over the leading wheelset; read as track that is 2 mm of D3."""
    sensors = [
        sensor.settings() | ({"errors": {}} if ideal else {})
        for sensor in load_scenario("default").sensors
        if sensor.name in ("bogie", "primary1_left", "primary1_right", "wheelset1")
    ]
    if ideal:
        sensors[-1].pop("errors")
    found = scores(load_scenario("default", {"sensors": sensors, "duration": 30.0}))
    assert found["vertical D2 rms error [mm]"] < 0.1
    assert found["vertical D3 rms error [mm]"] < 0.25
    assert found["vertical D2 within 2 std [-]"] > 0.9


def test_body_that_leans_on_its_bump_stop_is_not_taken_for_cross_level() -> None:
    """8 m/s with cant for 20 m/s: with the springs alone the cross level erred by 1.7 mm in D1."""
    run = curved("class175", 8.0, "mems", track="curve_r400", start=150.0, duration=40.0)
    truth = simulate(run, engine="compiled")
    rows = band_errors(TrackSmoother().estimate(measure(truth, run).measurements), truth, "cross_level", "d1")
    error = (rows["estimated [m]"] - rows["true [m]"]).to_numpy()
    assert np.sqrt(np.mean(error**2)) < 0.6e-3
    assert np.mean(np.abs(error) <= 2.0 * rows["std [m]"]) > 0.65
