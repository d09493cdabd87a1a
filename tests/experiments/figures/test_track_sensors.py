"""Limits by sensor noise: closed form against the estimator on noise alone."""

import numpy as np
import pytest

from estimators.track.alignment_accelerometer import AlignmentAccelerometer
from estimators.track.alignment_vertical import AlignmentVertical
from experiments.runs.track import POSITIONS, noise_limit, sensor_name, sensors
from railsim.measurements import Measurements
from railsim.scenario import Scenario

RATE, SPEED, DENSITY = 256.0, 10.0, 1e-3


@pytest.mark.parametrize(
    ("turns", "channel", "estimator"),
    [
        (1, "bogie.rate_pitch [rad/s]", AlignmentVertical()),
        (2, "bogie.acceleration_z [m/s2]", AlignmentAccelerometer()),
    ],
)
def test_noise_limit_is_what_the_estimator_makes_of_white_noise(turns: int, channel: str, estimator):
    time = np.arange(round(1200 * RATE)) / RATE
    noise = DENSITY * np.sqrt(RATE / 2) * np.random.default_rng(3).normal(size=len(time))
    tables = {
        RATE: {"time [s]": time, channel: noise},
        64.0: {"time [s]": time[::4], "wheelset1.speed [m/s]": np.full(len(time[::4]), SPEED)},
    }
    series = estimator.estimate(Measurements({"origin": "test", "vehicle": {}, "sensors": []}, tables)).series
    for band in ("d1", "d2"):
        found = float(np.nanstd(series[f"vertical_{band} [m]"]))
        assert found == pytest.approx(noise_limit(DENSITY, SPEED, "vertical", band, turns), rel=0.15)


def test_gyro_against_accelerometer_is_the_ratio_of_densities_over_speed():
    """z'' = a and z'' = -V q: the same filter, so the noise compares as density_a to V density_q."""
    for speed in (4.0, 20.0):
        ratio = noise_limit(7.4e-4, speed, "vertical", "d2", 2) / noise_limit(8.7e-5, speed, "vertical", "d2", 1)
        assert ratio == pytest.approx(7.4e-4 / (8.7e-5 * speed))


def test_sensors_of_the_runs_fit_together():
    values = {"track": "straight_erri_low", "vehicle": "manchester", "speed": {"speed": 20.0}, "duration": 1.0}
    scenario = Scenario.build({**values, "sensors": sensors("mems")})
    names = {channel for sensor in scenario.sensors for channel in sensor.channels()}
    assert {f"{sensor_name(x)}.acceleration_z [m/s2]" for x in POSITIONS} <= names
