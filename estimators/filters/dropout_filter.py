"""Kalman filter over a record whose channels come and go: compiled, scalar updates, the lost ones left out."""

import numpy as np

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
    n, wanted = A.shape[0], rows.shape[0]
    transposed = np.ascontiguousarray(A.T)
    filtered = np.empty((steps, wanted))
    spread = np.empty((steps, wanted))
    for k in range(steps):
        x[:] = A @ x + B @ driving[k]
        P[:] = A @ P @ transposed + Q
        for c in range(channels):
            value = samples[k, c]
            if not np.isfinite(value):
                continue
            h = H[c]
            gain = P @ h
            variance = h @ gain + R[c]
            error = value - h @ x - D[c] @ inputs[k]
            for i in range(n):
                x[i] += gain[i] / variance * error
                for j in range(i + 1):
                    P[i, j] -= gain[i] * gain[j] / variance
                    P[j, i] = P[i, j]
        filtered[k] = rows @ x
        for r in range(wanted):
            spread[k, r] = np.sqrt(max(rows[r] @ (P @ rows[r]), 0.0))
    return filtered, spread


def shifted(inputs):
    """Inputs one step before each step, shape as they."""
    return np.ascontiguousarray(np.vstack([inputs[:1], inputs[:-1]]))
