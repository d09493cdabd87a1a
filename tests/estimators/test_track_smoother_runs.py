"""Fused track geometry on runs of the simulator: traction that pitches the bogie, and sensors without any error."""

import pytest

from estimators.track_smoother import TrackSmoother
from experiments.score import score
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
