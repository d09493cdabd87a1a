"""Cramér-Rao bound of the conicity: spectra against Lyapunov's equation, and how the bound must behave."""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

from estimators.vehicle.single_wheelset import MASS_Y, STATES, Y_RATE, YAW_RATE, Y, coefficients, linear, wheelset_model
from estimators.wheel_rail.conicity_ekf_track import ConicityEkfTrack
from estimators.wheel_rail.contact_filter import APART, YAW_GYRO
from experiments.bounds.conicity import CHANNELS, channel_spectrum, conicity_bound
from railsim.vehicles.wheelset import WheelsetVehicle

ABOUT = {
    "vehicle": {"name": "wheelset", **WheelsetVehicle.build({"pair": {"kind": "profiles"}}).nominal()},
    "sensors": [],
}
SPEED, RATE, CONICITY = 30.0, 256.0, 0.15


def test_spectra_integrate_to_the_stationary_variances() -> None:
    settings = ConicityEkfTrack().online(ABOUT, RATE).settings
    model = wheelset_model(ABOUT["vehicle"])
    low, high, own = settings.poles * SPEED
    size = STATES + 3
    a, q = np.zeros((size, size)), np.zeros((size, size))
    a[:STATES, :STATES], by_track = linear(model, CONICITY, SPEED)
    a[:STATES, STATES : STATES + 2] = by_track
    a[[Y_RATE, YAW_RATE], STATES + 2] = coefficients(model, SPEED)[2] * CONICITY
    a[STATES, STATES + 1] = 1.0
    a[STATES + 1, STATES : STATES + 2] = -low * high, -(low + high)
    a[STATES + 2, STATES + 2] = -own
    q[Y_RATE, Y_RATE], q[YAW_RATE, YAW_RATE] = settings.noise**2 * settings.step
    q[STATES + 1, STATES + 1] = 2.0 * low * high * (low + high) * settings.drive[0]
    q[STATES + 2, STATES + 2] = 2.0 * own * settings.drive[1]
    expected = solve_continuous_lyapunov(a, -q)
    frequencies = np.concatenate([np.linspace(1e-4, 1.0, 20_000), np.geomspace(1.0, 2000.0, 20_000)[1:]])
    silent = settings._replace(readings=np.zeros_like(settings.readings))
    found = np.asarray(channel_spectrum(model, silent, SPEED, RATE, frequencies, CONICITY, np.ones(2)))
    gyro, apart = CHANNELS.index(YAW_GYRO), CHANNELS.index(APART)
    total = 2.0 * np.trapezoid(np.real(found), frequencies, axis=0)
    assert total[gyro, gyro] == pytest.approx(expected[YAW_RATE, YAW_RATE], rel=0.01)
    across = expected[MASS_Y, MASS_Y] - 2.0 * expected[MASS_Y, Y] + expected[Y, Y]
    assert total[apart, apart] == pytest.approx(across, rel=0.01)


def test_bound_falls_with_the_root_of_the_time_and_rises_with_noise() -> None:
    one = conicity_bound(ABOUT, CONICITY, SPEED, 50.0)
    assert conicity_bound(ABOUT, CONICITY, SPEED, 200.0) == pytest.approx(one / 2.0, rel=1e-9)
    noisy = ABOUT | {"sensors": [{"channels": ["wheelset1.rate_yaw [rad/s]"], "errors": {"noise_density": 1e-2}}]}
    assert conicity_bound(noisy, CONICITY, SPEED, 50.0) > 1.1 * one
