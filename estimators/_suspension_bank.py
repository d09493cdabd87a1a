"""Bank of Kalman filters, one for each particle, as one compiled kernel, and the table that their gains come from.

Each filter is the steady one of its particle's parameters: F, G, C, D, K and the innovation's factor are smooth in the
three parameters, so they are computed at Chebyshev points of a box, and interpolated there by polynomials (Trefethen
2013, Approximation Theory and Approximation Practice). A step then costs some 800 multiplications a particle.
"""

from dataclasses import dataclass

import numpy as np

from estimators._half_vehicle import STATES, HalfVehicle
from estimators._suspension_model import Layout, Unknowns, discrete, steady
from railsim.compiled import kernel

POINTS = (4, 5, 8)
"""Chebyshev points along each parameter."""


@dataclass(frozen=True)
class Gains:
    """Packed matrices of filters over a box of parameters.

    Attributes
    ----------
    plan : layout of the state.
    low, high : corners of the box, shape (3,).
    nodes : Chebyshev points in [-1, 1], one array a parameter.
    table : packed matrices at the points, shape (points, length).
    readings : number of readings.
    """

    plan: Layout
    low: np.ndarray
    high: np.ndarray
    nodes: tuple[np.ndarray, ...]
    table: np.ndarray
    readings: int

    def at(self, parameters: np.ndarray) -> np.ndarray:
        """Packed matrices of many parameters (p, 3), interpolated; shape (p, length)."""
        place = 2.0 * (parameters - self.low) / (self.high - self.low) - 1.0
        first, second, third = (lagrange(nodes, place[:, i]) for i, nodes in enumerate(self.nodes))
        weights = np.einsum("pi,pj,pk->pijk", first, second, third).reshape(len(parameters), -1)
        return weights @ self.table


def chebyshev(count: int) -> np.ndarray:
    """Chebyshev points of the first kind in (-1, 1), shape (count,)."""
    return np.cos((2 * np.arange(count) + 1) * np.pi / (2 * count))


def gains(
    vehicle: HalfVehicle,
    speed: float,
    rate: float,
    unknowns: Unknowns,
    plan: Layout,
    low: np.ndarray,
    high: np.ndarray,
    points: tuple[int, int, int] = POINTS,
) -> Gains:
    """Solve the Riccati equation at all points of the box.

    Parameters
    ----------
    low, high : the box, order of `PARAMETERS`, shape (3,).
    points : along each of the three.
    """
    nodes = tuple(chebyshev(count) for count in points)
    grid = np.stack(np.meshgrid(*nodes, indexing="ij"), axis=-1).reshape(-1, 3)
    parameters = low + (high - low) * (grid + 1.0) / 2.0
    table = exact(vehicle, speed, rate, unknowns, plan, parameters)
    return Gains(plan, low, high, nodes, table, len(unknowns.reading))


def exact(
    vehicle: HalfVehicle, speed: float, rate: float, unknowns: Unknowns, plan: Layout, parameters: np.ndarray
) -> np.ndarray:
    """Packed matrices of some parameters (p, 3), each by its own Riccati equation."""
    systems = [discrete(vehicle, one, speed, rate, unknowns, plan) for one in parameters]
    F, G, C, D, Q, R = (np.stack(parts) for parts in zip(*systems, strict=True))
    K, S = steady(F, C, Q, R)
    whitening = np.linalg.inv(np.linalg.cholesky(S))
    n, columns = plan.head, np.concatenate([np.arange(plan.head), plan.columns])
    now, later = np.concatenate([0.0 * G[:, :n], D], axis=1), np.concatenate([G[:, :n], 0.0 * D], axis=1)
    moved = np.concatenate([F[:, :n][:, :, columns], C[:, :, columns]], axis=1)
    parts = [np.swapaxes(part, 1, 2) for part in (moved, now, later, K)]
    return np.concatenate([part.reshape(len(parameters), -1) for part in (*parts, whitening)], axis=1)


def lagrange(nodes: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Values at `place` (p,) of the polynomials that are one at a node and zero at the others, shape (p, nodes)."""
    values = np.ones((len(place), len(nodes)))
    for i, node in enumerate(nodes):
        for other in np.delete(nodes, i):
            values[:, i] *= (place - other) / (node - other)
    return values


@kernel
def run_bank(state, packed, columns, head, length, inputs, means, readings, likelihood, work):
    """Run every filter over a stretch of samples.

    Parameters
    ----------
    state : (p, n), is moved on. packed : (p, length) as `Gains.at` gives. columns : `Layout.columns`.
    head, length : of `Layout`. inputs, means : known track at samples and from each to the next, (t, 6).
    readings : (t, m). likelihood : (p,), the logarithm of the stretch's likelihood is added.
    work : (3, at least n + m and the number of columns of the step), overwritten.
    """
    p, n = state.shape
    m, taps = readings.shape[1], columns.size
    high, wide = head + m, head + taps
    at_K = high * (wide + 12)
    at_L = at_K + n * m
    lines = (n - head) // length if length > 0 else 0
    z, new, error = work[0], work[1], work[2]
    for i in range(p):
        row, x = packed[i], state[i]
        for j in range(m):
            likelihood[i] += readings.shape[0] * np.log(row[at_L + j * m + j])
        for t in range(readings.shape[0]):
            for c in range(taps):
                z[c] = x[columns[c]]
            for r in range(high):
                new[r] = 0.0
            for c in range(head):
                for r in range(high):
                    new[r] += row[c * high + r] * x[c]
            for c in range(taps):
                for r in range(high):
                    new[r] += row[(head + c) * high + r] * z[c]
            for c in range(6):
                for r in range(high):
                    new[r] += row[(wide + c) * high + r] * inputs[t, c]
                for r in range(high):
                    new[r] += row[(wide + 6 + c) * high + r] * means[t, c]
            for j in range(m):
                error[j] = readings[t, j] - new[head + j]
            for j in range(m):
                total = 0.0
                for c in range(j + 1):
                    total += row[at_L + j * m + c] * error[c]
                likelihood[i] -= 0.5 * total * total
            for line in range(lines):
                start = head + line * length
                for r in range(start + length - 1, start, -1):
                    x[r] = x[r - 1]
                x[start] = x[STATES + 2 * line]
            for r in range(head):
                x[r] = new[r]
            for j in range(m):
                for r in range(n):
                    x[r] += row[at_K + j * n + r] * error[j]
