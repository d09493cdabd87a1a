"""Distance, standstill, gaps and resampling on made-up records."""

import numpy as np
import pytest

from estimators.speed.odometry import BLUR, SPACING, integrate_speed, missing_speed
from railsim import InputError
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements

RATE, SLOW = 256.0, 64.0
NAME = "bogie.rate_pitch [rad/s]"


def record(
    speed: np.ndarray, values: np.ndarray | None = None, errors: dict | None = None, scale: float = 1.0
) -> Measurements:
    """A tachometer, which gives means since the sample before, and one channel; `speed` [m/s] at 256 Hz."""
    time = np.arange(len(speed)) / RATE
    sheet = {"name": "bogie", "channels": [NAME], "errors": errors or {}}
    fast = {"time [s]": time, NAME: np.zeros(len(speed)) if values is None else values}
    every = round(RATE / SLOW)
    mean = np.diff(travelled(speed)[::every], prepend=-speed[0] / SLOW) * SLOW
    slow = {"time [s]": time[::every], "wheelset1.speed [m/s]": scale * mean}
    about = {"origin": "test", "vehicle": {"wheel_radius": 0.46}, "sensors": [sheet]}
    return Measurements(about, {RATE: fast, SLOW: slow})


def travelled(speed: np.ndarray) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 / RATE)])


def test_distance_and_time_at_constant_speed():
    odometry = integrate_speed(record(np.full(5121, 10.0)))
    assert odometry.s[-1] == pytest.approx(200.0, abs=SPACING)
    assert odometry.time == pytest.approx(odometry.s / 10.0, abs=1e-9)
    assert odometry.valid[round(BLUR / SPACING) : -round(BLUR / SPACING)].all()


def test_wheel_spin_serves_where_the_speed_is_not_given():
    time = np.arange(640) / SLOW
    about = {"origin": "test", "vehicle": {"wheel_radius": 0.5}, "sensors": []}
    spin = {"time [s]": time, "wheelset1.wheel_speed [rad/s]": np.full(640, 20.0)}
    assert integrate_speed(Measurements(about, {SLOW: spin})).s[-1] == pytest.approx(99.75, abs=SPACING)


@pytest.mark.parametrize("speed", [4.0, 12.0, 45.0])
def test_wave_in_space_comes_back_at_every_speed(speed: float):
    v = speed * (1 + 0.2 * np.sin(np.arange(round(400.0 / speed * RATE)) / RATE))
    s = travelled(v)
    odometry = integrate_speed(record(v, np.sin(2 * np.pi * s / 3.0)))
    values, good = odometry.channel(record(v, np.sin(2 * np.pi * s / 3.0)), NAME)
    error = values - np.sin(2 * np.pi * odometry.s / 3.0)
    assert good.mean() > 0.95
    assert np.abs(error[good]).max() < 0.05


def test_waves_shorter_than_the_grid_do_not_fold_into_it():
    v = np.full(round(100 * RATE), 4.0)
    s = travelled(v)
    values, good = integrate_speed(record(v)).channel(record(v, np.sin(2 * np.pi * s / 0.13)), NAME)
    assert np.abs(values[good]).max() < 0.01


def test_delay_of_the_data_sheet_is_taken_out():
    sheet = {"bandwidth": 100.0, "bandwidth_order": 2, "latency": 0.02}
    v = np.full(2560, 30.0)
    s = travelled(v)
    late = np.sin(2 * np.pi * (s - 30.0 * (0.02 + np.sqrt(2) / (2 * np.pi * 100.0))) / 8.0)
    measured = record(v, late, sheet)
    assert data_sheet(measured.about, NAME).delay == pytest.approx(0.02 + np.sqrt(2) / (2 * np.pi * 100.0))
    odometry = integrate_speed(measured)
    values, good = odometry.channel(measured, NAME)
    assert values[good] == pytest.approx(np.sin(2 * np.pi * odometry.s[good] / 8.0), abs=0.02)


def test_place_of_the_sensor_is_taken_out():
    v = np.full(2560, 10.0)
    measured = record(v, travelled(v))
    odometry = integrate_speed(measured)
    values, good = odometry.channel(measured, NAME, ahead=1.25)
    assert values[good] == pytest.approx(odometry.s[good] - 1.25, abs=1e-6)


def test_standstill_is_marked_and_distance_goes_on():
    time = np.arange(round(80 * RATE)) / RATE
    v = np.interp(time, [0, 20, 30, 50, 60, 80], [10, 10, 0, 0, 10, 10])
    s = travelled(v)
    odometry = integrate_speed(record(v, s))
    assert odometry.distance[-1] == pytest.approx(s[-1], abs=10.0 / SLOW)  # to the last sample of the tachometer
    assert np.all(np.diff(odometry.time) > 0)
    stop = float(np.interp(40.0, time, s))
    slow = (np.abs(odometry.s - stop) < 0.4) | ~(odometry.speed > odometry.slowest)
    assert not odometry.valid[slow].any()
    assert odometry.valid[np.abs(odometry.s - stop) > 4.0][20:-20].all()
    values, good = odometry.channel(record(v, s), NAME)
    assert values[good] == pytest.approx(odometry.s[good], abs=0.1)
    assert np.isfinite(values).all()


def test_lost_samples_and_lost_times_are_marked():
    v = np.full(5121, 10.0)
    values = travelled(v)
    values[1000:1010] = np.nan
    measured = record(v, values)
    odometry = integrate_speed(measured)
    _, good = odometry.channel(measured, NAME)
    lost = (odometry.s >= values[999] - BLUR / 2) & (odometry.s <= values[1011] + BLUR / 2)
    assert not good[lost].any()
    assert good[20:-20].mean() > 0.97


def test_wrong_wheel_radius_stretches_distance_but_not_time():
    v = np.full(5121, 10.0)
    odometry = integrate_speed(record(v, scale=1.01))
    assert odometry.time == pytest.approx(odometry.s / 10.1, abs=1e-9)


def test_missing_or_silent_source_is_refused():
    about = {"origin": "test", "vehicle": {}, "sensors": []}
    time = np.arange(100) / RATE
    bare = Measurements(about, {RATE: {"time [s]": time, NAME: np.zeros(100)}})
    assert missing_speed(bare, "tachometer")
    with pytest.raises(InputError, match="needs a speed: add a tachometer"):
        integrate_speed(bare)
    with pytest.raises(InputError, match="moves by 0.00 m only"):
        integrate_speed(record(np.zeros(2560)))
