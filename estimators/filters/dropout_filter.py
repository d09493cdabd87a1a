"""Kalman filter over a record whose channels come and go: compiled, scalar updates, the lost ones left out.

Covariances depend on which channels are there, not on what they show. Where these have been the same for so long that
a step changes no variance by more than `SAME`, the gains and variances of the step before serve (steady gains).
"""

import numpy as np

from estimators.filters.kalman import correct, dot, move, multiply, project
from railsim.compiled import allocating, kernel

SAME = 1e-9
"""Relative change of a variance in a step below which it counts as settled; of those that take 1000 steps to settle,
one part in a million is then left.
"""


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
    scratch, moved, forced, before = np.empty((n, n)), np.empty(n), np.empty(n), np.empty(n)
    gains, variances = np.empty((channels, n)), np.empty(channels)
    there = np.zeros(channels, dtype=np.bool_)
    filtered, spread = np.empty((steps, wanted)), np.empty((steps, wanted))
    settled = False
    for k in range(steps):
        same = k > 0
        for c in range(channels):
            seen = np.isfinite(samples[k, c])
            same = same and seen == there[c]
            there[c] = seen
        multiply(A, x, moved)
        multiply(B, driving[k], forced)
        for i in range(n):
            x[i] = moved[i] + forced[i]
        settled = settled and same
        if not settled:
            for i in range(n):
                before[i] = P[i, i]
            _covariances(A, Q, H, R, P, there, gains, variances, scratch)
            _widths(P, rows, moved, spread[k])
            settled = same
            for i in range(n):
                settled = settled and abs(P[i, i] - before[i]) <= SAME * P[i, i]
        else:
            spread[k] = spread[k - 1]
        for c in range(channels):
            if there[c]:
                error = samples[k, c] - dot(H[c], x) - dot(D[c], inputs[k])
                for i in range(n):
                    x[i] += gains[c, i] * error
        multiply(rows, x, filtered[k])
    return filtered, spread


@kernel
def _covariances(A, Q, H, R, P, there, gains, variances, scratch):
    """A step of P (n, n) and the gain of each channel that is there."""
    move(P, A, scratch)
    for i in range(P.shape[0]):
        for j in range(P.shape[0]):
            P[i, j] += Q[i, j]
    for c in range(H.shape[0]):
        if there[c]:
            variances[c] = project(P, H[c], gains[c]) + R[c]
            correct(scratch[0], P, gains[c], variances[c], 0.0)


@kernel
def _widths(P, rows, scratch, out):
    """Standard deviations of the combinations `rows` (r, n) of states of covariance P (n, n)."""
    for r in range(rows.shape[0]):
        out[r] = np.sqrt(max(project(P, rows[r], scratch), 0.0))


def shifted(inputs):
    """Inputs one step before each step, shape as they."""
    return np.ascontiguousarray(np.vstack([inputs[:1], inputs[:-1]]))
