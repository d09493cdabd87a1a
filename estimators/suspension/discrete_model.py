"""The half vehicle in steps of time, with what nobody measures: forces that the model lacks, errors of the track.

State z = [x of `vehicle.affine`; shaped noise of the track; one line of past values for each track quantity]. What the
leading wheelset meets, the trailing one meets a wheelbase later: the line holds it until then. Between two samples

    z' = F z + G [u; u'] + noise(Q),   y = C z + D u + noise(R),

u the known part of the track, which goes from u to u' in a straight line. For constant parameters the Kalman filter
forgets its start within seconds; its gain is then the solution of the Riccati equation, which `steady` finds for many
parameters at once by doubling (Chu, Fan, Lin and Wang 2004, Int. J. Control 77).

What drives the model is low-passed like the readings: with white noise in its place a filter explains the power that
is missing above the corner by more damping, and C_spsi came out up to 40 % too large.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from estimators.filters.discretisation import ramped_inputs, van_loan
from estimators.filters.track_spectrum import TrackSpectrum
from estimators.vehicle.affine import COORDINATES, INPUTS, STATES, HalfVehicle

COLOURED = tuple(number for number, name in enumerate(COORDINATES) if name.startswith("wheelset"))
DOUBLINGS = 24
CONVERGED = 1e-9


@dataclass(frozen=True)
class Unknowns:
    """What drives the vehicle besides the known track, and what spoils the readings.

    Attributes
    ----------
    force : intensity of the white forces and moments, N^2 s and (N m)^2 s, on the nine coordinates, shape (9,).
    reading : variance of each reading, sensor noise and what the model leaves, shape (m,).
    track : shaped noise of the rails' position (m) and roll (rad), in this order; none where the track is exact.
    low_pass : corner of the readings' low-pass (Butterworth, second order), Hz. What track and wheelset forces do has
        passed it too; the vehicle being linear, it stands before them. None: the readings are not filtered.
    """

    force: np.ndarray
    reading: np.ndarray
    track: tuple[TrackSpectrum, ...] = ()
    low_pass: float | None = None

    @property
    def coloured(self) -> tuple[int, ...]:
        """Degrees of freedom whose forces are low-passed: those of the wheelsets."""
        return () if self.low_pass is None else COLOURED


class Discrete(NamedTuple):
    """Matrices of one set of parameters; n states, m readings. G (n, 16) takes the track now and a step later."""

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
    sources : states that hold what the track does under the leading wheelset, one a line of past values.
    length : of a line.
    """

    head: int
    delay: float
    sources: tuple[int, ...]
    length: int

    @property
    def delay_lines(self) -> int:
        """Number of lines of past values."""
        return len(self.sources)

    @property
    def size(self) -> int:
        """Number of states."""
        return self.head + self.delay_lines * self.length

    def forces(self, unknowns: Unknowns) -> list[int]:
        """First of the two states of every low-passed force; they stand last in the head."""
        count = len(unknowns.coloured)
        return [self.head - 2 * (count - number) for number in range(count)]

    def taps(self, line: int, late: float) -> dict[int, float]:
        """States and weights that give what the leading wheelset met `late` samples ago, by a straight line."""
        whole = int(np.floor(late))
        first = self.head + line * self.length + whole - 1
        return {first: 1.0 - (late - whole), first + 1: late - whole}

    @property
    def columns(self) -> np.ndarray:
        """States outside the head that the next state or the readings depend on by more than a shift."""
        states = {
            tap
            for line in range(self.delay_lines)
            for late in (self.delay - 1.0, self.delay - 0.5, self.delay, self.delay + 0.5)
            for tap in self.taps(line, late)
        }
        return np.array(sorted(states), dtype=np.int64)


def layout(wheelbase: float, speed: float, rate: float, unknowns: Unknowns) -> Layout:
    """Layout of the state.

    Parameters
    ----------
    wheelbase : m; speed : m/s; rate : samples per second.
    """
    delay, sources, head = wheelbase / speed * rate, [], STATES
    for prior in unknowns.track:
        sources.append(head)
        head += len(prior.corners) + (0 if unknowns.low_pass is None else 2)
    head += 2 * len(unknowns.coloured)
    return Layout(head, delay, tuple(sources), int(np.floor(delay + 0.5)) + 2 if sources else 0)


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
    white = unknowns.force.copy()
    white[list(unknowns.coloured)] = 0.0
    full[:n, :n] = A
    noise[:n, :n] = vehicle.force @ np.diag(white) @ vehicle.force.T
    outputs = np.zeros((len(C), plan.size))
    outputs[:, :n] = C
    _shape(full, noise, speed, unknowns, plan)
    both = np.concatenate([B, D])
    for line, first in enumerate(plan.sources):
        rates = full[first]  # of the track's own states gives its speed
        rows = np.outer(both[:, 4 if line == 1 else 6], rates)
        rows[:, first] += both[:, 2 * line]
        full[:n] += rows[:n]
        outputs[:, :head] += rows[n:]
    for degree, first in zip(unknowns.coloured, plan.forces(unknowns), strict=True):
        full[:n, first] = vehicle.force[:, degree]
        outputs[:, first] = vehicle.feedthrough[:, degree]
    F, Q = np.zeros((plan.size, plan.size)), np.zeros((plan.size, plan.size))
    F[:head, :head], Q[:head, :head] = van_loan(full, noise, step)
    G = ramped_inputs(A, B, step)
    _delay(F, outputs, G, D, plan, rate)
    whole = np.zeros((plan.size, 2 * len(INPUTS)))
    whole[:n] = G
    return Discrete(F, whole, outputs, D, Q, np.diag(unknowns.reading))


def shaped(speed: float, rate: float, unknowns: Unknowns, plan: Layout) -> np.ndarray:
    """Transition of the shaped noise over a step, which no parameter changes, shape (head - 18, head - 18)."""
    full = np.zeros((plan.head, plan.head))
    _shape(full, np.zeros_like(full), speed, unknowns, plan)
    return expm(full[STATES:, STATES:] / rate)


def _shape(full: np.ndarray, noise: np.ndarray, speed: float, unknowns: Unknowns, plan: Layout) -> None:
    """Put the shaped noise's own equations into those of the head: A and intensity."""
    for prior, first in zip(unknowns.track, plan.sources, strict=True):
        part, drive = _shaped(prior, speed, unknowns.low_pass)
        block = slice(first, first + len(part))
        full[block, block], noise[block, block] = part, drive
    for degree, first in zip(unknowns.coloured, plan.forces(unknowns), strict=True):
        full[first : first + 2, first : first + 2] = _low_pass(unknowns.low_pass)
        noise[first + 1, first + 1] = unknowns.force[degree] * full[first + 1, first] ** 2


def _low_pass(corner: float | None) -> np.ndarray:
    """Butterworth low-pass of second order: states are its output y and y' / w, the input adds w to the second."""
    w = 2.0 * np.pi * (corner or 0.0)
    return np.array([[0.0, w], [-w, -np.sqrt(2.0) * w]])


def _shaped(prior: TrackSpectrum, speed: float, corner: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Track over time as shaped noise, through the low-pass where there is one: A and intensity; the track is first."""
    own, drive = speed * prior.matrix, speed * prior.intensity
    if corner is None:
        return own, drive
    size = 2 + len(own)
    A, noise = np.zeros((size, size)), np.zeros((size, size))
    A[:2, :2] = _low_pass(corner)
    A[1, 2] = A[0, 1]
    A[2:, 2:], noise[2:, 2:] = own, drive
    return A, noise


def _delay(F: np.ndarray, C: np.ndarray, G: np.ndarray, D: np.ndarray, plan: Layout, rate: float) -> None:
    """The lines move on, and end under the trailing wheelset."""
    for line, first in enumerate(plan.sources):
        start = plan.head + line * plan.length
        F[start, first] = 1.0
        for place in range(start + 1, start + plan.length):
            F[place, place - 1] = 1.0
        fast = 5 if line == 1 else 7
        before, after = G[:, : len(INPUTS)], G[:, len(INPUTS) :]
        both = rate * (before + after)[:, fast]
        _meet(F[:STATES], plan.taps(line, plan.delay - 1.0), after[:, 2 * line + 1] + both)
        _meet(F[:STATES], plan.taps(line, plan.delay), before[:, 2 * line + 1] - both)
        for late, weight in ((plan.delay - 0.5, rate), (plan.delay + 0.5, -rate)):
            _meet(C, plan.taps(line, late), weight * D[:, fast])
        _meet(C, plan.taps(line, plan.delay), D[:, 2 * line + 1])


def _meet(matrix: np.ndarray, taps: Mapping[int, float], column: np.ndarray) -> None:
    """Add what a past value does."""
    for place, weight in taps.items():
        matrix[:, place] += weight * column


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
