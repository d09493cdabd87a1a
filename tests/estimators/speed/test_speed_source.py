"""The speed source that a recording states: a receiver alone, a column, a tachometer of another wheelset."""

from typing import Any

import numpy as np
import pytest

from estimators.interface import ESTIMATORS
from estimators.speed.odometry import channel_speeds, integrate_speed, missing_speed
from estimators.speed.smoothed_speed import smooth_speed
from estimators.wheel_rail.wheelset_motion import wheelset_speed
from railsim import InputError
from railsim.measurements import Measurements

GNSS, COLUMN, PITCH = "gnss.speed [m/s]", "can.speed [m/s]", "bogie.rate_pitch [rad/s]"


def true_speed(time: np.ndarray) -> np.ndarray:
    """Up from 18 to 30 m/s and down again."""
    return 24.0 - 6.0 * np.cos(2 * np.pi * time / 60.0)


def true_distance(time: np.ndarray) -> np.ndarray:
    return 24.0 * time - 6.0 * 60.0 / (2 * np.pi) * np.sin(2 * np.pi * time / 60.0)


def record(name: str, rate: float, noise: float, source: str | None = None, sheet: Any = None) -> Measurements:
    """A gyro that reads a wave of 10 m of the track, and noisy samples of the speed."""
    rng = np.random.default_rng(5)
    fast, slow = np.arange(0, 60, 1 / 128), np.arange(0, 60, 1 / rate)
    pitch = true_speed(fast) * 1e-3 * np.cos(2 * np.pi * true_distance(fast) / 10.0)
    values = true_speed(slow) + noise * rng.standard_normal(slow.size)
    about: dict[str, Any] = {"origin": "test", "vehicle": {"semi_wheelbase": 1.3}, "sensors": []}
    if sheet is not None:
        about["sensors"] = [{"name": "speed", "channels": [name], **sheet}]
    if source is not None:
        about["speed_source"] = source
    return Measurements(about, {128.0: {"time [s]": fast, PITCH: pitch}, rate: {"time [s]": slow, name: values}})


@pytest.mark.parametrize(
    ("name", "rate", "noise", "sheet"),
    [
        (GNSS, 1.0, 0.1, {"kind": "gnss", "speed_std": 0.1}),
        (GNSS, 1.0, 0.1, None),
        (COLUMN, 10.0, 0.3, None),
        (COLUMN, 0.2, 0.0, None),
    ],
)
def test_distance_by_a_receiver_or_a_column_alone(name: str, rate: float, noise: float, sheet: Any):
    odometry = integrate_speed(record(name, rate, noise, name, sheet))
    time = odometry.knots
    inner = slice(40, -40)
    assert np.std((odometry.speed_at_knots - true_speed(time))[inner]) < max(0.6 * noise, 0.03)
    off = odometry.distance - true_distance(time) + true_distance(time[:1])
    assert np.abs(off).max() < max(3.0 * noise * np.sqrt(60 / rate), 0.5)
    assert odometry.source == name
    assert odometry.speed_std is not None


def test_stated_error_covers_the_speed():
    covered = []
    time, rng = np.arange(0.0, 60.0), np.random.default_rng(99)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        found = smooth_speed(time, true_speed(time) + 0.1 * rng.standard_normal(60), 0.05, 2.5, 0.1)
        covered.append(np.abs(found.speed - true_speed(found.time)) < 1.96 * found.speed_std)
    assert 0.85 < float(np.mean(covered)) < 0.995
    loose = smooth_speed(time, true_speed(time) + 0.1 * rng.standard_normal(60), 0.05, 2.5)
    assert loose.sample_std == pytest.approx(0.1, rel=0.3)


def test_a_speed_that_never_changes_is_that_speed():
    found = smooth_speed(np.arange(0.0, 30.0), np.full(30, 17.0), 0.05, 2.5)
    assert found.speed == pytest.approx(17.0, abs=1e-6)
    assert np.isfinite(found.speed_std).all()


def test_speed_is_not_known_over_an_outage():
    time = np.arange(0.0, 60.0)
    values = true_speed(time)
    values[20:30] = np.nan
    found = smooth_speed(time, values, 0.05, 2.5, 0.05)
    lost = np.isnan(found.speed)
    assert found.time[lost].min() == pytest.approx(19.05) and found.time[lost].max() == pytest.approx(29.95)


def test_estimators_of_track_take_the_stated_source():
    estimator = ESTIMATORS.resolve("alignment_vertical").build({})
    measured = record(GNSS, 1.0, 0.1, GNSS, {"kind": "gnss", "speed_std": 0.1})
    assert estimator.fits(measured)
    estimate = estimator.estimate(measured)
    good = estimate.series["valid [-]"] > 0.5
    exact = estimator.estimate(record("wheelset1.speed [m/s]", 32.0, 0.0)).series["vertical_d1 [m]"]
    assert np.std(estimate.series["vertical_d1 [m]"][good]) == pytest.approx(np.nanstd(exact), rel=0.02)
    assert estimate.about["speed_source"] == GNSS
    assert 0.01 < estimate.about["speed_std [m/s]"] < 0.1


def test_nothing_stated_is_no_source_for_a_receiver():
    measured = record(GNSS, 1.0, 0.1)
    assert missing_speed(measured)
    with pytest.raises(InputError, match=r"name another channel by 'speed_source' in the map or --speed-source"):
        integrate_speed(measured)


@pytest.mark.parametrize(
    ("source", "words"), [("gnss.sped [m/s]", "no channel 'gnss.sped"), (PITCH.replace("rad/s", "m"), "no channel")]
)
def test_a_wrong_statement_is_one_line(source: str, words: str):
    with pytest.raises(InputError, match=words):
        integrate_speed(record(GNSS, 1.0, 0.1, source))


def test_second_wheelset_and_wheels_of_the_contact_take_it_too():
    measured = record("wheelset2.speed [m/s]", 32.0, 0.0, "wheelset2.speed [m/s]")
    assert channel_speeds(measured).means
    time = np.arange(5.0, 50.0)
    assert wheelset_speed(measured, time) == pytest.approx(true_speed(time), abs=0.03)
    by_gnss = record(GNSS, 1.0, 0.0, GNSS, {"kind": "gnss", "speed_std": 0.05})
    assert wheelset_speed(by_gnss, time) == pytest.approx(true_speed(time), abs=0.05)


def test_conicity_by_a_stated_source_lacks_no_tachometer():
    estimator = ESTIMATORS.resolve("conicity_spectral").build({})
    assert estimator.missing(record(GNSS, 1.0, 0.1, GNSS)).channels == ()
    assert estimator.missing(record(GNSS, 1.0, 0.1)).channels == ("wheelset1.speed [m/s]",)
