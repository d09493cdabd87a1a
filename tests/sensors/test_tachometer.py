"""Tachometer: pulses of the real rotation, against closed forms: constant speed, slip, acceleration, standstill."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railsim.sensors.errors import SensorErrors
from railsim.sensors.tachometer import Tachometer
from tests.sensors.synthetic import RADIUS, times, write_truth

SPEED, RUNNING = "wheelset1.wheel_speed [rad/s]", "wheelset1.speed [m/s]"


def measure(tmp_path: Path, angle: np.ndarray, duration: float = 2.0, seed: int = 1, **settings: Any):
    truth = write_truth(tmp_path / "truth", {"wheelset1.spin_angle [rad]": angle}, duration)
    sensor = Tachometer.build({"name": "wheelset1", "body": "wheelset1", "rate": 256.0} | settings)
    return sensor.measure(truth, np.random.default_rng(seed))


@pytest.mark.parametrize("speed", [0.5, 3.7, 44.4, 190.0])
@pytest.mark.parametrize("pulses", [60, 100, 2048])
def test_constant_speed_within_the_clock(tmp_path: Path, speed: float, pulses: int) -> None:
    table = measure(tmp_path, 5.0 + speed * times(2.0), pulses=pulses, clock=1e6)
    apart = 2 * np.pi / pulses / speed
    bound = 1e-6 / max(1 / 256 - apart, apart)
    assert np.abs(table[SPEED] / speed - 1).max() < 1.01 * bound
    np.testing.assert_allclose(table[RUNNING], table[SPEED] * RADIUS)


@pytest.mark.parametrize("seed", range(4))
def test_first_pulse_of_a_wheel_that_turns_slowly_shows_its_speed(tmp_path: Path, seed: int) -> None:
    """A pulse every 5.2 s: the one before the first of the record was long before it; after 1 s the speed is zero."""
    speed = measure(tmp_path, 0.3 * times(6.0), 6.0, seed=seed, pulses=4)[SPEED].to_numpy()
    assert set(np.round(speed, 6)) == {0.0, 0.3}
    assert 200 < np.count_nonzero(speed) <= 2 * 257


def test_coarse_clock_is_seen_in_the_resolution(tmp_path: Path) -> None:
    errors = measure(tmp_path, 44.4 * times(2.0), clock=1e4)[SPEED].to_numpy() / 44.4 - 1
    assert 1e-3 < np.abs(errors).max() < 1e-4 / (1 / 256 - 2 * np.pi / 100 / 44.4)


def test_shows_the_wheel_and_not_the_train_when_it_slides(tmp_path: Path) -> None:
    rolling = 20 / RADIUS
    table = measure(tmp_path, 0.8 * rolling * times(2.0))
    np.testing.assert_allclose(table[RUNNING], 16.0, rtol=1e-3)


def test_radius_error_is_nominal_over_true(tmp_path: Path) -> None:
    table = measure(tmp_path, 20 / RADIUS * times(2.0), radius_error=0.01)
    np.testing.assert_allclose(table[RUNNING], 20.2, rtol=1e-3)
    np.testing.assert_allclose(table[SPEED], 20 / RADIUS, rtol=1e-3)


def test_acceleration_is_the_mean_over_the_last_pulses_and_latency_delays_it(tmp_path: Path) -> None:
    time = times(4.0)
    for latency in (0.0, 0.013):
        table = measure(tmp_path, 30 * time + time**2, 4.0, errors={"latency": latency}, pulses=2000)
        at = table["time [s]"].to_numpy()
        due = 30 + 2 * (at - latency - 0.5 / 256)
        np.testing.assert_allclose(table[SPEED][at > 0.1], due[at > 0.1], atol=0.012)


def test_a_wheel_that_stops_falls_to_zero_within_the_timeout(tmp_path: Path) -> None:
    time = times(4.0)
    table = measure(tmp_path, 10 * np.minimum(time, 1.0), 4.0, timeout=0.5)
    at, speed = table["time [s]"].to_numpy(), table[SPEED].to_numpy()
    after = at > 1.0 + 2 * np.pi / 1000
    assert np.all(np.diff(speed[after]) <= 0)
    assert np.all(speed[at > 1.52] == 0)
    pitch = 2 * np.pi / 100
    assert np.all(speed[after] <= pitch / (at[after] - 1.0) + 1e-9)


def test_standstill_is_zero_from_the_start(tmp_path: Path) -> None:
    table = measure(tmp_path, np.zeros(2049))
    assert np.all(table[SPEED] == 0)


def test_pulses_do_not_tell_the_direction(tmp_path: Path) -> None:
    table = measure(tmp_path, -44.0 * times(2.0))
    np.testing.assert_allclose(table[SPEED], 44.0, rtol=1e-3)


def test_noise_and_range_act_on_the_wheel_speed(tmp_path: Path) -> None:
    errors = {"noise_density": 0.1, "range": 44.5}
    speed = measure(tmp_path, 44.4 * times(20.0), 20.0, errors=errors)[SPEED].to_numpy()
    assert speed.max() == 44.5
    below = 44.4 - speed[speed < 44.4]
    assert np.sqrt((below**2).mean()) == pytest.approx(0.1 * np.sqrt(128), rel=0.1)


def test_the_phase_of_the_pulse_wheel_is_random(tmp_path: Path) -> None:
    angle = 30 * times(2.0) + times(2.0) ** 2
    assert not measure(tmp_path, angle, seed=1)[SPEED].equals(measure(tmp_path, angle, seed=2)[SPEED])


@pytest.mark.parametrize("wrong", ["bandwidth", "bias", "misalignment_std", "scale_error"])
def test_errors_without_a_meaning_are_refused(wrong: str) -> None:
    errors = SensorErrors.build({wrong: 0.1})
    with pytest.raises(ValueError, match=f"'{wrong}' means nothing for this kind"):
        Tachometer(name="a", body="wheelset1", rate=1, errors=errors)
