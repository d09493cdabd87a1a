"""Kalman filter and smoother over distance for a vehicle whose wheelsets pass the same track one after the other.

The state is [top, line]: `top` holds the vehicle's states, the outputs of the last step, the sensors' biases and the
track's shaping states, last of them the track at the leading wheelset now; `line` the track one step ago ... one
wheelbase ago. The track has one or more quantities, which stand side by side. A step moves the line on by one place
and forms only the top anew, so that a step costs some thousand operations where dense matrices of that size would
cost a hundred thousand. The smoother is the modified Bryson-Frazier
form (Bierman 1973, "Fixed interval smoothing with discrete measurements"), which inverts no matrix; it gives the same
numbers as Rauch, Tung and Striebel's.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from estimators.filters.kalman import correct
from railsim.compiled import allocating, inlined

BLOCK = 32768
"""Steps whose filtered covariances are held at once: 0.1 to 0.3 GB."""


class Steps(NamedTuple):
    """Transitions by speed, between which is interpolated.

    Attributes
    ----------
    F : rows of the transition for the top and the line's first entry, shape (speeds, rows, columns).
    Q : covariance of what is new in them, shape (speeds, rows, rows).
    column : index in the state of each column of F, shape (columns,).
    parts : index in the state of each measured output, of its bias and of its two tilts, shape (m, 4).
    unsettled : variance added to the vehicle's states where its motion is not known (standstill), shape (rows,).
    quantities : how many quantities the track has; the last of the top are their values now.
    """

    F: np.ndarray
    Q: np.ndarray
    column: np.ndarray
    parts: np.ndarray
    unsettled: np.ndarray
    quantities: int


@inlined
def _interpolate(table, index, out):
    """out = the table at a fractional index."""
    low = min(int(index), table.shape[0] - 1)
    high = min(low + 1, table.shape[0] - 1)
    share = index - low
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = table[low, i, j] + share * (table[high, i, j] - table[low, i, j])


@inlined
def _predict(P, F, Q, column, quantities, A, there, new):
    """new = F P F' + Q with the lines moved on; A and `there` are scratch of shapes (rows, states) and (columns,)."""
    rows, columns = F.shape
    states = P.shape[0]
    for i in range(rows):
        for j in range(states):
            A[i, j] = 0.0
        for c in range(columns):
            factor = F[i, c]
            if factor != 0.0:
                row = P[column[c]]
                for j in range(states):
                    A[i, j] += factor * row[j]
    for i in range(rows):
        for c in range(columns):
            there[c] = A[i, column[c]]
        for j in range(i + 1):
            total = Q[i, j]
            for c in range(columns):
                total += there[c] * F[j, c]
            new[i, j] = new[j, i] = total
    for i in range(rows):
        for j in range(rows, states):
            new[i, j] = A[i, j - quantities]
    for i in range(rows, states):
        for j in range(rows):
            new[i, j] = A[j, i - quantities]
        for j in range(rows, states):
            new[i, j] = P[i - quantities, j - quantities]


def smooth(
    steps: Steps,
    index: np.ndarray,
    measured: np.ndarray,
    R: np.ndarray,
    tilt_factors: np.ndarray,
    settled: np.ndarray,
    x: np.ndarray,
    P: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Smoothed mean and variance of the track, shapes (n, quantities); parameters as of `forward`.

    A record of more than `BLOCK` steps is filtered twice: the first time, only the states at the beginnings of blocks
    are kept. The numbers are those of one pass, to the last bit.
    """
    count = len(index)

    def over(kernel: Callable[..., Any], begin: int, *rest: Any) -> Any:
        here = slice(begin, begin + BLOCK)
        courses = (index, measured, R, tilt_factors, settled) if kernel is forward else (index, tilt_factors)
        return kernel(steps, *(one[here] for one in courses), *rest, begin == 0)

    begins = range(0, count, BLOCK)
    starts = []
    for begin in begins:
        starts.append((x.copy(), P.copy()))
        if begin != begins[-1]:
            over(forward, begin, x, P)
    values, variance = np.empty((count, steps.quantities)), np.empty((count, steps.quantities))
    adjoint, L = np.zeros(len(x)), np.zeros_like(P)
    for begin, start in zip(reversed(begins), reversed(starts), strict=True):
        filtered = over(forward, begin, *start)
        values[begin : begin + BLOCK], variance[begin : begin + BLOCK] = over(backward, begin, filtered, adjoint, L)
    return values, variance


@allocating
def forward(steps, index, measured, R, tilt_factors, settled, x, P, first):
    """Kalman filter from (x, P), which become those after the last step.

    Parameters
    ----------
    index : fractional index of each step's speed in the tables, shape (n,).
    measured : shape (n, m), NaN where there is nothing.
    R : variances, shape (n, m).
    tilt_factors : factors of the tilts in each measurement, shape (n, m, 2).
    settled : False where the vehicle's motion is unknown, shape (n,).
    first : whether (x, P) are those at the first step; else those after the step before it.

    Returns
    -------
    Predicted mean of the track now (n, lines), its covariance with all states (n, lines, states), gains (n, m, states),
    innovations and their variances (n, m); variance 0 where nothing was measured. Then the log likelihood.
    """
    count, m = measured.shape
    states = len(x)
    rows, columns = steps.F.shape[1:]
    quantities = steps.quantities
    mean, beside = np.empty((count, quantities)), np.empty((count, quantities, states))
    gains, innovations, variances = np.zeros((count, m, states)), np.zeros((count, m)), np.zeros((count, m))
    F, Q, A, new = np.empty((rows, columns)), np.empty((rows, rows)), np.empty((rows, states)), np.empty_like(P)
    top, there = np.empty(rows), np.empty(columns)
    likelihood, given = 0.0, P
    for k in range(count):
        if k > 0 or not first:
            _interpolate(steps.F, index[k], F)
            _interpolate(steps.Q, index[k], Q)
            for i in range(rows):
                top[i] = 0.0
                for c in range(columns):
                    top[i] += F[i, c] * x[steps.column[c]]
            for i in range(states - 1, rows - 1, -1):
                x[i] = x[i - quantities]
            x[:rows] = top
            _predict(P, F, Q, steps.column, quantities, A, there, new)
            P, new = new, P
            if not settled[k]:
                for i in range(rows):
                    P[i, i] += steps.unsettled[i]
        for i in range(quantities):
            mean[k, i] = x[rows - quantities + i]
            beside[k, i] = P[rows - quantities + i]
        for j in range(m):
            if np.isfinite(measured[k, j]):
                output, bias, first_tilt, second_tilt = steps.parts[j]
                first_factor, second_factor = tilt_factors[k, j]
                error = (
                    measured[k, j] - x[output] - x[bias] - first_factor * x[first_tilt] - second_factor * x[second_tilt]
                )
                gain = gains[k, j]
                for i in range(states):
                    gain[i] = (
                        P[output, i] + P[bias, i] + first_factor * P[first_tilt, i] + second_factor * P[second_tilt, i]
                    )
                S = (
                    gain[output]
                    + gain[bias]
                    + first_factor * gain[first_tilt]
                    + second_factor * gain[second_tilt]
                    + R[k, j]
                )
                correct(x, P, gain, S, error)
                innovations[k, j], variances[k, j] = error, S
                likelihood -= 0.5 * (np.log(S) + error * error / S)
    given[:] = P
    return mean, beside, gains, innovations, variances, likelihood


@allocating
def backward(steps, index, tilt_factors, filtered, adjoint, L, first):
    """Smoothed mean and variance of the track, shapes (n, lines), from what `forward` returned.

    adjoint, L : what later steps say of the state after the last one, zero at the end of the record, shapes (states,)
    and (states, states); they become those after the step before the first one. first : there is no such step.
    """
    mean, beside, gains, innovations, variances, _ = filtered
    count, quantities, states = beside.shape
    m = gains.shape[1]
    rows, columns = steps.F.shape[1:]
    smoothed, spread = np.empty((count, quantities)), np.empty((count, quantities))
    given, new = L, np.empty((states, states))
    F, G, half = np.empty((rows, columns)), np.empty((columns, columns)), np.empty((rows, columns))
    side, moved, back = np.empty((columns, states)), np.empty(states), np.empty(states)
    for k in range(count - 1, -1, -1):
        for j in range(m - 1, -1, -1):
            if variances[k, j] > 0.0:
                weight = (1.0, 1.0, tilt_factors[k, j, 0], tilt_factors[k, j, 1])
                _absorb(adjoint, L, gains[k, j], steps.parts[j], weight, innovations[k, j], variances[k, j], back)
        for line in range(quantities):
            total, shrink = mean[k, line], beside[k, line, rows - quantities + line]
            for i in range(states):
                total -= beside[k, line, i] * adjoint[i]
                part = 0.0
                for j in range(states):
                    part += L[i, j] * beside[k, line, j]
                shrink -= beside[k, line, i] * part
            smoothed[k, line], spread[k, line] = total, shrink
        if k > 0 or not first:
            _interpolate(steps.F, index[k], F)
            _transpose(adjoint, L, F, steps.column, quantities, half, G, side, moved, new)
            adjoint[:] = moved
            L, new = new, L
    given[:] = L
    return smoothed, spread


@inlined
def _absorb(adjoint, L, gain, which, weight, error, S, back):
    """One measurement along h: adjoint = (1 - h g') adjoint - h e / S, L likewise from both sides, plus h h' / S."""
    states = len(adjoint)
    along, square = 0.0, 0.0
    for i in range(states):
        along += gain[i] * adjoint[i]
        back[i] = 0.0
        for j in range(states):
            back[i] += L[i, j] * gain[j]
    for i in range(states):
        square += back[i] * gain[i]
    for a in range(4):
        adjoint[which[a]] -= weight[a] * (along + error / S)
        for i in range(states):
            L[which[a], i] -= weight[a] * back[i]
            L[i, which[a]] -= weight[a] * back[i]
    for a in range(4):
        for b in range(4):
            L[which[a], which[b]] += weight[a] * weight[b] * (square + 1.0 / S)


@inlined
def _transpose(adjoint, L, F, column, quantities, half, G, side, moved, new):
    """moved = F' adjoint, new = F' L F for the whole transition, L symmetric.

    Of L, the lines move back by one place; what the top's rows F make of them, and of each other, comes to the columns
    of F. `half`, G and `side` are scratch of shapes (rows, columns), (columns, columns) and (columns, states).
    """
    rows, columns = F.shape
    states = len(adjoint)
    first, last = rows - quantities, states - quantities  # of the old states that the lines hold now
    for i in range(states):
        moved[i] = 0.0
        for j in range(states):
            new[i, j] = 0.0
    for i in range(first, last):
        moved[i] = adjoint[i + quantities]
        for j in range(first, last):
            new[i, j] = L[i + quantities, j + quantities]
    for r in range(rows):
        for c in range(columns):
            half[r, c] = 0.0
        for i in range(rows):
            factor = L[r, i]
            for c in range(columns):
                half[r, c] += factor * F[i, c]
    for c in range(columns):
        for i in range(columns):
            G[c, i] = 0.0
        for j in range(first, last):
            side[c, j] = 0.0
    for r in range(rows):
        for c in range(columns):
            factor = F[r, c]
            if factor != 0.0:
                at = column[c]
                moved[at] += factor * adjoint[r]
                for i in range(columns):
                    G[c, i] += factor * half[r, i]
                for j in range(first, last):
                    side[c, j] += factor * L[r, j + quantities]
    for c in range(columns):
        at = column[c]
        for i in range(columns):
            new[at, column[i]] += G[c, i]
        for j in range(first, last):
            new[at, j] += side[c, j]
            new[j, at] += side[c, j]
