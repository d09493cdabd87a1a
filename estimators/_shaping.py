"""Track irregularity as shaped white noise over distance, and the transitions of a vehicle that runs over it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import expm, solve_continuous_lyapunov

from estimators._planes import System
from estimators._smoother import Steps

SPEED_STEP = 0.01  # relative distance of the speeds in the tables; between them transitions are interpolated
EXACT_STEP = 0.06  # the same of those whose matrix exponential is computed; splines in between
SPLINE_LEAST = 12  # speeds in the table below which all are computed
CORNERS = (0.0206, 0.8246)  # rad/m: shape of the spectra of ERRI B176 (1989)
SHORT = 0.438  # rad/m: ERRI's third corner, of cross level


@dataclass(frozen=True)
class Prior:
    """One-sided density level W^(2 zeros) / product of (W^2 + corner^2) over the wavenumber W, m^2/(rad/m)."""

    level: float
    corners: tuple[float, ...] = CORNERS
    zeros: int = 0

    def density(self, wavenumber: np.ndarray) -> np.ndarray:
        """S(W), m^2/(rad/m)."""
        w = np.asarray(wavenumber, dtype=float)
        shape = self.level * w ** (2 * self.zeros)
        for corner in self.corners:
            shape = shape / (w**2 + corner**2)
        return shape

    def scaled(self, level: float) -> "Prior":
        """The same shape at another level."""
        return replace(self, level=level)

    @property
    def matrix(self) -> np.ndarray:
        """A of dx/ds = A x + noise, shape (p, p); the first state is the irregularity (observer form)."""
        polynomial = np.poly([-corner for corner in self.corners])
        order = len(self.corners)
        A = np.diag(np.ones(order - 1), 1)
        A[:, 0] = -polynomial[1:]
        return A

    @property
    def intensity(self) -> np.ndarray:
        """Covariance of the noise per metre, shape (p, p)."""
        drive = np.zeros(len(self.corners))
        drive[-1 - self.zeros] = 1.0
        return np.pi * self.level * np.outer(drive, drive)

    def stationary(self) -> np.ndarray:
        """Covariance of the states, shape (p, p)."""
        return solve_continuous_lyapunov(self.matrix, -self.intensity)

    def step(self, spacing: float) -> tuple[np.ndarray, np.ndarray]:
        """Transition and covariance over `spacing` m."""
        T = expm(self.matrix * spacing)
        P = self.stationary()
        return T, P - T @ P @ T.T

    def covariance(self, spacing: float, count: int) -> np.ndarray:
        """Covariance of [the other states, the irregularity now, one step ago ... `count` steps ago]."""
        T, P = expm(self.matrix * spacing), self.stationary()
        order = len(P)
        total = np.empty((order + count, order + count))
        late = [P]
        for _ in range(count):
            late.append(T @ late[-1])  # covariance of the states now with those n steps ago
        for i in range(count + 1):
            for j in range(count + 1):
                total[order - 1 + i, order - 1 + j] = late[abs(i - j)][0, 0]
            total[: order - 1, order - 1 + i] = total[order - 1 + i, : order - 1] = late[i][1:, 0]
        total[: order - 1, : order - 1] = P[1:, 1:]
        return total


class Noise(NamedTuple):
    """Noise of the readings of one plane and what drives its states besides the track; arrays over readings, states.

    Attributes
    ----------
    density : one-sided, unit of the reading per square root of Hz, shape (m,).
    bias : standard deviation, shape (m,).
    drift : standard deviation of the drifting part, shape (m,).
    drift_time : its correlation time, s, shape (m,).
    tilt : standard deviations of the angles by which each reading feels other motions, rad, shape (m, 2).
    drive : variance per second that is added to each state, shape (n,).
    """

    density: np.ndarray
    bias: np.ndarray
    drift: np.ndarray
    drift_time: np.ndarray
    tilt: np.ndarray
    drive: np.ndarray


@dataclass(frozen=True)
class Passage:
    """Transitions of a plane on a grid whose step divides the wheelbase.

    Attributes
    ----------
    steps : tables for the kernels.
    speeds : of the tables, m/s.
    spacing, count : step in m, steps in a wheelbase.
    covariance : of the whole state at the start.
    watched : index of the track at the leading wheelset in the state.
    """

    steps: Steps
    speeds: np.ndarray
    spacing: float
    count: int
    covariance: np.ndarray
    watched: int

    def place(self, speed: np.ndarray) -> np.ndarray:
        """Fractional index of speeds in the tables."""
        return np.interp(np.log(speed), np.log(self.speeds), np.arange(len(self.speeds), dtype=float))


def passage(
    system: Callable[[float], System],
    prior: Prior,
    noise: Noise,
    speed: np.ndarray,
    spacing: float,
    count: int,
    start: np.ndarray,
) -> Passage:
    """Build the tables.

    Parameters
    ----------
    system : the plane at a speed (m/s).
    speed : speeds that occur, m/s.
    spacing, count : step of the grid, m, and steps in a wheelbase.
    start : standard deviations of the vehicle's states at the start, shape (n,).
    """
    low, high = float(np.min(speed)), float(np.max(speed))
    speeds = np.geomspace(low, high * (1 + 1e-9), max(2, int(np.ceil(np.log(high / low) / SPEED_STEP)) + 1))
    after_step = prior.step(spacing)
    moves = _moves(system, speeds, spacing)
    tables = [
        _step(move, after_step, noise, len(start), spacing / float(one))
        for move, one in zip(moves, speeds, strict=True)
    ]
    m, n, p = len(noise.density), len(start), len(prior.corners)
    present = noise.tilt > 0
    tilted, index = int(present.sum()), np.arange(m)
    tilts = np.where(present, n + 2 * m + np.cumsum(present).reshape(m, 2) - 1, (n + m + index)[:, None])
    rows = n + 2 * m + tilted + p
    line = rows - 1
    column = np.array([*range(n), *range(n + m, rows), line + count - 1, line + count])
    P = np.zeros((rows + count, rows + count))
    P[:n, :n] = np.diag(start**2)
    P[n + m : n + 2 * m, n + m : n + 2 * m] = np.diag(noise.bias**2 + noise.drift**2)
    P[n + 2 * m : n + 2 * m + tilted, n + 2 * m : n + 2 * m + tilted] = np.diag(noise.tilt[present] ** 2)
    P[rows - p :, rows - p :] = prior.covariance(spacing, count)
    steps = Steps(
        np.stack([one[0] for one in tables]),
        np.stack([one[1] for one in tables]),
        column,
        np.column_stack([n + index, n + m + index, tilts]),
        np.concatenate([start**2, np.zeros(rows - n)]),
    )
    return Passage(steps, speeds, spacing, count, P, line)


def _moves(system: Callable[[float], System], speeds: np.ndarray, spacing: float) -> np.ndarray:
    """States after a step and mean outputs over it, from states, inputs and their rates; shape (speeds, n + m, n + 4).

    They are smooth in the logarithm of the speed, so that cubic splines take the place of most exponentials.
    """
    count = int(np.ceil(np.log(speeds[-1] / speeds[0]) / EXACT_STEP)) + 3
    if len(speeds) < max(SPLINE_LEAST, count):
        return np.stack([_move(system(float(one)), spacing / float(one)) for one in speeds])
    exact = np.geomspace(speeds[0], speeds[-1], count)
    moves = np.stack([_move(system(float(one)), spacing / float(one)) for one in exact])
    return CubicSpline(np.log(exact), moves)(np.log(np.clip(speeds, exact[0], exact[-1])))


def _move(system: System, dt: float) -> np.ndarray:
    """The same at one speed, for a step of `dt` s."""
    n, m = len(system.A), len(system.C)
    whole = np.zeros((n + 4 + m, n + 4 + m))
    whole[:n, : n + 4] = np.hstack([system.A, system.B, system.E])
    whole[n : n + 2, n + 2 : n + 4] = np.eye(2)
    whole[n + 4 :, : n + 4] = np.hstack([system.C, system.D, system.G])
    moved = expm(whole * dt)[[*range(n), *range(n + 4, n + 4 + m)], : n + 4]
    moved[n:] /= dt
    return moved


def _step(
    moved: np.ndarray, own_step: tuple[np.ndarray, np.ndarray], noise: Noise, n: int, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """F and Q of `Steps` for steps of `dt` s; irregularities go linearly from place to place, outputs are means."""
    T, new = own_step
    m, p = len(noise.density), len(T)
    held = m + int((noise.tilt > 0).sum())  # biases and tilts
    after = moved[:, n + 2 : n + 4] / dt
    before = moved[:, n : n + 2] - after
    order = np.array([*range(1, p), 0])  # the irregularity stands last in the top
    own = np.zeros((p, n + held + p + 2))
    own[:, n + held : n + held + p] = T[np.ix_(order, order)]
    F = np.zeros((n + m + held + p, n + held + p + 2))
    F[: n + m, :n] = moved[:, :n]
    F[: n + m] += np.outer(after[:, 0], own[-1])
    F[: n + m, n + held + p - 1] += before[:, 0]
    F[: n + m, -2] += after[:, 1]
    F[: n + m, -1] += before[:, 1]
    F[n + m : n + m + held, n : n + held] = np.eye(held)
    F[n + m + held :] = own
    into = np.zeros((n + m + held + p, p))
    into[n + m + held :] = np.eye(p)
    into[: n + m, -1] = after[:, 0]
    Q = into @ new[np.ix_(order, order)] @ into.T
    drift = 2.0 * noise.drift**2 / noise.drift_time
    Q[np.diag_indices(len(Q))] += dt * np.concatenate([noise.drive, np.zeros(m), drift, np.zeros(held - m + p)])
    return F, Q
