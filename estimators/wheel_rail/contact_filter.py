"""Extended Kalman filter of the single wheelset: motion, track under it and conicity together (compiled).

States: y, y', psi, psi', y_m, y_m', d, d', n (dynamic), then parameters that move by random walks: the logarithm of
the conicity at the nodes of a table over x = y - d (one node: a constant), biases of the sensors, and the slope of the
roll. The half difference of the rolling radii is D = lambda(x) (x + n) with lambda interpolated between the nodes, so
that with more than one node d(lambda)/dt = (d lambda / dy) x' holds by itself: equation (2) of Ward et al. (2011).
The noise n of first order over distance stands for what the gauge does to the radii; without it the filter takes
conicities that are too large, because a large one keeps that noise out of the track.

The track is a process of second order over distance, as the spectra of ERRI B176 have it (poles at Wr and Wc), so
d'' is driven by white noise. Steps are linearly implicit (trapezoidal with the Jacobian), because creep's time constant
m V / (2 f22) is shorter than a sample. Measurements are taken one by one.
"""

import math
from typing import NamedTuple

import numpy as np

from estimators.filters.kalman import correct, project
from railsim.compiled import inlined, kernel
from railsim.constants import GRAVITY

DYNAMIC = 9
TRACK, TRACK_RATE, GAUGE = 6, 7, 8
BIASES = 5
CHANNELS = 5
LATERAL, MASS, YAW_GYRO, APART, ROLL_GYRO = range(CHANNELS)
"""Order of measured channels: accelerations of wheelset and mass, yaw rate, mass less wheelset, roll rate."""
FORGETTING_TIME = 4.0
"""Time constant over which the effective conicity of a table is formed, s."""
GATE = 9.0
"""Squared innovation over its variance beyond which a value is trusted less, so that it counts as if it were this."""
WIDTH = DYNAMIC + 3
"""Columns that a step solves for: transition, two nodes of the table, the motion."""
LOWEST, HIGHEST = math.log(0.002), math.log(1.5)
"""Logarithms of the conicity stay between these."""


class Settings(NamedTuple):
    """What the kernel reads besides the filter's memory.

    speeds : (s,) m/s, uniform. tables : (s, 24) coefficients at these speeds: y'', psi'' by x, by x', by D; rows y'',
    psi'', y_m'' by the six states. They are interpolated at the speed of each step.
    step : s. poles : (3,) rad/m of the track (two) and of n. drive : (2,) variances of d and of n (m2).
    noise : (2,) standard deviation of what the model lacks of y'' and psi'', in a step.
    nodes : (k,) shifts of the table, m. walks : variance per second of the parameters, (parameters,).
    roll : 1 / l, with which the roll's slope makes roll of x.
    readings : (CHANNELS,) variances, infinity where a channel is not used.
    """

    speeds: np.ndarray
    tables: np.ndarray
    step: float
    poles: np.ndarray
    drive: np.ndarray
    noise: np.ndarray
    nodes: np.ndarray
    walks: np.ndarray
    roll: float
    readings: np.ndarray


class Memory(NamedTuple):
    """Mean (n,), covariance (n, n), and what a step works with."""

    mean: np.ndarray
    covariance: np.ndarray
    matrix: np.ndarray  # (DYNAMIC, DYNAMIC + WIDTH)
    jacobian: np.ndarray  # (DYNAMIC, DYNAMIC)
    transition: np.ndarray  # (DYNAMIC, n)
    moved: np.ndarray  # (DYNAMIC, n)
    row: np.ndarray  # (n,)
    gain: np.ndarray  # (n,)
    motion: np.ndarray  # (DYNAMIC,)
    now: np.ndarray  # (24,) coefficients at the present speed
    lookup: np.ndarray  # (7,) lambda, its slope, the weights' index and share; sums for the effective conicity


@kernel
def at_speed(settings, speed, now):
    """Interpolate the equations' coefficients."""
    speeds = settings.speeds
    last = len(speeds) - 2
    spacing = speeds[1] - speeds[0]
    cell = min(max(int((speed - speeds[0]) / spacing), 0), last)
    share = min(max((speed - speeds[cell]) / spacing, 0.0), 1.0)
    for k in range(len(now)):
        now[k] = settings.tables[cell, k] + share * (settings.tables[cell + 1, k] - settings.tables[cell, k])


@kernel
def look_up(settings, memory, x):
    """Conicity at x, its slope, the cell and the share of its right node; into `memory.lookup`."""
    nodes, mean, lookup = settings.nodes, memory.mean, memory.lookup
    count = len(nodes)
    if count == 1:
        lookup[0], lookup[1], lookup[2], lookup[3] = math.exp(mean[DYNAMIC]), 0.0, 0.0, 0.0
        return
    spacing = nodes[1] - nodes[0]
    cell = min(max(int((x - nodes[0]) / spacing), 0), count - 2)
    share = min(max((x - nodes[cell]) / spacing, 0.0), 1.0)
    left, right = mean[DYNAMIC + cell], mean[DYNAMIC + cell + 1]
    inside = nodes[0] < x < nodes[count - 1]
    lookup[0] = math.exp(left + share * (right - left))
    lookup[1] = lookup[0] * (right - left) / spacing if inside else 0.0
    lookup[2], lookup[3] = cell, share


@kernel
def motion(settings, memory, speed):
    """Time derivative of the dynamic states and its Jacobian."""
    m, f, a, c = memory.mean, memory.motion, memory.jacobian, memory.now
    x, x_rate = m[0] - m[TRACK], m[1] - m[TRACK_RATE]
    look_up(settings, memory, x)
    conicity, slope = memory.lookup[0], memory.lookup[1]
    shift = x + m[GAUGE]
    a[:] = 0.0
    a[0, 1] = a[2, 3] = a[4, 5] = a[TRACK, TRACK_RATE] = 1.0
    for k in range(3):
        for j in range(6):
            a[2 * k + 1, j] = c[6 + 6 * k + j]
    for k in range(2):
        row = 2 * k + 1
        by_shift = c[k] + c[4 + k] * (conicity + slope * shift)
        a[row, GAUGE] = c[4 + k] * conicity
        a[row, 0] += by_shift
        a[row, TRACK] -= by_shift
        a[row, 1] += c[2 + k]
        a[row, TRACK_RATE] -= c[2 + k]
    low, high = settings.poles[0] * speed, settings.poles[1] * speed
    a[TRACK_RATE, TRACK], a[TRACK_RATE, TRACK_RATE] = -low * high, -(low + high)
    a[GAUGE, GAUGE] = -settings.poles[2] * speed
    f[GAUGE] = a[GAUGE, GAUGE] * m[GAUGE]
    f[0], f[2], f[4], f[TRACK] = m[1], m[3], m[5], m[TRACK_RATE]
    for k in range(3):
        total = 0.0
        for j in range(6):
            total += c[6 + 6 * k + j] * m[j]
        f[2 * k + 1] = total
    for k in range(2):
        f[2 * k + 1] += c[k] * x + c[2 + k] * x_rate + c[4 + k] * conicity * shift
    f[TRACK_RATE] = a[TRACK_RATE, TRACK] * m[TRACK] + a[TRACK_RATE, TRACK_RATE] * m[TRACK_RATE]


@kernel
def solve(matrix):
    """Gauss-Jordan elimination with pivots on the left square; the solution replaces the right columns."""
    n, width = matrix.shape
    for i in range(n):
        best = i
        for r in range(i + 1, n):
            if abs(matrix[r, i]) > abs(matrix[best, i]):
                best = r
        if best != i:
            for j in range(i, width):
                matrix[i, j], matrix[best, j] = matrix[best, j], matrix[i, j]
        scale = 1.0 / matrix[i, i]
        for j in range(i, width):
            matrix[i, j] *= scale
        for r in range(n):
            factor = matrix[r, i]
            if r != i and factor != 0.0:
                for j in range(i, width):
                    matrix[r, j] -= factor * matrix[i, j]


@kernel
def by_nodes(memory, k):
    """Change of y'' (k = 0) or psi'' (k = 1) by the left and the right node of the cell that x is in."""
    share, m = memory.lookup[3], memory.mean
    whole = memory.now[4 + k] * memory.lookup[0] * (m[0] - m[TRACK] + m[GAUGE])
    return whole * (1.0 - share), whole * share


@kernel
def predict(settings, memory, speed):
    """One step in time: mean and covariance."""
    at_speed(settings, speed, memory.now)
    motion(settings, memory, speed)
    h, size, m, a = settings.step, len(memory.mean), memory.mean, memory.jacobian
    b = memory.matrix
    for i in range(DYNAMIC):
        for j in range(DYNAMIC):
            unit = 1.0 if i == j else 0.0
            b[i, j] = unit - 0.5 * h * a[i, j]
            b[i, DYNAMIC + j] = unit + 0.5 * h * a[i, j]
        b[i, 2 * DYNAMIC] = b[i, 2 * DYNAMIC + 1] = 0.0
        b[i, 2 * DYNAMIC + 2] = h * memory.motion[i]
    for k in range(2):
        left, right = by_nodes(memory, k)
        b[2 * k + 1, 2 * DYNAMIC], b[2 * k + 1, 2 * DYNAMIC + 1] = h * left, h * right
    solve(b)
    t = memory.transition
    t[:] = 0.0
    cell = int(memory.lookup[2])
    for i in range(DYNAMIC):
        for j in range(DYNAMIC):
            t[i, j] = b[i, DYNAMIC + j]
        t[i, DYNAMIC + cell] += b[i, 2 * DYNAMIC]
        if len(settings.nodes) > 1:
            t[i, DYNAMIC + cell + 1] += b[i, 2 * DYNAMIC + 1]
        m[i] += b[i, 2 * DYNAMIC + 2]
    _spread(settings, memory, speed, size, cell)


@inlined
def _row_times(row, values, first, last):
    """Product of a row of the transition, zero but for the dynamic states and `first` to `last`, with a vector."""
    total = 0.0
    for k in range(DYNAMIC):
        total += row[k] * values[k]
    for k in range(first, last):
        total += row[k] * values[k]
    return total


@kernel
def _spread(settings, memory, speed, size, cell):
    """Covariance: only the dynamic rows move; parameters gain the variance of their walks."""
    p, t, moved, h = memory.covariance, memory.transition, memory.moved, settings.step
    first, last = DYNAMIC + cell, DYNAMIC + cell + min(2, len(settings.nodes))
    for i in range(DYNAMIC):
        for j in range(size):
            moved[i, j] = _row_times(t[i], p[:, j], first, last)
    for i in range(DYNAMIC):
        for j in range(DYNAMIC):
            p[i, j] = _row_times(t[j], moved[i], first, last)
        for j in range(DYNAMIC, size):
            p[i, j] = p[j, i] = moved[i, j]
    low, high = settings.poles[0] * speed, settings.poles[1] * speed
    p[1, 1] += (settings.noise[0] * h) ** 2
    p[3, 3] += (settings.noise[1] * h) ** 2
    p[TRACK_RATE, TRACK_RATE] += 2.0 * low * high * (low + high) * settings.drive[0] * h
    p[GAUGE, GAUGE] += 2.0 * settings.poles[2] * speed * settings.drive[1] * h
    for j in range(len(settings.walks)):
        p[DYNAMIC + j, DYNAMIC + j] += settings.walks[j] * h


@kernel
def expected(settings, memory, channel, speed):
    """What a channel should show; its derivatives into `memory.row`."""
    m, row, nodes = memory.mean, memory.row, len(settings.nodes)
    row[:] = 0.0
    bias = DYNAMIC + nodes
    row[bias + channel] = 1.0
    value = m[bias + channel]
    slope = bias + BIASES
    if channel == LATERAL:
        motion(settings, memory, speed)
        x = m[0] - m[TRACK]
        for j in range(DYNAMIC):
            row[j] = memory.jacobian[1, j]
        left, right = by_nodes(memory, 0)
        cell = DYNAMIC + int(memory.lookup[2])
        row[cell] += left
        if nodes > 1:
            row[cell + 1] += right
        tilt = GRAVITY * m[slope] * settings.roll
        row[0] += tilt
        row[TRACK] -= tilt
        return value + memory.motion[1] + tilt * x
    if channel == MASS:
        for j in range(6):
            row[j] = memory.now[18 + j]
            value += row[j] * m[j]
        return value
    if channel == YAW_GYRO:
        row[3] = 1.0
        return value + m[3]
    if channel == APART:
        row[4], row[0] = 1.0, -1.0
        return value + m[4] - m[0]
    rate = m[1] - m[TRACK_RATE]
    row[1] = m[slope] * settings.roll
    row[TRACK_RATE] = -row[1]
    row[slope] = rate * settings.roll
    return value + row[1] * rate


@kernel
def update(settings, memory, channel, measured, speed):
    """Take one measured value; returns the squared innovation over its variance."""
    p, gain = memory.covariance, memory.gain
    residual = measured - expected(settings, memory, channel, speed)
    variance = project(p, memory.row, gain) + settings.readings[channel]
    surprise = residual * residual / variance
    correct(memory.mean, p, gain, variance * max(1.0, surprise / GATE), residual)
    for k in range(len(settings.nodes)):
        memory.mean[DYNAMIC + k] = min(max(memory.mean[DYNAMIC + k], LOWEST), HIGHEST)
    return surprise


@kernel
def advance(settings, memory, speeds, samples, out):
    """Filter samples (n, CHANNELS), NaN where lost, at `speeds` (n,); each row of `out` (n, 3 + 3 + 1): conicity, d, x,
    their standard deviations, mean squared innovation over variance.
    """
    p, m = memory.covariance, memory.mean
    for i in range(len(samples)):
        predict(settings, memory, speeds[i])
        total, count = 0.0, 0
        for channel in range(CHANNELS):
            if samples[i, channel] == samples[i, channel] and settings.readings[channel] < np.inf:
                total += update(settings, memory, channel, samples[i, channel], speeds[i])
                count += 1
        look_up(settings, memory, m[0] - m[TRACK])
        _effective(settings, memory, out[i])
        out[i, 1], out[i, 2] = m[TRACK], m[0] - m[TRACK]
        out[i, 4] = max(p[TRACK, TRACK], 0.0) ** 0.5
        out[i, 5] = max(p[0, 0] - 2.0 * p[0, TRACK] + p[TRACK, TRACK], 0.0) ** 0.5
        out[i, 6] = total / count if count else np.nan


@kernel
def _effective(settings, memory, row):
    """Conicity of the cone that fits the table best over the last seconds; its deviation, errors of nodes in step."""
    p, lookup = memory.covariance, memory.lookup
    cell, share = DYNAMIC + int(lookup[2]), lookup[3]
    variance = p[cell, cell]
    if share > 0.0:
        variance = (1.0 - share) ** 2 * p[cell, cell] + share**2 * p[cell + 1, cell + 1]
        variance += 2.0 * share * (1.0 - share) * p[cell, cell + 1]
    spread = lookup[0] * max(variance, 0.0) ** 0.5
    row[0], row[3] = lookup[0], spread
    if len(settings.nodes) > 1:
        forgetting_factor = math.exp(-settings.step / FORGETTING_TIME)
        square = (memory.mean[0] - memory.mean[TRACK]) ** 2 + 1e-10
        lookup[4] = forgetting_factor * lookup[4] + square
        lookup[5] = forgetting_factor * lookup[5] + square * lookup[0]
        lookup[6] = forgetting_factor * lookup[6] + square * spread
        row[0], row[3] = lookup[5] / lookup[4], lookup[6] / lookup[4]
