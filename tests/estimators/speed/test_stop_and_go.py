"""A stop in a simulated record: every estimator of track geometry marks it, invents nothing and goes on."""

import numpy as np
import pytest

from estimators.interface import ESTIMATORS
from estimators.speed.odometry import SpeedSource
from estimators.speed.speed_refined import SpeedRefined
from estimators.track.dipped_joints import DippedJoints
from estimators.track.geometry import TrackEstimator
from estimators.track.switches import Switches
from estimators.track.track_smoother import TrackSmoother
from experiments.runs.track import sensors
from experiments.scoring.score import score
from railsim import measure, simulate
from railsim.measurements import Measurements
from railsim.scenario import Scenario
from railsim.truth import Truth

KINDS = {
    name: kind
    for name, kind in ESTIMATORS.classes().items()
    if issubclass(kind, TrackEstimator | DippedJoints | Switches) and name != "track_smoother"
}
BODY = {"kind": "accelerometer", "name": "body", "body": "body", "axes": ["z"], "rate": 256.0, "errors": "mems"}
STOP = 7.0  # m around it
LARGEST = {"[m]": 0.04, "[1/m]": 0.06, "[rad]": 0.02, "[m/m]": 0.01, "[-]": 60.0}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Truth, Measurements]:
    """16 m/s, braked at 1 m/s2, 5 s of standstill, and away again; MEMS sensors on jointed track."""
    values = {
        "track": "jointed_60ft",
        "vehicle": "class175",
        "speed": {"kind": "profile", "time": [0, 6, 22, 27, 43, 50], "speed": [16, 16, 0, 0, 16, 16]},
        "start": 60.0,
        "duration": 50.0,
        "sensors": [*sensors("mems"), BODY],
    }
    scenario = Scenario.build(values)
    truth = simulate(scenario, "compiled", tmp_path_factory.mktemp("stop"))
    return truth, measure(truth, scenario, seed=3).measurements


def test_all_of_them_are_tried() -> None:
    assert {"alignment_lateral", "alignment_vertical", "axlebox_profile", "cross_level", "dipped_joints"} <= set(KINDS)


@pytest.mark.parametrize("source", ["tachometer", "refined"])
@pytest.mark.parametrize("name", list(KINDS))
def test_stop_is_marked_and_nothing_is_made_up(run, name: str, source: str) -> None:
    truth, measured = run
    series = KINDS[name].build({"speed_source": source}).estimate(measured).series
    true = np.interp(series["time [s]"], truth.time, truth["s [m]"])
    place = series["s [m]"].to_numpy()
    assert place[-1] == pytest.approx(true[-1] - true[0], rel=0.02)  # distance does not grow at standstill
    stop = float(np.interp(24.0, truth.time, truth["s [m]"]))
    still = np.abs(true - stop) < 0.1
    assert still.any()
    assert not (series["valid [-]"].to_numpy()[still] > 0.5).any()
    for column in series.columns:
        values = series[column].to_numpy(dtype=float)
        if column not in ("s [m]", "time [s]", "valid [-]"):
            assert not np.isfinite(values[still]).any(), column
            assert np.nanmax(np.abs(values), initial=0.0) < LARGEST[column[column.index("[") :]], column
    valid = series["valid [-]"].to_numpy() > 0.5
    assert valid[(true < stop - 50.0) & (true > true[0] + 45.0)].all() or "lateral" in name or "cross" in name


@pytest.mark.parametrize("source", ["tachometer", "refined"])
def test_fused_estimate_goes_through_a_stop(run, source: SpeedSource) -> None:
    truth, measured = run
    estimate = TrackSmoother(speed_source=source).estimate(measured)
    series = estimate.series
    true = np.interp(series["time [s]"], truth.time, truth["s [m]"])
    still = np.abs(true - float(np.interp(24.0, truth.time, truth["s [m]"]))) < 0.1
    assert still.any()
    assert not (series["valid [-]"].to_numpy()[still] > 0.5).any()
    found = score(estimate, truth)
    assert found["vertical D1 rms error [mm]"] < 0.2
    assert found["vertical D1 within 2 std [-]"] > 0.9
    assert found["vertical D2 rms error [mm]"] < 0.6 * found["vertical D2 true rms [mm]"]


def test_refined_speed_knows_a_standstill(run) -> None:
    """Before, noise and the jerk of stopping were taken for 58 m/s in this record."""
    truth, measured = run
    series = SpeedRefined().estimate(measured).series
    true = np.interp(series["time [s]"], truth.time, truth["speed [m/s]"])
    valid = series["valid [-]"].to_numpy() > 0.5
    assert not valid[true < 0.5].any()
    assert np.mean(valid[true > 10.0]) > 0.6  # found again after the stop
    assert np.abs(series["speed [m/s]"].to_numpy() - true)[valid & (true > 10.0)].max() < 1.5
