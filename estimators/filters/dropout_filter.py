"""Kalman filter over a record whose channels come and go: compiled, scalar updates, the lost ones left out."""

import numpy as np

from estimators.filters.kalman import correct, move, project
from railsim.compiled import allocating


@allocating
def run_filter(A, Q, B, H, D, R, x, P, driving, inputs, samples, rows):
    """Filtered states and their spread over a record.

    Parameters
    ----------
    A, Q : transition and covariance of a step, (n, n). B : of the inputs, (n, m).
    H : (c, n), D : (c, m), R : (c,): what the channels show of states and inputs, and their variances.
    x, P : state (n,) and covariance (n, n) one step before the first; left as they are at the end.
    driving, inputs : inputs one step before and at each step, (steps, m).
    samples : channels, NaN where left out, (steps, c).
    rows : combinations of the states that are wanted, (r, n).

    Returns
    -------
    Wanted combinations and their standard deviations, (steps, r) each.
    """
    steps, channels = samples.shape
    wanted = rows.shape[0]
    gain, scratch = np.empty(A.shape[0]), np.empty(A.shape)
    filtered = np.empty((steps, wanted))
    spread = np.empty((steps, wanted))
    for k in range(steps):
        x[:] = A @ x + B @ driving[k]
        move(P, A, scratch)
        P += Q
        for c in range(channels):
            value = samples[k, c]
            if not np.isfinite(value):
                continue
            variance = project(P, H[c], gain) + R[c]
            correct(x, P, gain, variance, value - H[c] @ x - D[c] @ inputs[k])
        filtered[k] = rows @ x
        for r in range(wanted):
            spread[k, r] = np.sqrt(max(rows[r] @ (P @ rows[r]), 0.0))
    return filtered, spread


def shifted(inputs):
    """Inputs one step before each step, shape as they."""
    return np.ascontiguousarray(np.vstack([inputs[:1], inputs[:-1]]))
