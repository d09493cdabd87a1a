"""Particle filter over the rails' lateral position d and the gauge's deviation g, for a given wheel: its likelihood.

Known: half the difference of the rolling radii D and the lateral position y of the wheelset at equal steps of distance.
Both wheels have one function F of their shift towards their rail, so that with x = y - d

    D = (F(x - g/2) - F(-x - g/2)) / 2 + noise,

one equation for two unknown inputs. d and g are independent processes over distance with spectra
q^2 / ((W^2 + a^2)(W^2 + b^2)): p' = -a p + p2, p2' = -b p2 + white noise. In one step they change by 0.1 mm, over which
F is a line, whereas what is known of g is as wide as the gauge's whole variation, where F is far from one: so particles
carry (d, d2, g, g2), and each is moved with the line at its own place (optimal proposal; Doucet, Godsill and Andrieu
2000), weights made exact.

The gradient is Fisher's identity, the mean over paths of the complete data's score, with paths traced back by a lag
(Cappe, Moulines and Ryden 2005, sections 8.3 and 10.1).
"""

from typing import NamedTuple

import numpy as np

from railsim.compiled import allocating, inlined

LAG, EVERY = 60, 20
"""Steps back to which a path is traced before it is read, and steps of one block of the gradient."""
RING = LAG + EVERY
D_, D2, G_, G2 = range(4)
STRIDE = 7919  # so that no particle has the same numbers again soon
FARTHEST = 25.0  # squared errors in variances count no more: a sharp bend that no particle foresees
FIRST = 1e-3  # m: std of the shift at the start


class Process(NamedTuple):
    """Corners (rad/m) and level of the driving noise."""

    slow: float
    fast: float
    level: float


class Step(NamedTuple):
    """Of a process over one step: three entries of its transition, then its noise.

    variance : of the position. slope : of the second state by it. rest : standard deviation of what is left of that.
    """

    stay: float
    cross: float
    fast: float
    variance: float
    slope: float
    rest: float


@inlined
def over(process, length):
    """`Step` of a process over a length in m."""
    stay, fast = np.exp(-process.slow * length), np.exp(-process.fast * length)
    drive = process.level**2 * (1.0 - fast * fast) / (2.0 * process.fast)
    variance, both = drive * length * length / 3.0, 0.5 * drive * length
    slope = both / variance
    rest = np.sqrt(max(drive - both * slope, 0.0))
    return Step(stay, (stay - fast) / (process.fast - process.slow), fast, variance, slope, rest)


@inlined
def look(table, spacing, u):
    """F and its slope at u, from its values at equal steps about the middle."""
    place = u / spacing + (table.shape[0] - 1) // 2
    i = min(max(int(place), 0), table.shape[0] - 2)
    rise = table[i + 1] - table[i]
    return table[i] + (place - i) * rise, rise / spacing


@inlined
def scatter(row, spacing, u, amount):
    """Add the derivative by the table's values of amount F(u)."""
    place = u / spacing + (row.shape[0] - 3) // 2
    i = min(max(int(place), 0), row.shape[0] - 4)
    row[i] += amount * (1.0 - place + i)
    row[i + 1] += amount * (place - i)


@allocating
def particles(D, y, length, table, spacing, rail, gauge, noise, normals, uniforms, score, smoothed):
    """Logarithm of the likelihood of D.

    Parameters
    ----------
    D, y : (n,), m. length : of a step, m. table : F at steps of `spacing` about the middle, m. rail, gauge : `Process`.
    noise : std of D (m). normals : (rows, particles, 5), used in turn. uniforms : (n,). score : (n // EVERY + 1,
    len(table) + 2) or without rows: gets the gradient of every block by the table's values and the logarithms of the
    two levels. smoothed : (n, 4) likewise: mean of x, g, x^2 and g^2 at places whose paths were traced.
    """
    count, rows, n = normals.shape[1], normals.shape[0], D.shape[0]
    P, Q = np.zeros((count, 4)), np.zeros((count, 4))
    w, lw = np.ones(count) / count, np.zeros(count)
    traced = score.shape[0] > 0
    X, G, parent = np.zeros((RING, count)), np.zeros((RING, count)), np.zeros((RING, count), dtype=np.int64)
    by_rail, by_gauge, one = np.zeros((RING, count)), np.zeros((RING, count)), np.zeros(count, dtype=np.int64)
    place = np.zeros(count, dtype=np.int64)
    r, g = over(rail, length), over(gauge, length)
    spread2 = gauge.level / np.sqrt(2.0 * gauge.fast)
    spread = spread2 / np.sqrt(gauge.slow * (gauge.slow + gauge.fast))
    along = rail.level / np.sqrt(2.0 * rail.fast)
    for i in range(count):
        P[i, D_], P[i, D2] = y[0] + FIRST * normals[0, i, 0], along * normals[0, i, 1]
        P[i, G_], P[i, G2] = spread * normals[0, i, 2], spread2 * normals[0, i, 3]
    total, white = 0.0, noise * noise
    for k in range(1, n):
        drawn, turn, ring, top = normals[1 + k % (rows - 1)], (k * STRIDE) % count, k % RING, -np.inf
        for i in range(count):
            d, d2 = r.stay * P[i, D_] + r.cross * P[i, D2], r.fast * P[i, D2]
            e, e2 = g.stay * P[i, G_] + g.cross * P[i, G2], g.fast * P[i, G2]
            x = y[k] - d
            left, slope = look(table, spacing, x - 0.5 * e)
            right, other = look(table, spacing, -x - 0.5 * e)
            by_x, by_g = 0.5 * (slope + other), 0.25 * (other - slope)
            S = by_x * by_x * r.variance + by_g * by_g * g.variance + white
            error = D[k] - 0.5 * (left - right)
            z = drawn[(i + turn) % count]
            nd, ng = np.sqrt(r.variance) * z[0], np.sqrt(g.variance) * z[2]
            gain = (error + by_x * nd - by_g * ng - noise * z[4]) / S
            md, mg = nd - r.variance * by_x * gain, ng + g.variance * by_g * gain
            md2 = r.slope * md + r.rest * z[1]
            mg2 = g.slope * mg + g.rest * z[3]
            Q[i, D_], Q[i, D2], Q[i, G_], Q[i, G2] = d + md, d2 + md2, e + mg, e2 + mg2
            x, u = y[k] - Q[i, D_], 0.5 * Q[i, G_]
            left, slope = look(table, spacing, x - u)
            right, other = look(table, spacing, -x - u)
            real, line = D[k] - 0.5 * (left - right), error + by_x * md - by_g * mg
            worse = min(max((real * real - line * line) / white, -FARTHEST), FARTHEST)
            lw[i] = -0.5 * (min(error * error / S, FARTHEST) + np.log(S) + worse)
            top = max(top, lw[i])
            if traced:
                X[ring, i], G[ring, i] = x, Q[i, G_]
                by_rail[ring, i] = md * md / r.variance + z[1] * z[1] - 2.0
                by_gauge[ring, i] = mg * mg / g.variance + z[3] * z[3] - 2.0
        all_, squares = 0.0, 0.0
        for i in range(count):
            w[i] *= np.exp(lw[i] - top)
            all_ += w[i]
        for i in range(count):
            w[i] /= all_
            squares += w[i] * w[i]
        total += top + np.log(all_)
        resample(P, Q, w, one, uniforms[k], squares * count > 2.0)
        if traced:
            for i in range(count):
                parent[ring, i] = one[i]
            if k % EVERY == 0 and k > LAG:
                trace(
                    k, D, w, place, X, G, by_rail, by_gauge, parent, table, spacing, white, score[k // EVERY], smoothed
                )
    return total


@inlined
def resample(P, Q, w, parent, uniform, needed):
    """Take Q over into P, systematically by the weights where that is needed; `parent` gets the places."""
    count, j, reached = w.shape[0], 0, w[0]
    for i in range(count):
        if needed:
            while reached < (uniform + i) / count and j < count - 1:
                j += 1
                reached += w[j]
        else:
            j = i
        parent[i] = j
        for m in range(4):
            P[i, m] = Q[j, m]
    if needed:
        for i in range(count):
            w[i] = 1.0 / count


@inlined
def trace(k, D, w, place, X, G, by_rail, by_gauge, parent, table, spacing, white, row, smoothed):
    """Add the score of the block that ends `LAG - EVERY` steps before k to its row, and what the paths are there.

    place : scratch.
    """
    count = w.shape[0]
    for i in range(count):
        place[i] = i
    for back in range(LAG):
        m = k - back
        ring = m % RING
        for i in range(count):
            j = parent[ring, place[i]]
            place[i] = j
            if back >= LAG - EVERY:
                x, g = X[ring, j], G[ring, j]
                error = D[m] - 0.5 * (look(table, spacing, x - 0.5 * g)[0] - look(table, spacing, -x - 0.5 * g)[0])
                amount = 0.5 * w[i] * error / white
                scatter(row, spacing, x - 0.5 * g, amount)
                scatter(row, spacing, -x - 0.5 * g, -amount)
                row[-2] += w[i] * by_rail[ring, j]
                row[-1] += w[i] * by_gauge[ring, j]
                smoothed[m, 0] += w[i] * x
                smoothed[m, 1] += w[i] * g
                smoothed[m, 2] += w[i] * x * x
                smoothed[m, 3] += w[i] * g * g
