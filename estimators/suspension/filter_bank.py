"""Bank of Kalman filters, one for each particle, as one compiled kernel, and the table that their gains come from.

Each filter is the steady one of its particle's parameters: F, G, C, D, K and the innovation's factor are smooth in the
three parameters, so they are computed at Chebyshev points of a box, and interpolated there by polynomials (Trefethen
2013, Approximation Theory and Approximation Practice). A step then costs some 800 multiplications a particle.
"""

from dataclasses import dataclass

import numpy as np

from estimators.suspension.discrete_model import Layout, Unknowns, discrete, steady
from estimators.vehicle.affine import STATES, HalfVehicle
from railsim.compiled import kernel

UNROLLED = 8  # columns that the kernel takes at once; its matrices are filled up to a multiple
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
        """Packed matrices of many parameters (p, 3), interpolated; shape (p, length).

        A parameter whose box has no width is the same everywhere.
        """
        width = self.high - self.low
        points = np.where(width > 0.0, 2.0 * (parameters - self.low) / np.where(width > 0.0, width, 1.0) - 1.0, 0.0)
        first, second, third = (lagrange(nodes, points[:, i]) for i, nodes in enumerate(self.nodes))
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
    known, head, columns = D.shape[2], plan.head, plan.columns
    M = np.zeros((len(parameters), head + len(columns) + 2 * known, STATES + C.shape[1]))
    for rows, part in ((slice(0, STATES), F[:, :STATES]), (slice(STATES, STATES + C.shape[1]), C)):
        M[:, :head, rows] = np.swapaxes(part[:, :, :head], 1, 2)
        M[:, head : head + len(columns), rows] = np.swapaxes(part[:, :, columns], 1, 2)
    first = head + len(columns)
    M[:, first : first + 2 * known, :STATES] = np.swapaxes(G[:, :STATES], 1, 2)
    M[:, first : first + known, STATES : STATES + C.shape[1]] = np.swapaxes(D, 1, 2)
    parts = (M, np.swapaxes(K, 1, 2), whitening)
    return np.concatenate([part.reshape(len(parameters), -1) for part in parts], axis=1)


def sizes(plan: Layout, known: int, readings: int) -> tuple[int, int]:
    """Rows and columns of a packed step: vehicle and readings, by all they depend on, filled up for the kernel."""
    return _filled(STATES + readings), _filled(plan.head + len(plan.columns) + 2 * known)


def _filled(count: int) -> int:
    return (count + UNROLLED - 1) // UNROLLED * UNROLLED


def lagrange(nodes: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Values at `points` (p,) of the polynomials that are one at a node and zero at the others, shape (p, nodes)."""
    others = ~np.eye(len(nodes), dtype=bool)
    below = np.where(others, nodes[:, None] - nodes, 1.0).prod(axis=1)
    return np.where(others, (points[:, None] - nodes)[:, None, :], 1.0).prod(axis=2) / below


def unpacked(packed: np.ndarray, plan: Layout, known: int, readings: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What `run_filters` takes of packed matrices (p, length).

    Steps (p, wide / 8, 8, tall); K (p, m / 8, 8, n), filled up with zeros; L (p, m, m). Each is in one piece: of an
    array with gaps the compiler makes a kernel without vector instructions, which takes twice as long.
    """
    tall, wide = sizes(plan, known, readings)
    p, rows, used = len(packed), STATES + readings, plan.head + len(plan.columns) + 2 * known
    at_K = rows * used
    at_L = at_K + plan.size * readings
    step, gain, whitening = packed[:, :at_K], packed[:, at_K:at_L], packed[:, at_L:]
    steps = np.zeros((p, wide, tall))
    steps[:, :used, :rows] = step.reshape(p, used, rows)
    filled = np.zeros((p, _filled(readings), plan.size))
    filled[:, :readings] = gain.reshape(p, readings, plan.size)
    return (
        steps.reshape(p, wide // UNROLLED, UNROLLED, tall),
        filled.reshape(p, -1, UNROLLED, plan.size),
        np.ascontiguousarray(whitening).reshape(p, readings, readings),
    )


@kernel
def run_filters(
    state, step, gain, whitening, columns, sources, length, shaped, inputs, later, readings, likelihood, work
):
    """Run every filter over a stretch of samples.

    Parameters
    ----------
    state : (p, n), is moved on. step, gain, whitening : of `unpacked`. columns, sources, length : of `Layout`.
    shaped : transition of the shaped noise, the same for all, (head - 18, head - 18).
    inputs, later : known track at samples and a sample later, (t, k). readings : (t, m).
    likelihood : (p,), the logarithm of the stretch's likelihood is added.
    work : (3, at least the rows and columns of a packed step), overwritten.

    Notes
    -----
    Indices are loop counters or constants: with others the compiler must look out for negative ones in every turn,
    and does not use vector instructions.
    """
    p, n = state.shape
    m, known, noises = readings.shape[1], inputs.shape[1], shaped.shape[0]
    head, parts, tall = STATES + noises, step.shape[1], step.shape[3]
    first = head + columns.size
    z, new, error = work[0], work[1], work[2]
    for c in range(first + 2 * known, UNROLLED * parts):
        z[c] = 0.0
    for j in range(m, UNROLLED * gain.shape[1]):
        error[j] = 0.0
    for i in range(p):
        M, K, L, x = step[i], gain[i], whitening[i], state[i]
        noise = x[STATES:head]
        for j in range(m):
            likelihood[i] += readings.shape[0] * np.log(L[j, j])
        for t in range(readings.shape[0]):
            for c in range(head):
                z[c] = x[c]
            for c in range(columns.size):
                z[head + c] = x[columns[c]]
            for c in range(known):
                z[first + c] = inputs[t, c]
                z[first + known + c] = later[t, c]
            for r in range(tall):
                new[r] = 0.0
            for c in range(parts):
                z0, z1, z2, z3 = z[8 * c], z[8 * c + 1], z[8 * c + 2], z[8 * c + 3]
                z4, z5, z6, z7 = z[8 * c + 4], z[8 * c + 5], z[8 * c + 6], z[8 * c + 7]
                N = M[c]
                for r in range(tall):
                    new[r] += (
                        N[0, r] * z0
                        + N[1, r] * z1
                        + N[2, r] * z2
                        + N[3, r] * z3
                        + N[4, r] * z4
                        + N[5, r] * z5
                        + N[6, r] * z6
                        + N[7, r] * z7
                    )
            for line in range(sources.size):
                start = head + line * length
                for r in range(start + length - 1, start, -1):
                    x[r] = x[r - 1]
                x[start] = x[sources[line]]
            for r in range(STATES):
                x[r] = new[r]
            for r in range(noises):
                total = 0.0
                for c in range(noises):
                    total += shaped[r, c] * z[STATES + c]
                noise[r] = total
            for j in range(m):
                error[j] = readings[t, j] - new[STATES + j]
            for j in range(m):
                total = 0.0
                for c in range(j + 1):
                    total += L[j, c] * error[c]
                likelihood[i] -= 0.5 * total * total
            for c in range(K.shape[0]):
                e0, e1, e2, e3 = error[8 * c], error[8 * c + 1], error[8 * c + 2], error[8 * c + 3]
                e4, e5, e6, e7 = error[8 * c + 4], error[8 * c + 5], error[8 * c + 6], error[8 * c + 7]
                N = K[c]
                for r in range(n):
                    x[r] += (
                        N[0, r] * e0
                        + N[1, r] * e1
                        + N[2, r] * e2
                        + N[3, r] * e3
                        + N[4, r] * e4
                        + N[5, r] * e5
                        + N[6, r] * e6
                        + N[7, r] * e7
                    )
