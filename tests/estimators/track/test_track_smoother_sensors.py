"""The fused estimate with sensors at the wheelsets, alone or in pairs, and away from the bogie's middle."""

from typing import Any

import numpy as np
import pytest

from estimators.track.track_smoother import TrackSmoother
from experiments.scoring.track import band_errors, true_track
from railsim import measure, simulate
from railsim.measurements import TIME, Measurements
from railsim.scenario import Scenario
from railsim.truth import Truth

COMMON: dict[str, Any] = {"body": "bogie", "rate": 256, "errors": "mems"}
BASE: list[dict[str, Any]] = [
    {"kind": "accelerometer", "name": "bogie", **COMMON},
    {"kind": "gyro", "name": "bogie", **COMMON},
    {"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 64},
]
HEAD: dict[str, Any] = {
    "track": "straight_erri_low",
    "vehicle": "manchester",
    "speed": {"kind": "constant", "speed": 20},
    "start": 25,
    "duration": 25,
    "output_rate": 1024,
}


def _axlebox(side: str) -> dict[str, Any]:
    place = [0.0, 1.0 if side == "left" else -1.0, 0.0]
    shared = {"body": "wheelset1", "rate": 1024, "errors": "axlebox", "axes": ["z"]}
    return {"kind": "accelerometer", "name": f"axlebox1_{side}", "position": place, **shared}


def _transducer(side: str) -> dict[str, Any]:
    return {"kind": "displacement", "name": f"primary1_{side}", "rate": 256, "errors": "transducer"}


@pytest.fixture(scope="module")
def truth() -> Truth:
    return simulate(Scenario.build(HEAD | {"sensors": BASE}), "compiled")


def _errors(truth: Truth, more: list[dict[str, Any]], base: list[dict[str, Any]] = BASE) -> dict[str, float]:
    """Error of D1 by quantity, mm rms."""
    measured = measure(truth, Scenario.build(HEAD | {"sensors": [*base, *more]}), seed=4).measurements
    estimate = TrackSmoother().estimate(measured)
    true = true_track(truth, estimate.series["time [s]"].to_numpy(), 0.125)
    found = {}
    for quantity in ("vertical", "cross_level", "lateral", "left_vertical"):
        rows = band_errors(estimate, truth, quantity, "d1", true)
        found[quantity] = 1e3 * float(np.sqrt(np.mean((rows["estimated [m]"] - rows["true [m]"]) ** 2)))
    return found


@pytest.mark.parametrize(
    "more",
    [
        [_transducer("left")],
        [_transducer("right")],
        [_transducer("left"), _transducer("right")],
        [_axlebox("left"), _axlebox("right")],
        [_axlebox("right")],
    ],
    ids=["transducer left", "transducer right", "transducers", "axleboxes", "axlebox right"],
)
def test_sensors_at_a_wheelset_make_cross_level_better(truth: Truth, more: list[dict[str, Any]]):
    without, found = _errors(truth, []), _errors(truth, more)
    assert found["cross_level"] < without["cross_level"]
    assert found["vertical"] < 1.05 * without["vertical"]
    assert found["left_vertical"] < 0.3


def test_accelerometer_beside_the_middle_serves_for_the_one_in_it(truth: Truth):
    """Its share of the bogie's roll is taken out: without that D1 would err by more than 0.1 mm."""
    beside = BASE[0] | {"position": [0.9, 0.8, 0.1]}
    assert _errors(truth, [], [beside, *BASE[1:]])["vertical"] < 0.06


def _gapped(measured: Measurements, channels: list[str], first: float, last: float) -> Measurements:
    """Without the samples of some channels between two instants (s)."""
    frames: dict[float, dict[str, np.ndarray]] = {}
    for name in measured:
        time = measured.time(name)
        lost = (time > first) & (time < last) & (name in channels)
        frames.setdefault(measured.rate(name), {TIME: time})[name] = np.where(lost, np.nan, measured[name])
    return Measurements(measured.about, frames, measured.track)


@pytest.mark.parametrize(("length", "hidden"), [(0.02, False), (0.5, True)])
def test_what_a_gap_leaves_is_as_good_as_without_it(truth: Truth, length: float, hidden: bool):
    """Attitude through a longer gap is a guess that lateral alignment and cross level would show as track."""
    measured = measure(truth, Scenario.build(HEAD | {"sensors": BASE}), seed=4).measurements
    whole = TrackSmoother().estimate(measured).series
    rows = [name for name in measured if measured.rate(name) == 256.0]
    left = TrackSmoother().estimate(_gapped(measured, rows, 12.0, 12.0 + length)).series
    for name in ("lateral_d1", "lateral_d2", "cross_level_d1", "cross_level_d2"):
        off = left[f"{name} [m]"].to_numpy() - whole[f"{name} [m]"].to_numpy()
        assert np.sqrt(np.nanmean(off**2)) < np.median(whole[f"{name}_std [m]"].to_numpy())
    time = left["time [s]"].to_numpy()
    inside = (time > 12.0) & (time < 12.0 + length)
    assert np.isnan(left["lateral [m]"].to_numpy()[inside]).any() == hidden
    stated, before = (np.isfinite(one["lateral_d1 [m]"].to_numpy()).sum() for one in (left, whole))
    assert stated > 0.4 * before


def test_lateral_alignment_is_nearer_than_the_path_of_the_bogie(truth: Truth):
    """True size of D1 0.68 mm; what is lost near 5.1 m, where both wheelsets' shares cancel, is 0.1 mm."""
    assert 0.1 < _errors(truth, [])["lateral"] < 0.25
