"""Particle filter over the rails' lateral position d and the gauge's deviation g, for a given wheel: its likelihood.

Known: half the difference of the rolling radii D and the lateral position y of the wheelset at equal steps of distance.
Both wheels have one function F of their shift towards their rail, so that with x = y - d

    D = (F(x - g/2) - F(-x - g/2)) / 2 + noise,

one equation for two unknown inputs. d and g are independent processes over distance with known shapes of spectra, each
predicted from its own last positions (`wheel_rail.rail_process`). The rest is 0.1 mm a step, over which F is
a line, whereas what is known of g is as wide as the gauge's whole variation, where F is far from one: so particles
carry the last positions of d and g, and each is moved with the line at its own likeliest place (optimal proposal;
Doucet, Godsill and Andrieu 2000), weights made exact.

The gradient is Fisher's identity, the mean over paths of the complete data's score, with paths traced back by a lag
(Cappe, Moulines and Ryden 2005, sections 8.3 and 10.1).
"""

import numpy as np

from railsim.compiled import allocating, inlined

LAG, EVERY = 60, 20
"""Steps back to which a path is traced before it is read, and steps of one block of the gradient."""
RING = LAG + EVERY
STRIDE = 7919  # so that no particle has the same numbers again soon
FARTHEST = 25.0  # squared errors in variances count no more: a sharp bend that no particle foresees
FIRST = 1e-3  # m: std of the shift at the start
AGAIN, STRAIGHT = 4, 0.3
"""Lines laid for a particle at most, each at the likeliest place of the one before; error over noise that is enough."""


@inlined
def look(table, spacing, u):
    """F and its slope at u, from its values at equal steps about the middle."""
    index = u / spacing + (table.shape[0] - 1) // 2
    i = min(max(int(index), 0), table.shape[0] - 2)
    rise = table[i + 1] - table[i]
    return table[i] + (index - i) * rise, rise / spacing


@inlined
def scatter(row, spacing, u, amount):
    """Add the derivative by the table's values of amount F(u)."""
    index = u / spacing + (row.shape[0] - 3) // 2
    i = min(max(int(index), 0), row.shape[0] - 4)
    row[i] += amount * (1.0 - index + i)
    row[i + 1] += amount * (index - i)


@allocating
def particles(D, y, table, spacing, rail, gauge, noise, normals, uniforms, score, smoothed):
    """Logarithm of the likelihood of D.

    Parameters
    ----------
    D, y : (n,), m. table : F at steps of `spacing` about the middle, m. rail, gauge : `Process` of the steps.
    noise : std of D (m). normals : (rows, particles, 3), used in turn. uniforms : (n,). score : (n // EVERY + 1,
    len(table) + 2) or without rows: gets the gradient of every block by the table's values and the logarithms of the
    two levels. smoothed : (n, 4) likewise: mean of x, g, x^2 and g^2 at places whose paths were traced.
    """
    count, rows, n, order = normals.shape[1], normals.shape[0], D.shape[0], rail.weights.shape[1]
    P, Q = np.zeros((count, 2, order)), np.zeros((count, 2, order))
    w, lw = np.ones(count) / count, np.zeros(count)
    traced = score.shape[0] > 0
    X, G, parent = np.zeros((RING, count)), np.zeros((RING, count)), np.zeros((RING, count), dtype=np.int64)
    by_rail, by_gauge, chosen = np.zeros((RING, count)), np.zeros((RING, count)), np.zeros(count, dtype=np.int64)
    path = np.zeros(count, dtype=np.int64)
    for i in range(count):
        P[i, 0, 0] = y[0] + FIRST * normals[0, i, 0]
        P[i, 1, 0] = gauge.level * np.sqrt(gauge.shares[0]) * normals[0, i, 1]
    total, white = 0.0, noise * noise
    for k in range(1, n):
        drawn, rotation, ring, top = normals[1 + k % (rows - 1)], (k * STRIDE) % count, k % RING, -np.inf
        known = min(k, order)
        by_d, by_e = rail.weights[known], gauge.weights[known]
        rail_variance, gauge_variance = rail.level**2 * rail.shares[known], gauge.level**2 * gauge.shares[known]
        for i in range(count):
            d, e = 0.0, 0.0
            for m in range(known):
                d += by_d[m] * P[i, 0, m]
                e += by_e[m] * P[i, 1, m]
            md, mg = 0.0, 0.0
            by_x, by_g, error, S = 0.0, 0.0, 0.0, white
            for again in range(AGAIN):
                left, slope = look(table, spacing, y[k] - d - md - 0.5 * (e + mg))
                right, other = look(table, spacing, d + md - y[k] - 0.5 * (e + mg))
                real = D[k] - 0.5 * (left - right)
                if again > 0 and abs(real - error * white / S) < STRAIGHT * noise:
                    break
                by_x, by_g = 0.5 * (slope + other), 0.25 * (other - slope)
                S = by_x * by_x * rail_variance + by_g * by_g * gauge_variance + white
                error = real - by_x * md + by_g * mg
                md, mg = -rail_variance * by_x * error / S, gauge_variance * by_g * error / S
            z = drawn[(i + rotation) % count]
            nd, ng = np.sqrt(rail_variance) * z[0], np.sqrt(gauge_variance) * z[1]
            gain = (error + by_x * nd - by_g * ng - noise * z[2]) / S
            md, mg = nd - rail_variance * by_x * gain, ng + gauge_variance * by_g * gain
            for m in range(order - 1, 0, -1):
                Q[i, 0, m], Q[i, 1, m] = P[i, 0, m - 1], P[i, 1, m - 1]
            Q[i, 0, 0], Q[i, 1, 0] = d + md, e + mg
            x, u = y[k] - Q[i, 0, 0], 0.5 * Q[i, 1, 0]
            left, slope = look(table, spacing, x - u)
            right, other = look(table, spacing, -x - u)
            real, line = D[k] - 0.5 * (left - right), error + by_x * md - by_g * mg
            worse = min(max((real * real - line * line) / white, -FARTHEST), FARTHEST)
            lw[i] = -0.5 * (min(error * error / S, FARTHEST) + np.log(S) + worse)
            top = max(top, lw[i])
            if traced:
                X[ring, i], G[ring, i] = x, Q[i, 1, 0]
                by_rail[ring, i] = md * md / rail_variance - 1.0
                by_gauge[ring, i] = mg * mg / gauge_variance - 1.0
        all_, squares = 0.0, 0.0
        for i in range(count):
            w[i] *= np.exp(lw[i] - top)
            all_ += w[i]
        for i in range(count):
            w[i] /= all_
            squares += w[i] * w[i]
        total += top + np.log(all_)
        resample(P, Q, w, chosen, uniforms[k], squares * count > 2.0)
        if traced:
            for i in range(count):
                parent[ring, i] = chosen[i]
            if k % EVERY == 0 and k > LAG:
                trace(
                    k, D, w, path, X, G, by_rail, by_gauge, parent, table, spacing, white, score[k // EVERY], smoothed
                )
    return total


@inlined
def resample(P, Q, w, parent, uniform, needed):
    """Take Q over into P, systematically by the weights where that is needed; `parent` gets the indices."""
    count, order, j, reached = w.shape[0], P.shape[2], 0, w[0]
    for i in range(count):
        if needed:
            while reached < (uniform + i) / count and j < count - 1:
                j += 1
                reached += w[j]
        else:
            j = i
        parent[i] = j
        for m in range(order):
            P[i, 0, m], P[i, 1, m] = Q[j, 0, m], Q[j, 1, m]
    if needed:
        for i in range(count):
            w[i] = 1.0 / count


@inlined
def trace(k, D, w, path, X, G, by_rail, by_gauge, parent, table, spacing, white, row, smoothed):
    """Add the score of the block that ends `LAG - EVERY` steps before k to its row, and what the paths are there.

    path : scratch.
    """
    count = w.shape[0]
    for i in range(count):
        path[i] = i
    for ago in range(LAG):
        m = k - ago
        ring = m % RING
        for i in range(count):
            j = parent[ring, path[i]]
            path[i] = j
            if ago >= LAG - EVERY:
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
