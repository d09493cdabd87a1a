"""Track irregularity as shaped white noise over distance, and the transitions of a vehicle that runs over it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import expm, solve_continuous_lyapunov

from estimators.filters.delay_line_smoother import Steps
from estimators.filters.discretisation import mean_outputs, van_loan
from estimators.vehicle.state_space import System
from railsim.track.spectra import Spectrum, spectra

SPEED_STEP = 0.01  # relative distance of the speeds in the tables; between them transitions are interpolated
EXACT_STEP = 0.06  # the same of those whose matrix exponential is computed; splines in between
SPLINE_LEAST = 12  # speeds in the table below which all are computed


@dataclass(frozen=True)
class TrackSpectrum(Spectrum):
    """A spectrum of the track as that of white noise over distance through a linear filter; `power` must be even."""

    @classmethod
    def of(cls, spectrum: Spectrum) -> Self:
        """The same density."""
        return cls(spectrum.amplitude, spectrum.power, spectrum.corners)

    def scaled(self, amplitude: float) -> Self:
        """The same shape at another level."""
        return replace(self, amplitude=amplitude)

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
        drive[-1 - self.power // 2] = 1.0
        return np.pi * self.amplitude * np.outer(drive, drive)

    def stationary(self) -> np.ndarray:
        """Covariance of the states, shape (p, p)."""
        return solve_continuous_lyapunov(self.matrix, -self.intensity)

    def step(self, spacing: float) -> tuple[np.ndarray, np.ndarray]:
        """Transition and covariance over `spacing` m."""
        return van_loan(self.matrix, self.intensity, spacing)

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


ERRI_VERTICAL, ERRI_LATERAL, ERRI_CROSS_LEVEL, ERRI_GAUGE = (
    TrackSpectrum.of(spectra("erri_low")[quantity])
    for quantity in ("vertical", "lateral", "cross_level", "gauge_deviation")
)
"""Of ERRI B176 (1989), "low"."""


class Noise(NamedTuple):
    """Noise of the readings of one plane; arrays over the readings.

    Attributes
    ----------
    density : one-sided, unit of the reading per square root of Hz, shape (m,).
    bias : standard deviation, shape (m,).
    drift : standard deviation of the drifting part, shape (m,).
    drift_time : its correlation time, s, shape (m,).
    tilt : standard deviations of the angles by which each reading feels other motions, rad, shape (m, 2).
    """

    density: np.ndarray
    bias: np.ndarray
    drift: np.ndarray
    drift_time: np.ndarray
    tilt: np.ndarray


@dataclass(frozen=True)
class Passage:
    """Transitions of a plane on a grid whose step divides the wheelbase.

    Attributes
    ----------
    steps : tables for the kernels.
    speeds : of the tables, m/s; one after the other for each kind of place.
    spacing, count : step in m, steps in a wheelbase.
    covariance : of the whole state at the start.
    """

    steps: Steps
    speeds: np.ndarray
    spacing: float
    count: int
    covariance: np.ndarray

    def table_index(self, speed: np.ndarray, kind: np.ndarray | int = 0) -> np.ndarray:
        """Fractional index in the tables of speeds, at places of that kind."""
        return len(self.speeds) * np.asarray(kind) + np.interp(
            np.log(speed), np.log(self.speeds), np.arange(len(self.speeds), dtype=float)
        )


class Track(NamedTuple):
    """All quantities of the track over a step: their shaping states, the quantities themselves last.

    Attributes
    ----------
    transition, new : over the step, shapes (p, p).
    covariance : of the shaping states and the values at the `count` places before, shape (p + quantities count,) twice.
    quantities : how many quantities.
    """

    transition: np.ndarray
    new: np.ndarray
    covariance: np.ndarray
    quantities: int

    @staticmethod
    def of(priors: Sequence[TrackSpectrum], spacing: float, count: int) -> "Track":
        """Independent quantities, one prior each."""
        quantities, size = len(priors), sum(len(one.corners) for one in priors)
        transition, new = np.zeros((size, size)), np.zeros((size, size))
        total = np.zeros((size + quantities * count, size + quantities * count))
        first = 0
        for number, prior in enumerate(priors):
            order = len(prior.corners)
            hidden = [*range(first, first + order - 1)]
            T, Q = prior.step(spacing)
            indices = [size - quantities + number, *hidden]
            transition[np.ix_(indices, indices)] = T
            new[np.ix_(indices, indices)] = Q
            indices = [*hidden, *(size - quantities + number + quantities * i for i in range(count + 1))]
            total[np.ix_(indices, indices)] = prior.covariance(spacing, count)
            first += order - 1
        return Track(transition, new, total, quantities)


def passage(
    systems: Sequence[Callable[[float], System]],
    priors: Sequence[TrackSpectrum],
    noise: Noise,
    drives: Sequence[Callable[[float], np.ndarray]],
    speed: np.ndarray,
    spacing: float,
    count: int,
    start: np.ndarray,
) -> Passage:
    """Build the tables.

    Parameters
    ----------
    systems : the plane at a speed (m/s), for each kind of place.
    priors : of the quantities of the track, in the order of the plane's inputs.
    drives : variance per second that enters each state, shape (n,), by the speed, likewise.
    speed : speeds that occur, m/s.
    spacing, count : step of the grid, m, and steps in a wheelbase.
    start : standard deviations of the vehicle's states at the start, shape (n,).
    """
    low, high = float(np.min(speed)), float(np.max(speed))
    speeds = np.geomspace(low, high * (1 + 1e-9), max(2, int(np.ceil(np.log(high / low) / SPEED_STEP)) + 1))
    twice = systems[0](low).J
    kept = count + (twice is not None)  # second differences reach one place farther back
    track = Track.of(priors, spacing, kept)
    tables = [
        _step(move, new, track, noise, len(start), spacing / float(one), twice)
        for system, drive in zip(systems, drives, strict=True)
        for move, new, one in zip(
            step_transitions(system, speeds, spacing, track.quantities),
            step_noises(system, drive, speeds, spacing),
            speeds,
            strict=True,
        )
    ]
    m, n, p = len(noise.density), len(start), len(track.new)
    present = noise.tilt > 0
    tilted, index = int(present.sum()), np.arange(m)
    tilts = np.where(present, n + 2 * m + np.cumsum(present).reshape(m, 2) - 1, (n + m + index)[:, None])
    rows, size = n + 2 * m + tilted + p, n + 2 * m + tilted + len(track.covariance)
    P = np.zeros((size, size))
    P[:n, :n] = np.diag(start**2)
    P[n + m : n + 2 * m, n + m : n + 2 * m] = np.diag(noise.bias**2 + noise.drift**2)
    P[n + 2 * m : n + 2 * m + tilted, n + 2 * m : n + 2 * m + tilted] = np.diag(noise.tilt[present] ** 2)
    P[rows - p :, rows - p :] = track.covariance
    steps = Steps(
        np.stack([one[0] for one in tables]),
        np.stack([one[1] for one in tables]),
        np.array([*range(n), *range(n + m, rows), *_late(rows, count, track.quantities, twice is not None)]),
        np.column_stack([n + index, n + m + index, tilts]),
        np.concatenate([start**2, np.zeros(rows - n)]),
        track.quantities,
    )
    return Passage(steps, speeds, spacing, count, P)


def _late(rows: int, count: int, quantities: int, twice: bool) -> list[int]:
    """Places in the state of the track under the trailing wheelset now and one step ago; then, for second differences,
    two steps ago, and that of the leading one two steps ago.
    """
    ago = [count - 1, count, *((count + 1, 1) if twice else ())]
    return [rows - quantities + one * quantities + line for one in ago for line in range(quantities)]


def step_transitions(
    system: Callable[[float], System], speeds: np.ndarray, spacing: float, quantities: int
) -> np.ndarray:
    """States after a step and mean outputs over it, from states, inputs and their rates.

    Returns
    -------
    Shape (speeds, n + m, n + 4 quantities).
    """
    return _over(speeds, lambda speed: step_transition(system(speed), spacing / speed, 2 * quantities))


def step_noises(
    system: Callable[[float], System], drive: Callable[[float], np.ndarray], speeds: np.ndarray, spacing: float
) -> np.ndarray:
    """Covariance of what drives the states in a step, in the states after it and in the mean outputs over it.

    Returns
    -------
    Shape (speeds, n + m, n + m).
    """

    def covariance(speed: float) -> np.ndarray:
        own, dt = system(speed), spacing / speed
        n, m = len(own.A), len(own.C)
        whole = np.block([[own.A, np.zeros((n, m))], [own.C / dt, np.zeros((m, m))]])
        return van_loan(whole, np.diag(np.concatenate([drive(speed), np.zeros(m)])), dt)[1]

    return _over(speeds, covariance)


def _over(speeds: np.ndarray, compute: Callable[[float], np.ndarray]) -> np.ndarray:
    """Matrices at all speeds, m/s; they are smooth in its logarithm, so that splines take the place of most of them."""
    count = int(np.ceil(np.log(speeds[-1] / speeds[0]) / EXACT_STEP)) + 3
    if len(speeds) < max(SPLINE_LEAST, count):
        return np.stack([compute(float(one)) for one in speeds])
    exact = np.geomspace(speeds[0], speeds[-1], count)
    found = np.stack([compute(float(one)) for one in exact])
    return CubicSpline(np.log(exact), found)(np.log(np.clip(speeds, exact[0], exact[-1])))


def step_transition(system: System, dt: float, inputs: int) -> np.ndarray:
    """The same at one speed, for a step of `dt` s."""
    n = len(system.A)
    whole = np.zeros((n + 2 * inputs, n + 2 * inputs))
    whole[:n] = np.hstack([system.A, system.B, system.E])
    whole[n : n + inputs, n + inputs :] = np.eye(inputs)
    moved, means = mean_outputs(whole, np.hstack([system.C, system.D, system.G]), dt)
    return np.vstack([moved[:n], means])


def _step(
    moved: np.ndarray, driven: np.ndarray, track: Track, noise: Noise, n: int, dt: float, twice: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """F and Q of `Steps` for steps of `dt` s; irregularities go linearly from place to place, outputs are means."""
    m, p, q = len(noise.density), len(track.new), track.quantities
    held = m + int((noise.tilt > 0).sum())  # biases and tilts
    top = n + held + p
    after = moved[:, n + 2 * q : n + 4 * q] / dt
    before = moved[:, n : n + 2 * q] - after
    own = np.zeros((p, top + (2 if twice is None else 4) * q))
    own[:, n + held : top] = track.transition
    F = np.zeros((n + m + held + p, own.shape[1]))
    F[: n + m, :n] = moved[:, :n]
    F[: n + m, top - q : top] += before[:, :q]
    F[: n + m, top : top + q] += after[:, q:]
    F[: n + m, top + q : top + 2 * q] += before[:, q:]
    lead = after[:, :q].copy()
    if twice is not None:
        curve = np.vstack([np.zeros((n, 2 * q)), twice]) / dt**2
        lead += curve[:, :q]
        F[: n + m, top - q : top] -= 2.0 * curve[:, :q]
        F[: n + m, top + 3 * q :] += curve[:, :q]
        F[: n + m, top : top + 3 * q] += np.hstack([curve[:, q:], -2.0 * curve[:, q:], curve[:, q:]])
    F[: n + m] += lead @ own[-q:]
    F[n + m : n + m + held, n : n + held] = np.eye(held)
    F[n + m + held :] = own
    into = np.zeros((n + m + held + p, p))
    into[n + m + held :] = np.eye(p)
    into[: n + m, -q:] = lead
    Q = into @ track.new @ into.T
    drift = 2.0 * noise.drift**2 / noise.drift_time
    Q[: n + m, : n + m] += driven
    Q[np.diag_indices(len(Q))] += dt * np.concatenate([np.zeros(n + m), drift, np.zeros(held - m + p)])
    return F, Q
