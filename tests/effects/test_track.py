"""Effects on track and sensors against closed forms."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

from railsim import load_scenario
from railsim.constants import GRAVITY
from railsim.effects.track_changes import resampled
from railsim.scenario import Scenario
from railsim.simulation import measure, simulate
from railsim.track import Track, read_track
from railsim.track.files import write_track
from railsim.truth import Truth
from tests.effects.rig import rows, scenario
from tests.engines.rig import flat, ratio


def test_wheel_sinks_into_a_void_by_the_stated_deflection():
    void = {"kind": "hanging_sleepers", "deflection": 1e-3, "place": 40.0, "length": 12.0}
    slow: dict[str, Any] = {"track": "smooth", "speed.speed": 5.0, "duration": 4.0}
    result = rows([void], **slow)
    at = result["s [m]"] + 1.3
    level = result["wheelset1.z [m]"]
    lowest = np.interp(40.0, at, level)
    assert lowest - level[0] == pytest.approx(-1e-3, rel=0.05)
    assert at[level.argmin()] == pytest.approx(40.0, abs=0.5)


@pytest.mark.parametrize("engine", ["compiled", "exudyn"])
def test_stiffness_column_of_a_track_file_is_honoured(engine: str, tmp_path: Any):
    """From 100 to 50 MN/m under 60 kN: deeper by N (1/50 - 1/100)."""
    s = np.arange(-40.0, 100.0, 0.5)
    soft = np.where(s > 35.0, 50e6, 100e6)
    write_track(Track(s, {"stiffness": soft}, "step"), tmp_path / "step.csv")
    place: dict[str, Any] = {"track": str(tmp_path / "step.csv"), "speed.speed": 8.0, "duration": 3.0}
    result = rows([], engine=engine, **place)
    depth = result["wheelset1.z [m]"][-1] - result["wheelset1.z [m]"][0]
    load = result["wheel1_left.normal_force [N]"][0]
    assert depth == pytest.approx(-load / 100e6, rel=0.03)


def test_engines_agree_on_soft_and_rough_track():
    soft = [{"kind": "soft_track", "softness": 2e-8}]
    fast, reference = (rows(soft, engine) for engine in ("compiled", "exudyn"))
    assert ratio(reference["wheel1_left.normal_force [N]"], fast["wheel1_left.normal_force [N]"]) < 2e-2


def test_cant_error_is_felt_as_gravity():
    result = rows([{"kind": "cant_error", "error": 0.015}], track="smooth", duration=0.5)
    tilt = -np.arcsin(0.015 / 1.5) + result["bogie.roll [rad]"][0]
    assert result["bogie.specific_force_y [m/s2]"][0] == pytest.approx(GRAVITY * np.sin(tilt), rel=1e-3)


def test_measured_track_does_not_hold_the_effect():
    one = scenario([{"kind": "rail_joints"}])
    assert one.geometry.digest() == scenario([]).geometry.digest() != one.setup.track.digest()


def test_recording_of_a_changed_track_runs_again_from_its_own_truth(tmp_path: Any):
    one = scenario([{"kind": "rail_joints", "depth": 2e-3}], duration=0.5)
    measure(simulate(one, "compiled", tmp_path / "t"), one, folder=tmp_path / "r")
    again = load_scenario(tmp_path / "r" / "truth" / "scenario.yaml")
    true, kept = read_track(tmp_path / "r" / "truth" / "track.csv"), again.setup.track
    assert np.abs(kept.vertical - true.vertical).max() < 1e-8
    assert np.abs(again.geometry.at(kept.s).vertical - kept.at(kept.s).vertical).max() > 1e-3
    known = pd.read_csv(tmp_path / "r" / "track.csv", comment="#")
    assert np.abs(known["vertical [m]"] - again.geometry.at(known["s [m]"]).vertical).max() < 1e-3


def test_resampling_keeps_the_shape():
    track = read_track("straight_erri_high")
    fine = resampled(track, 0.05)
    at = np.linspace(10.0, 60.0, 777)
    assert np.diff(fine.s).max() <= 0.05 + 1e-9
    assert np.abs(fine.at(at).left_vertical - track.at(at).left_vertical).max() < 1e-7
    assert resampled(flat(), 1e9).s.size == flat().s.size


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> Truth:
    return simulate(scenario([]), "compiled", tmp_path_factory.mktemp("run") / "truth")


def measured(
    truth: Truth, kind: str, channel: str = "bogie.acceleration_y", **settings: Any
) -> tuple[np.ndarray, np.ndarray]:
    """The channel with and without the fault."""
    faulty: Scenario = scenario([{"kind": kind, **settings}])
    both = [measure(truth, one).measurements for one in (faulty, scenario([]))]
    name = next(c for c in both[0].channels if c.startswith(channel))
    return both[0][name], both[1][name]


def test_bias_drift_and_gain(truth: Truth):
    with_it, without = measured(truth, "sensor_bias", bias=0.3)
    assert with_it - without == pytest.approx(0.3)
    with_it, without = measured(truth, "sensor_drift", rate=0.01)
    assert with_it - without == pytest.approx(0.01 * np.arange(len(without)) / 256.0)
    with_it, without = measured(truth, "sensor_gain", factor=1.1)
    assert with_it == pytest.approx(1.1 * without)


def test_delay_is_a_shift_in_time(truth: Truth):
    with_it, without = measured(truth, "sensor_delay", delay=4 / 256.0)
    assert with_it[4:] == pytest.approx(without[:-4])


def test_misaligned_accelerometer_feels_gravity(truth: Truth):
    with_it, without = measured(truth, "sensor_misalignment", angle=0.02)
    assert abs(np.mean(with_it - without)) == pytest.approx(0.02 * GRAVITY, rel=0.05)


def test_cross_talk_is_a_share_of_the_next_axis(truth: Truth):
    with_it, without = measured(truth, "sensor_cross_talk", share=0.05)
    up = measure(truth, scenario([])).measurements["bogie.acceleration_z [m/s2]"]
    assert with_it - without == pytest.approx(0.05 * up)


def test_odometer_scale(truth: Truth):
    with_it, without = measured(truth, "odometer_scale", factor=1.02, channel="wheelset1.speed")
    assert with_it == pytest.approx(1.02 * without)


def test_other_channels_and_their_random_numbers_stay(truth: Truth):
    noisy = [{"kind": "gyro", "name": "bogie", "body": "bogie", "rate": 256, "errors": "mems"}]
    fault = [{"kind": "sensor_bias", "bias": 0.5, "channel": "bogie.rate_pitch"}]
    both = [measure(truth, scenario(effects, sensors=noisy)).measurements for effects in (fault, [])]
    assert np.array_equal(both[0]["bogie.rate_yaw [rad/s]"], both[1]["bogie.rate_yaw [rad/s]"])
    difference = both[0]["bogie.rate_pitch [rad/s]"] - both[1]["bogie.rate_pitch [rad/s]"]
    assert difference == pytest.approx(0.5, abs=1e-3)
