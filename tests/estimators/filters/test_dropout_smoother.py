"""Smoother over records with gaps against filterpy's, in one piece and in blocks."""

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

from estimators.filters import dropout_smoother
from estimators.filters.dropout_smoother import smooth

STEPS, RATE = 300, 10.0
RNG = np.random.default_rng(11)
A = np.array([[1.0, 0.1, 0.0], [-0.3, 0.9, 0.2], [0.0, 0.0, 0.95]])
B, H, D, R = RNG.normal(size=(3, 2)), RNG.normal(size=(2, 3)), RNG.normal(size=(2, 2)), np.array([0.3, 0.05])
Q, START, WANTED = np.diag([0.01, 0.04, 0.02]), np.diag([1.0, 2.0, 0.5]), np.array([[1.0, 0.0, 0.0], [0.5, -1.0, 2.0]])
INPUTS, SAMPLES = RNG.normal(size=(STEPS, 2)), RNG.normal(size=(STEPS, 2))
SAMPLES[50:90], SAMPLES[120, 0], SAMPLES[150:152, 1] = np.nan, np.nan, np.inf


def settled() -> np.ndarray:
    """Covariance after a step when all channels have been there for long."""
    P = START
    for _ in range(2000):
        prior = A @ P @ A.T + Q
        P = prior - prior @ H.T @ np.linalg.solve(H @ prior @ H.T + np.diag(R), H @ prior)
    return P


def by_filterpy() -> tuple[np.ndarray, np.ndarray]:
    """Rauch-Tung-Striebel smoother of whole covariance matrices."""
    filtered = KalmanFilter(dim_x=3, dim_z=1)
    filtered.x, filtered.P = np.zeros((3, 1)), settled()
    priors, posteriors = [], []
    for k in range(STEPS):
        filtered.predict(u=INPUTS[max(k - 1, 0)][:, None], B=B, F=A, Q=Q)
        priors.append((filtered.x.copy(), filtered.P.copy()))
        for c in range(2):
            if np.isfinite(SAMPLES[k, c]):
                filtered.update(SAMPLES[k, c] - D[c] @ INPUTS[k], R=R[c], H=H[c : c + 1])
        posteriors.append((filtered.x.copy(), filtered.P.copy()))
    x, P = posteriors[-1]
    found = [(x, P)]
    for (after, spread), (own, own_spread) in zip(priors[:0:-1], posteriors[-2::-1], strict=True):
        gain = own_spread @ A.T @ np.linalg.inv(spread)
        x, P = own + gain @ (x - after), own_spread + gain @ (P - spread) @ gain.T
        found.append((x, P))
    values = [WANTED @ x[:, 0] for x, _ in reversed(found)]
    return np.array(values), np.array([np.sqrt(np.diag(WANTED @ P @ WANTED.T)) for _, P in reversed(found)])


@pytest.mark.parametrize("block", [1000.0, 7.0])
def test_smoother_with_inputs_and_gaps_is_that_of_whole_matrices(monkeypatch: pytest.MonkeyPatch, block: float):
    monkeypatch.setattr(dropout_smoother, "BLOCK", block)
    monkeypatch.setattr(dropout_smoother, "LAG", 12.0)
    given = START.copy()
    values, spread = smooth(A, Q, B, H, D, R, given, INPUTS, SAMPLES, WANTED, RATE)
    expected, deviation = by_filterpy()
    assert values == pytest.approx(expected, abs=2e-3 * expected.std())
    assert spread == pytest.approx(deviation, rel=1e-3)
    assert pytest.approx(START) == given  # what was given is left as it is


def test_a_step_is_smoothed_by_what_follows_it():
    values, spread = smooth(A, Q, B, H, D, R, START, INPUTS, SAMPLES, WANTED, RATE)
    until, short = smooth(A, Q, B, H, D, R, START, INPUTS[:71], SAMPLES[:71], WANTED, RATE)
    assert (spread[70] < short[70]).all()  # in the middle of a gap
    assert values[70] != pytest.approx(until[70], rel=1e-3)
