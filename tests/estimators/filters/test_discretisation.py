"""Steps of linear models, against numerical integration and closed forms."""

import numpy as np
import pytest
from filterpy.common import van_loan_discretization
from scipy.integrate import quad_vec, solve_ivp
from scipy.linalg import expm

from estimators.filters.discretisation import held_inputs, mean_outputs, ramped_inputs, van_loan

A = np.array([[0.0, 1.0, 0.0], [-40.0, -0.5, 3.0], [0.0, 0.0, -2.0]])
B = np.array([[0.0, 1.0], [2.0, 0.0], [0.0, 0.5]])
STEP = 0.1


def moved(inputs):
    """State after a step from rest, by numerical integration; `inputs` of time."""
    found = solve_ivp(lambda t, x: A @ x + B @ inputs(t), (0.0, STEP), np.zeros(3), rtol=1e-11, atol=1e-13)
    return found.y[:, -1]


def test_covariance_of_a_step_is_the_integral_of_the_noise_that_has_moved_on():
    noise = np.diag([0.0, 3.0, 0.7])
    F, Q = van_loan(A, noise, STEP)
    integral = quad_vec(lambda t: expm(A * t) @ noise @ expm(A * t).T, 0.0, STEP, epsabs=1e-13)[0]
    assert pytest.approx(expm(A * STEP), rel=1e-12) == F
    assert pytest.approx(integral, rel=1e-10, abs=1e-14) == Q
    assert np.array_equal(Q, Q.T)


def test_covariance_is_that_of_filterpy():
    drive = np.array([[0.0], [1.7], [0.0]])
    F, Q = van_loan(A, drive @ drive.T, STEP)
    other_F, other_Q = van_loan_discretization(A, drive, STEP)
    assert pytest.approx(other_F, rel=1e-12) == F
    assert pytest.approx(other_Q, rel=1e-10, abs=1e-15) == Q


def test_inputs_that_stay():
    u = np.array([0.4, -1.2])
    assert held_inputs(A, B, STEP) @ u == pytest.approx(moved(lambda t: u), rel=1e-8)


def test_inputs_that_go_in_a_straight_line():
    before, after = np.array([0.4, -1.2]), np.array([-2.0, 0.3])
    G = ramped_inputs(A, B, STEP)
    expected = moved(lambda t: before + (after - before) * t / STEP)
    assert G @ np.concatenate([before, after]) == pytest.approx(expected, rel=1e-8)


def test_mean_outputs_are_the_integral_over_the_step():
    C = np.array([[1.0, 0.0, 2.0], [0.0, 1.0, 0.0]])
    F, mean = mean_outputs(A, C, STEP)
    integral = quad_vec(lambda t: C @ expm(A * t), 0.0, STEP, epsabs=1e-13)[0]
    assert pytest.approx(expm(A * STEP), rel=1e-12) == F
    assert pytest.approx(integral / STEP, rel=1e-10) == mean
