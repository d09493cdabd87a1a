"""Kalman filter over records with gaps against filterpy's and a closed form."""

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

from estimators.filters.dropout_filter import run_filter, shifted

STEPS = 25


def test_filter_with_inputs_and_gaps_is_that_of_filterpy():
    rng = np.random.default_rng(6)
    A, B = np.array([[1.0, 0.1, 0.0], [-0.3, 0.9, 0.2], [0.0, 0.0, 0.95]]), rng.normal(size=(3, 2))
    H, D, R = rng.normal(size=(2, 3)), rng.normal(size=(2, 2)), np.array([0.3, 0.05])
    Q, wanted = np.diag([0.01, 0.04, 0.02]), np.array([[1.0, 0.0, 0.0], [0.5, -1.0, 2.0]])
    inputs, samples = rng.normal(size=(STEPS, 2)), rng.normal(size=(STEPS, 2))
    samples[5:9], samples[12, 0], samples[15, 1] = np.nan, np.nan, np.inf
    x, P = rng.normal(size=3), np.diag([1.0, 2.0, 0.5])

    reference = KalmanFilter(dim_x=3, dim_z=1)
    reference.x, reference.P = x[:, None].copy(), P.copy()
    means, spreads = [], []
    for k in range(STEPS):
        before = inputs[max(k - 1, 0)]
        reference.predict(u=before[:, None], B=B, F=A, Q=Q)
        for c in range(2):
            if np.isfinite(samples[k, c]):
                reference.update(samples[k, c] - D[c] @ inputs[k], R=R[c], H=H[c : c + 1])
        means.append(wanted @ reference.x[:, 0])
        spreads.append(np.sqrt(np.diag(wanted @ reference.P @ wanted.T)))

    found, spread = run_filter(A, Q, B, H, D, R, x, P, shifted(inputs), inputs, samples, wanted)
    assert found == pytest.approx(np.array(means), rel=1e-10)
    assert spread == pytest.approx(np.array(spreads), rel=1e-10)
    assert x == pytest.approx(reference.x[:, 0], rel=1e-10)  # ready to go on from there
    assert pytest.approx(reference.P, rel=1e-10) == P


def test_constant_seen_with_noise_has_the_mean_of_what_was_seen():
    """And the variance of that mean; a gap changes neither."""
    seen = np.random.default_rng(2).standard_normal((50, 1))
    seen[10:20] = np.nan
    one, zero = np.ones((1, 1)), np.zeros((1, 1))
    inputs = np.zeros((50, 1))
    given = one, zero, zero, one, zero, np.array([4.0]), np.zeros(1), 1e9 * one, inputs, inputs, seen, one
    found, spread = run_filter(*given)
    assert found[-1, 0] == pytest.approx(np.nanmean(seen), rel=1e-6)
    assert spread[-1, 0] == pytest.approx(2.0 / np.sqrt(40), rel=1e-6)
    assert found[9:20, 0] == pytest.approx(found[9, 0])


def test_steady_gains_give_what_every_step_by_itself_gives():
    """A long record, one channel lost for a while after all has settled; by the textbook's formulas, step by step."""
    rng = np.random.default_rng(8)
    A, B = np.array([[0.95, 0.1], [-0.1, 0.9]]), np.array([[0.3], [-0.2]])
    H, D, R = np.array([[1.0, 0.0], [0.4, 1.0]]), np.array([[0.0], [0.5]]), np.array([0.3, 0.05])
    Q, rows = np.diag([0.02, 0.01]), np.array([[1.0, -1.0]])
    inputs, samples = rng.normal(size=(1500, 1)), rng.normal(size=(1500, 2))
    samples[900:950, 1] = np.nan
    x, P = np.zeros(2), 10.0 * np.eye(2)
    own_x, own_P = x.copy(), P.copy()
    found, spread = run_filter(A, Q, B, H, D, R, x, P, shifted(inputs), inputs, samples, rows)
    for k, sample in enumerate(samples):
        own_x, own_P = A @ own_x + B @ inputs[max(k - 1, 0)], A @ own_P @ A.T + Q
        there = np.isfinite(sample)
        h = H[there]
        gain = own_P @ h.T @ np.linalg.inv(h @ own_P @ h.T + np.diag(R[there]))
        own_x = own_x + gain @ (sample[there] - D[there] @ inputs[k] - h @ own_x)
        own_P = own_P - gain @ h @ own_P
        assert found[k] == pytest.approx(rows @ own_x, rel=1e-6, abs=1e-8)
        assert spread[k] == pytest.approx(np.sqrt(np.diag(rows @ own_P @ rows.T)), rel=1e-6)
    assert x == pytest.approx(own_x, rel=1e-6)
    assert pytest.approx(own_P, rel=1e-6) == P
    assert spread[800] == spread[899], "settled: the very same number"
    assert spread[920] > 1.01 * spread[899], "a channel less tells less"
