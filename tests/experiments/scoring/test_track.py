"""Estimators of track geometry on short simulated runs, and their scores."""

from pathlib import Path

import numpy as np
import pytest

from estimators.interface import Estimate
from estimators.track.alignment_displacement import AlignmentDisplacement
from estimators.track.alignment_lateral import AlignmentLateral
from estimators.track.alignment_vertical import AlignmentVertical
from estimators.track.axlebox_profile import AxleboxProfile
from estimators.track.cross_level import CrossLevel
from experiments.scoring.score import score
from experiments.scoring.track import true_track
from railsim import InputError, Scenario, Truth, measure, simulate
from railsim.measurements import Measurements

ODOMETER = 0.01
SENSORS = [
    {"kind": "accelerometer", "name": "bogie", "body": "bogie", "rate": 256, "errors": "industrial"},
    {"kind": "gyro", "name": "bogie", "body": "bogie", "rate": 256, "errors": "industrial"},
    *(
        {
            "kind": "accelerometer",
            "name": f"axlebox1_{side}",
            "body": "wheelset1",
            "axes": ["z"],
            "position": [0, y, 0],
            "rate": 1024,
            "errors": "axlebox",
        }
        for side, y in (("left", 1.0), ("right", -1.0))
    ),
    *(
        {"kind": "displacement", "name": f"primary1_{side}", "rate": 256, "errors": "transducer"}
        for side in ("left", "right")
    ),
    {"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 64, "radius_error": ODOMETER},
]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Measurements, Truth]:
    """25 s at 25 m/s on straight_erri_low, compiled."""
    folder: Path = tmp_path_factory.mktemp("track")
    values = {"track": "straight_erri_low", "vehicle": "manchester", "speed": {"speed": 25.0}, "start": 60.0}
    scenario = Scenario.build(values | {"duration": 25.0, "sensors": SENSORS})
    truth = simulate(scenario, "compiled", folder / "truth")
    return measure(truth, scenario).measurements, truth


def test_compensated_pitch_rate_finds_both_bands(run: tuple[Measurements, Truth]):
    found = score(AlignmentVertical(compensate=True).estimate(run[0]), run[1])
    assert found["vertical D1 rms error [mm]"] < 0.1
    assert found["vertical D2 rms error [mm]"] < 0.2
    assert found["vertical D1 true rms [mm]"] > 0.7


def test_compensation_more_than_halves_the_lateral_error(run: tuple[Measurements, Truth]):
    plain, better = (score(AlignmentLateral(compensation=c).estimate(run[0]), run[1]) for c in (False, True))
    assert better["lateral D1 rms error [mm]"] < 0.5 * plain["lateral D1 rms error [mm]"]


def test_rails_come_apart(run: tuple[Measurements, Truth]):
    for estimator in (AlignmentDisplacement(), AxleboxProfile()):
        found = score(estimator.estimate(run[0]), run[1])
        for side in ("left", "right"):
            assert found[f"{side}_vertical D1 rms error [mm]"] < 0.3
            assert found[f"{side}_vertical D1 true rms [mm]"] > 0.7
            assert (f"{side}_vertical D2 rms error [mm]" in found) == isinstance(estimator, AlignmentDisplacement)
    long = score(AxleboxProfile(cut=70.0).estimate(run[0]), run[1])
    assert "vertical D2 rms error [mm]" in long  # a band beyond `cut` is not given, and not scored either


def test_cross_level_cant_and_twist_are_scored(run: tuple[Measurements, Truth]):
    estimate = CrossLevel(compensate=True).estimate(run[0])
    found = score(estimate, run[1])
    assert found["cross_level D1 rms error [mm]"] < found["cross_level D1 true rms [mm]"]
    assert found["twist rms error [mm/m]"] < 0.5
    assert found["cant rms error [mm]"] < 4.0  # biases are gone: 1e-3 V / g and 0.02 / g times 1.5 m were 5 mm
    assert found["cant within 2 std [-]"] > 0.85 or "cant_std [m]" not in estimate.series


def test_true_track_is_the_file_at_the_true_place(run: tuple[Measurements, Truth]):
    estimate = AlignmentVertical().estimate(run[0])
    series = estimate.series
    table = true_track(run[1], series["time [s]"].to_numpy(), 0.125)
    place = table["s [m]"].to_numpy()
    assert place[0] == pytest.approx(60.0, abs=1e-6)
    assert place[-1] - place[0] == pytest.approx(float(series["s [m]"].iloc[-1]) / (1 + ODOMETER), rel=2e-3)
    geometry = Scenario.build(
        {"track": "straight_erri_low", "vehicle": "manchester", "speed": {"speed": 1}, "duration": 1}
    )
    exact = geometry.geometry.at(place[20:-40])
    assert table["vertical [m]"].to_numpy()[20:-40] == pytest.approx(exact.vertical, abs=3e-5)
    assert table["cross_level [m]"].to_numpy()[20:-40] == pytest.approx(exact.cross_level, abs=6e-5)


def test_known_error_is_found_again(run: tuple[Measurements, Truth]):
    series = AlignmentVertical().estimate(run[0]).series
    true = true_track(run[1], series["time [s]"].to_numpy(), 0.125)
    s = series["s [m]"].to_numpy()
    wrong = true["vertical [m]"].to_numpy() + 1e-3 * np.sqrt(2) * np.sin(2 * np.pi * s / 9.0)
    table = series[["s [m]", "time [s]"]].assign(**{"vertical [m]": wrong, "vertical_d1_std [m]": 1e-3})
    found = score(Estimate("mine", table), run[1])
    assert found["vertical D1 rms error [mm]"] == pytest.approx(1.0, abs=0.01)
    assert found["vertical D2 rms error [mm]"] < 0.01
    assert found["vertical D1 within 2 std [-]"] == 1.0


def test_estimate_of_another_run_is_refused(run: tuple[Measurements, Truth]):
    series = AlignmentVertical().estimate(run[0]).series
    late = Estimate("mine", series.assign(**{"time [s]": series["time [s]"] + 100.0}))
    with pytest.raises(InputError, match="score it on the recording"):
        score(late, run[1])
