"""Smoother of a record whose channels come and go: as `dropout_filter`, each step by what follows it as well.

Modified Bryson-Frazier recursion (Bierman 1977, Factorization Methods for Discrete Sequential Estimation, chapter 10),
which inverts no matrix. With the scalar updates x = x + K e, e = z - h' x, S the innovation's variance and K = P h / S,
backwards through a step's channels and over its transition A,

    l = l - h (K' l + e / S),   L = (I - K h')' L (I - K h') + h h' / S,   then   l = A' l,   L = A' L A,

and where all of a step's channels are passed, with x and P predicted for it: x - P l and P - P L P are smoothed.

Covariances depend on which channels are there, not on what they show. Where these have been the same for so long that
a step changes no variance by more than `SAME`, the covariances of the step before serve. The record begins with those
that all channels lead to in the end.
"""

import numpy as np
from scipy.linalg import solve_discrete_are

from estimators.filters.kalman import correct, dot, move, multiply, project
from railsim.compiled import allocating

SAME = 1e-5
"""Relative change of a variance in a step below which it counts as settled."""
BLOCK, LAG = 30.0, 5.0
"""Seconds that are smoothed at once, and seconds after them that are looked at."""


def smooth(A, Q, B, H, D, R, start, inputs, samples, rows, rate):
    """Smoothed combinations of the states and their spread over a record.

    Parameters
    ----------
    A, Q : transition and covariance of a step, (n, n). B : of the inputs, (n, m).
    H : (c, n), D : (c, m), R : (c,): what the channels show of states and inputs, and their variances.
    start : covariance one step before the first, (n, n), where there is no settled one.
    inputs : (steps, m). samples : NaN where left out, (steps, c).
    rows : combinations of the states that are wanted, (r, n). rate : Hz.

    Returns
    -------
    Wanted combinations and their standard deviations, (steps, r) each.
    """
    A, Q, B, H, D, R, rows = (np.ascontiguousarray(one) for one in (A, Q, B, H, D, R, rows))
    steps, block, lag = len(samples), round(BLOCK * rate), round(LAG * rate)
    driving = np.vstack([inputs[:1], inputs[:-1]])
    x, P = np.zeros(len(A)), _start(A, Q, H, R, start)
    values, spread = np.empty((2, steps, len(rows)))
    for first in range(0, steps, block):
        last = min(first + block, steps)
        seen = slice(first, min(last + lag, steps))
        before, given, shown = (np.ascontiguousarray(one[seen]) for one in (driving, inputs, samples))
        found = _block(A, Q, B, H, D, R, x, P, before, given, shown, rows, last - first)
        values[first:last], spread[first:last] = found[0][: last - first], found[1][: last - first]
    return values, spread


def _start(A: np.ndarray, Q: np.ndarray, H: np.ndarray, R: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Covariance after the channels of a step, settled as if all had been there for ever."""
    try:
        prior = solve_discrete_are(A.T, H.T, Q, np.diag(R))
    except np.linalg.LinAlgError:
        return start.copy()
    return prior - prior @ H.T @ np.linalg.solve(H @ prior @ H.T + np.diag(R), H @ prior)


@allocating
def _block(A, Q, B, H, D, R, x, P, driving, inputs, samples, rows, keep):
    """Smooth some steps; x and P are left as they are after the first `keep` of them."""
    steps, channels = samples.shape
    n, wanted = A.shape[0], rows.shape[0]
    predicted, error = np.empty((steps, n)), np.zeros((steps, channels))
    kind = np.empty(steps, dtype=np.int64)  # which covariances serve
    priors = np.empty((steps, n, n))
    gains, variances = np.empty((steps, channels, n)), np.empty((steps, channels))
    there = np.empty(channels, dtype=np.bool_)
    scratch, forced = np.empty((n, n)), np.empty(n)
    kept_x, kept_P = x.copy(), P.copy()
    kinds, settled = 0, False
    for k in range(steps):
        same = k > 0
        for c in range(channels):
            seen = np.isfinite(samples[k, c])
            same = same and seen == there[c]
            there[c] = seen
        multiply(A, x, predicted[k])
        multiply(B, driving[k], forced)
        for i in range(n):
            predicted[k, i] += forced[i]
            x[i] = predicted[k, i]
        if not (same and settled):
            move(P, A, scratch)
            P += Q
            priors[kinds] = P
            for c in range(channels):
                variances[kinds, c] = np.inf
                gains[kinds, c] = 0.0
                if there[c]:
                    variance = project(P, H[c], gains[kinds, c]) + R[c]
                    variances[kinds, c] = variance
                    correct(scratch[0], P, gains[kinds, c], variance, 0.0)
            settled = same and kinds > 0 and _alike(priors[kinds], priors[kinds - 1])
            kinds += 1
        kind[k] = kinds - 1
        for c in range(channels):
            if there[c]:
                innovation = samples[k, c] - dot(D[c], inputs[k]) - dot(H[c], x)
                error[k, c] = innovation / variances[kind[k], c]
                for i in range(n):
                    x[i] += gains[kind[k], c, i] * innovation
        if k == keep - 1:
            kept_x[:], kept_P[:] = x, P
    values, spread = np.empty((steps, wanted)), np.empty((steps, wanted))
    _backwards(A, H, kind, priors, gains, variances, predicted, error, rows, values, spread)
    x[:], P[:] = kept_x, kept_P
    return values, spread


@allocating
def _backwards(A, H, kind, priors, gains, variances, predicted, error, rows, values, spread):
    """Fill `values` and `spread` (steps, r) from the last step to the first."""
    steps, channels = error.shape
    n, wanted = A.shape[0], rows.shape[0]
    forward = np.ascontiguousarray(A.T)
    pull, weight = np.zeros(n), np.zeros((n, n))
    before, scratch, by = np.zeros((n, n)), np.empty((n, n)), np.empty(n)
    reach, width = np.empty((wanted, n)), np.empty(wanted)
    settled = False
    for step in range(steps):
        k = steps - 1 - step
        e = kind[k]
        same = step > 0 and kind[k + 1] == e
        for number in range(channels):
            c = channels - 1 - number
            if np.isfinite(variances[e, c]):
                h, gain = H[c], gains[e, c]
                push = dot(gain, pull) + error[k, c]
                for i in range(n):
                    pull[i] -= h[i] * push
                if not (same and settled):
                    own = project(weight, gain, by) + 1.0 / variances[e, c]
                    for i in range(n):
                        for j in range(n):
                            weight[i, j] += h[i] * h[j] * own - h[i] * by[j] - by[i] * h[j]
        if not (same and settled):
            settled = same and _alike(weight, before)
            before[:] = weight
            for r in range(wanted):
                own = project(priors[e], rows[r], reach[r])
                width[r] = np.sqrt(max(own - project(weight, reach[r], by), 0.0))
            move(weight, forward, scratch)
        for r in range(wanted):
            values[k, r] = dot(rows[r], predicted[k]) - dot(reach[r], pull)
            spread[k, r] = width[r]
        multiply(forward, pull, by)
        pull[:] = by


@allocating
def _alike(one, other):
    """Whether no variance differs by more than the share `SAME`."""
    own = np.diag(one)
    return np.all(np.abs(own - np.diag(other)) <= SAME * np.abs(own))
