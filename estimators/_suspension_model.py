"""The half vehicle in steps of time, with what nobody measures: forces that the model lacks, errors of the track.

State z = [x of `_half_vehicle`; shaped noise of the track; one line of past values for each track quantity]. What the
leading wheelset meets, the trailing one meets a wheelbase later: the line holds it until then. Between two samples

    z' = F z + G u + noise(Q),   y = C z + D u + noise(R),

u the known part of the track. For constant parameters the Kalman filter forgets its start within seconds; its gain is
then the solution of the Riccati equation, which `steady` finds for many parameters at once by doubling (Chu, Fan,
Lin and Wang 2004, Int. J. Control 77).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from estimators._half_vehicle import INPUTS, STATES, HalfVehicle
from estimators._shaping import Prior

DOUBLINGS = 24
CONVERGED = 1e-9


@dataclass(frozen=True)
class Unknowns:
    """What drives the vehicle besides the known track, and what spoils the readings.

    Attributes
    ----------
    force : intensity of the white forces and moments, N^2 s and (N m)^2 s, on the nine degrees of freedom, shape (9,).
    reading : variance of each reading, sensor noise and what the model leaves, shape (m,).
    track : shaped noise of the rails' position (m) and roll (rad), in this order; none where the track is exact.
    """

    force: np.ndarray
    reading: np.ndarray
    track: tuple[Prior, ...] = ()


class Discrete(NamedTuple):
    """Matrices of one set of parameters; n states, m readings."""

    F: np.ndarray
    G: np.ndarray
    C: np.ndarray
    D: np.ndarray
    Q: np.ndarray
    R: np.ndarray


class Layout(NamedTuple):
    """Where the state holds what.

    Attributes
    ----------
    head : number of states of vehicle and shaped noise, which come first.
    delay : samples from the leading to the trailing wheelset.
    lines : number of lines of past values.
    length : of a line.
    """

    head: int
    delay: float
    lines: int
    length: int

    @property
    def size(self) -> int:
        """Number of states."""
        return self.head + self.lines * self.length

    def taps(self, line: int, late: float) -> dict[int, float]:
        """States and weights that give what the leading wheelset met `late` samples ago, by a straight line."""
        whole = int(np.floor(late))
        first = self.head + line * self.length + whole - 1
        return {first: 1.0 - (late - whole), first + 1: late - whole}

    @property
    def columns(self) -> np.ndarray:
        """States outside the head that the next state or the readings depend on by more than a shift."""
        found = {
            tap
            for line in range(self.lines)
            for late in (self.delay, self.delay - 0.5)
            for tap in self.taps(line, late)
        }
        return np.array(sorted(found), dtype=np.int64)


def layout(wheelbase: float, speed: float, rate: float, track: Sequence[Prior]) -> Layout:
    """Layout of the state.

    Parameters
    ----------
    wheelbase : m; speed : m/s; rate : samples per second.
    """
    delay = wheelbase / speed * rate
    head = STATES + sum(len(prior.corners) for prior in track)
    return Layout(head, delay, len(track), int(np.floor(delay)) + 2 if track else 0)


def discrete(
    vehicle: HalfVehicle,
    parameters: Sequence[float] | np.ndarray,
    speed: float,
    rate: float,
    unknowns: Unknowns,
    plan: Layout,
) -> Discrete:
    """Matrices for a step of 1 / rate s; the known track goes linearly from sample to sample."""
    A, B, C, D = vehicle.at(parameters)
    n, head, step = len(A), plan.head, 1.0 / rate
    full, noise = np.zeros((head, head)), np.zeros((head, head))
    full[:n, :n] = A
    noise[:n, :n] = vehicle.force @ np.diag(unknowns.force) @ vehicle.force.T
    outputs = np.zeros((len(C), plan.size))
    outputs[:, :n] = C
    first = n
    for line, prior in enumerate(unknowns.track):
        last = first + len(prior.corners)
        full[first:last, first:last] = speed * prior.matrix
        noise[first:last, first:last] = speed * prior.intensity
        rows = np.zeros((n + len(C), last - first))
        rows[:, 0] = np.concatenate([B, D])[:, 2 * line]
        if line == 1:
            rows += np.outer(np.concatenate([B, D])[:, 4], speed * prior.matrix[0])
        full[:n, first:last] += rows[:n]
        outputs[:, first:last] += rows[n:]
        first = last
    moved, Q_head = _van_loan(full, noise, step)
    F, Q = np.zeros((plan.size, plan.size)), np.zeros((plan.size, plan.size))
    F[:head, :head], Q[:head, :head] = moved, Q_head
    G = _held(A, B, step)
    _delay(F, outputs, G, D, unknowns, plan, rate)
    whole = np.zeros((plan.size, len(INPUTS)))
    whole[:n] = G
    return Discrete(F, whole, outputs, D, Q, np.diag(unknowns.reading))


def _delay(
    F: np.ndarray, C: np.ndarray, G: np.ndarray, D: np.ndarray, unknowns: Unknowns, plan: Layout, rate: float
) -> None:
    """The lines move on, and end under the trailing wheelset."""
    first = STATES
    for line, prior in enumerate(unknowns.track):
        start = plan.head + line * plan.length
        F[start, first] = 1.0
        for place in range(start + 1, start + plan.length):
            F[place, place - 1] = 1.0
        for place, weight in plan.taps(line, plan.delay - 0.5).items():
            F[:STATES, place] += weight * G[:, 2 * line + 1]
        for place, weight in plan.taps(line, plan.delay).items():
            C[:, place] += weight * D[:, 2 * line + 1]
        if line == 1:
            newer = start + int(np.floor(plan.delay)) - 1
            F[:STATES, newer] += rate * G[:, 5]
            F[:STATES, newer + 1] -= rate * G[:, 5]
        first += len(prior.corners)


def _held(A: np.ndarray, B: np.ndarray, step: float) -> np.ndarray:
    """What an input that stays for a step does to the state."""
    n, k = B.shape
    block = np.zeros((n + k, n + k))
    block[:n, :n], block[:n, n:] = A, B
    return expm(block * step)[:n, n:]


def _van_loan(A: np.ndarray, noise: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Transition and covariance of a step (Van Loan 1978)."""
    n = len(A)
    block = np.zeros((2 * n, 2 * n))
    block[:n, :n], block[:n, n:], block[n:, n:] = -A, noise, A.T
    moved = expm(block * step)
    F = moved[n:, n:].T
    Q = F @ moved[:n, n:]
    return F, (Q + Q.T) / 2.0


def steady(F: np.ndarray, C: np.ndarray, Q: np.ndarray, R: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gain of the one-step predictor and covariance of the innovation, of many systems at once.

    Parameters
    ----------
    F, C, Q, R : shapes (k, n, n), (k, m, n), (k, n, n), (k, m, m).

    Returns
    -------
    K (k, n, m) with z' = F z + G u + K e, and S (k, m, m).
    """
    identity = np.eye(F.shape[-1])
    A, H = np.swapaxes(F, 1, 2).copy(), Q.copy()
    G = np.swapaxes(C, 1, 2) @ np.linalg.solve(R, C)
    for _ in range(DOUBLINGS):
        solved = np.linalg.solve(identity + G @ H, np.concatenate([A, G], axis=2))
        WA, WG = solved[..., : A.shape[-1]], solved[..., A.shape[-1] :]
        added = np.swapaxes(A, 1, 2) @ H @ WA
        G = G + A @ WG @ np.swapaxes(A, 1, 2)
        H = H + (added + np.swapaxes(added, 1, 2)) / 2.0
        A = A @ WA
        if np.abs(added).max() <= CONVERGED * np.abs(H).max():
            break
    cross = H @ np.swapaxes(C, 1, 2)
    S = C @ cross + R
    K = np.swapaxes(np.linalg.solve(S, np.swapaxes(F @ cross, 1, 2)), 1, 2)
    return K, S
