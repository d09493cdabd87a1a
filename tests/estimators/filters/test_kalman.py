"""Kalman steps against filterpy, and what rounding may not do."""

from typing import Any

import numpy as np
import pytest
from filterpy import kalman

from estimators.filters.kalman import correct, move, project

SIZE = 7
filterpy_predict: Any = kalman.predict  # whose types are those of its defaults
filterpy_update: Any = kalman.update


@pytest.fixture
def state() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean, covariance, row of a measurement."""
    rng = np.random.default_rng(3)
    root = rng.standard_normal((SIZE, SIZE))
    return rng.standard_normal(SIZE), root @ root.T, rng.standard_normal(SIZE)


def test_update_is_that_of_filterpy_and_leaves_the_gain(state):
    x, P, h = state
    expected_x, expected_P = filterpy_update(x.copy(), P.copy(), np.array([0.8]), np.array([[0.3]]), h[None, :])
    expected_gain = P @ h / (h @ P @ h + 0.3)
    gain = np.empty(SIZE)
    S = project(P, h, gain) + 0.3
    correct(x, P, gain, S, 0.8 - h @ x)
    assert x == pytest.approx(expected_x, rel=1e-10)
    assert pytest.approx(expected_P, rel=1e-9, abs=1e-12) == P
    assert gain == pytest.approx(expected_gain, rel=1e-12)


def test_move_is_the_prediction_of_filterpy_with_a_sparse_transition(state):
    x, P, _ = state
    F = np.eye(SIZE) + 0.1 * np.diag(np.arange(1.0, SIZE), 1)
    expected = filterpy_predict(x, P.copy(), F=F, Q=0.0)[1]
    move(P, F, np.empty((SIZE, SIZE)))
    assert pytest.approx(expected, rel=1e-12) == P


def test_covariance_stays_symmetric_to_the_last_digit(state):
    x, P, _ = state
    P = (P + P.T) / 2.0
    rng, gain = np.random.default_rng(4), np.empty(SIZE)
    for _ in range(50):
        h = rng.standard_normal(SIZE)
        S = project(P, h, gain) + 1e-3
        correct(x, P, gain, S, 0.1)
    assert np.array_equal(P, P.T)
