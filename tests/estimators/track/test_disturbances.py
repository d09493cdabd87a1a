"""Unknown forces and heights: spectra against the extended system, variances against integrals."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import solve_continuous_lyapunov

from estimators.track.disturbances import FORCE, HEIGHT, Disturbance, drive, extended, start
from estimators.vehicle.state_space import Output
from estimators.vehicle.vertical import vertical
from railsim.vehicles.manchester import Manchester

SPEED = 20.0  # m/s
OUTPUTS = [
    Output("rate"),
    Output("acceleration", (0.4, 0.0, 0.0)),
    Output("displacement", (1.0, 0.0, 0.0)),
    Output("axlebox", (1.0, 0.0, 0.0)),
]
DISTURBANCES = [
    Disturbance("white", (1,)),
    Disturbance("force", (0, 2), FORCE),
    Disturbance("height", (0, 1), HEIGHT, of_rails=True),
]
VARIANCES = [np.array([0.3]), np.array([0.02, 0.05]), np.array([1e-6, 2e-6])]


@pytest.mark.parametrize("shape", [FORCE, HEIGHT])
def test_density_of_a_shaped_process_has_variance_one(shape):
    one = Disturbance("x", (0,), shape)
    total = quad(lambda x: float(one.density(np.exp([x]))[0]) * np.exp(x), -12.0, 8.0, limit=400)[0]
    assert total == pytest.approx(1.0, rel=1e-3)


def test_spectra_of_the_readings_are_those_of_the_extended_system():
    """White noise through C (i omega - A)^-1; what drives the last state of each process comes from its variance."""
    system = vertical(Manchester().nominal(), OUTPUTS)
    k = 2.0 * np.pi / np.array([40.0, 12.0, 5.0, 3.0])
    transfer = system.transfer(k * SPEED)
    parts = [
        one.spectrum(one.density(k), transfer, variance) for one, variance in zip(DISTURBANCES, VARIANCES, strict=True)
    ]
    whole = extended(system, DISTURBANCES, SPEED)
    entering = drive(len(system.A), DISTURBANCES, VARIANCES, SPEED)
    for number, omega in enumerate(k * SPEED):
        gain = whole.C @ np.linalg.inv(1j * omega * np.eye(len(whole.A)) - whole.A)
        density = 2.0 * SPEED / (2.0 * np.pi) * (gain * entering) @ gain.conj().T
        powers = np.real(np.diag(density))
        size = np.sqrt(np.outer(powers, powers))
        assert (np.abs(np.sum(parts, axis=0)[number] - density) / size).max() < 1e-6


def test_added_states_start_with_the_variance_that_their_drive_keeps():
    system = vertical(Manchester().nominal(), OUTPUTS)
    n, whole = len(system.A), extended(system, DISTURBANCES, SPEED)
    entering = drive(n, DISTURBANCES, VARIANCES, SPEED)
    kept = solve_continuous_lyapunov(whole.A[n:, n:], -np.diag(entering[n:]))
    assert start(DISTURBANCES, VARIANCES) == pytest.approx(np.sqrt(np.diag(kept)), rel=1e-6)


def test_an_accelerometer_feels_a_shaped_force_and_no_white_one():
    """Far above the natural frequencies a force on the bogie is all of its acceleration."""
    transfer = vertical(Manchester().nominal(), OUTPUTS).transfer(np.array([3e4]))
    assert abs(transfer.of_forces[0, 1, 0]) == pytest.approx(1.0, rel=0.01)
    assert abs(transfer.of_white_forces[0, 1, 0]) < 0.01
