"""A free pendulum seen by an encoder. The model knows gravity; the friction of its joint is what it lacks.

Data: Kaheman, Fasel, Bramburger, Strom, Kutz and Brunton (2022), The experimental multi-arm pendulum on a cart.

    theta'' = -W sin(theta) - dry sign(theta') - viscous theta' - air theta' |theta'|

The record is cut into windows that each begin from the state that is seen there, for without friction no single motion
stays near the record. Errors of these states, a latent torque and laws of the rate and of the angle are sources of
error, linearised about the predicted motion; the laws are the same in all windows.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from experiments.discrepancy.core.model import Coordinate, Effect, Level, Library, Still
from experiments.discrepancy.core.priors import HalfNormal, LogNormal
from railsim.errors import InputError

HANGS = math.pi  # rad; the encoder's angle where the pendulum hangs at rest
EVERY = 10  # samples of 4 ms from one used sample to the next
WINDOW = 25  # used samples, 1 s
INNER = 8  # steps of the integration (classical Runge-Kutta) from one used sample to the next
BEGIN = 8  # samples on each side from which a state is read, by a cubic
SMOOTH = 0.02  # rad/s; below it dry friction falls with the rate
TORQUE = 0.05  # of the torque that holds the pendulum level: unit of what may act in its joint
START_ERROR = (0.01, 0.1)  # rad, rad/s; of the states that windows begin from
MEMORY = 0.1  # s; of a latent torque and of the encoder's correlated error
LAW_LENGTH = 0.5  # of the largest rate or angle; over which a law without a name may change

LEVELS = (
    Level("noise", "sensor", LogNormal(1e-3, 1.0)),
    Level("start", "input", LogNormal(1.0, 0.5)),
    Level("reading", "reading", HalfNormal(1e-3), "reading"),
    Level("force", "force", HalfNormal(3e-3), "force"),
    Level("law of the rate", "law", HalfNormal(6e-3), "law of the rate"),
    Level("law of the angle", "law", HalfNormal(6e-3), "law of the angle"),
)
"""Encoder [rad]; states at the windows' beginnings; its correlated error [rad]; torque and laws [of `TORQUE`]."""

LIBRARY = Library(
    (
        Effect("dry friction", "dry friction", own=(Coordinate("log dry", "rad/s2", math.log(0.3), 1.0),),
               place="law of the rate"),
        Effect("viscous friction", "viscous friction", own=(Coordinate("log viscous", "1/s", math.log(0.1), 1.0),),
               place="law of the rate"),
        Effect("air drag", "air drag", own=(Coordinate("log air", "1/rad", math.log(0.02), 1.0),),
               place="law of the rate"),
        Effect("encoder scale", "encoder scale", faults=(Coordinate("scale", "-", 0.0, 0.05),)),
        Effect("length", "length", faults=(Coordinate("log W", "1/s2", math.log(64.0), 0.5),)),
    )
)  # fmt: skip
FRICTIONS = ("dry friction", "viscous friction", "air drag")


def read_columns(path: Path, names: list[str]) -> np.ndarray:
    """(columns, samples) of a pendulum's record.

    Raises
    ------
    InputError : there is no such file, or it has other columns.
    """
    try:
        return pd.read_csv(path)[names].to_numpy(float).T
    except (OSError, KeyError, ValueError) as error:
        raise InputError(f"cannot read a pendulum's record '{path}': {str(error).splitlines()[0]}") from None


def read_pendulum(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Time [s] and angle [rad] of a record; raises as `read_columns`."""
    time, angle = read_columns(path, ["time [s]", "angle [rad]"])
    return time, angle


@dataclass(frozen=True, eq=False)
class Pendulum(Still):
    """A record of a pendulum; a `System` of the inference. `angle` (samples,) [rad] at equal steps of `step` [s]."""

    angle: np.ndarray
    step: float = 0.004
    levels: tuple[Level, ...] = LEVELS

    coordinates: tuple[Coordinate, ...] = (
        Coordinate("log W", "1/s2", math.log(64.0), 0.05),
        Coordinate("offset", "rad", 0.0, 0.03),
        Coordinate("scale", "-", 0.0, 0.002),
    )

    @property
    def interval(self) -> float:
        """Between two used samples [s]."""
        return EVERY * self.step

    @cached_property
    def windows(self) -> np.ndarray:
        """(windows, samples) places of the used samples."""
        first, reach = BEGIN, EVERY * WINDOW
        count = (len(self.angle) - first - BEGIN) // reach
        return first + np.arange(count)[:, None] * reach + EVERY * np.arange(WINDOW)

    @cached_property
    def begins(self) -> np.ndarray:
        """(windows, 2): angle and rate of the encoder at the windows' beginnings."""
        near = np.arange(-BEGIN, BEGIN + 1)
        rows = self.angle[self.windows[:, :1] + near]
        cubic = np.polyfit(near * self.step, rows.T, 3)
        return np.stack([cubic[3], cubic[2]], axis=1)

    @property
    def observed(self) -> tuple[np.ndarray, ...]:
        """All used angles."""
        return (self.angle[self.windows].reshape(1, 1, -1),)

    def starts(self) -> np.ndarray:
        """One: W from the rate at which the pendulum comes by."""
        apart = self.angle - HANGS
        passes = np.nonzero(np.diff(np.sign(apart)) != 0)[0]
        half = float(np.diff(passes).mean()) * self.step if len(passes) > 1 else 0.4
        amplitude = float(np.abs(apart).max())
        slowed = 1.0 + amplitude**2 / 16.0 + 11.0 * amplitude**4 / 3072.0
        return np.array([[2.0 * math.log(math.pi * slowed / half), float(apart.mean()), 0.0]])

    def predict(self, points: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """Angles of the encoder, (points, 1, 1, samples)."""
        motion = self.motion(points, effects)[..., 0]
        seen = HANGS + points[:, 1, None, None] + (1.0 + points[:, 2, None, None]) * motion
        return (seen.reshape(len(points), 1, 1, -1),)

    def motion(self, points: np.ndarray, effects: tuple[Effect, ...]) -> np.ndarray:
        """(points, windows, samples, 2): true angle and rate."""
        friction = _frictions(points, effects)
        scale = 1.0 + points[:, 2, None]
        state = np.stack([(self.begins[:, 0] - HANGS - points[:, 1, None]) / scale, self.begins[:, 1] / scale], axis=-1)
        pull, h = np.exp(points[:, 0, None]), self.interval / INNER
        rows = [state]
        for _ in range(WINDOW - 1):
            for _ in range(INNER):
                state = _runge_kutta(state, h, pull, friction)
            rows.append(state)
        return np.stack(rows, axis=2)

    def covariances(self, x: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """(levels, 1, samples, samples), linearised about the motion at x."""
        motion = self.motion(x[None], effects)[0]
        start, response = self.response(x, motion, effects)
        unit = TORQUE * math.exp(x[0])
        size = response.shape[0]
        time = np.arange(size) * self.interval
        memory = np.exp(-np.abs(time[:, None] - time) / MEMORY)
        spare = 1e-14 * np.eye(size)
        parts = [np.eye(size), start @ start.T + spare, memory]
        parts += [unit**2 * response @ one @ response.T + spare for one in (memory, *self._laws(motion))]
        return (np.stack(parts)[:, None],)

    def _laws(self, motion: np.ndarray) -> list[np.ndarray]:
        """Covariances of a law of the rate and of one of the angle between all used samples."""
        return [law_covariance(states, states) for states in (motion[..., 1].ravel(), motion[..., 0].ravel())]

    def law(self, x: np.ndarray, effects: tuple[Effect, ...], place: str, states: np.ndarray) -> np.ndarray:
        """(states, samples): covariance of a law's torque [rad/s2] at `states` with the samples, at level 1."""
        motion = self.motion(x[None], effects)[0]
        met = motion[..., 1 if place == "law of the rate" else 0].ravel()
        unit = TORQUE * math.exp(x[0])
        return unit**2 * law_covariance(states, met, float(np.abs(met).max())) @ self.response(x, motion, effects)[1].T

    def response(self, x: np.ndarray, motion: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Of small motions: the angle by the errors of the states at the beginnings (samples, 2 windows), and by an
        angular acceleration that acts for one interval (samples, samples).
        """
        dry, viscous, air = (float(one[0, 0]) for one in _frictions(x[None], effects))
        count, size = motion.shape[:2]
        stiffness = -math.exp(x[0]) * np.cos(motion[..., 0])
        rate = motion[..., 1]
        loss = (
            -dry / SMOOTH / np.cosh(np.minimum(np.abs(rate) / SMOOTH, 300.0)) ** 2 - viscous - 2.0 * air * np.abs(rate)
        )
        middle = [0.5 * (one[:, 1:] + one[:, :-1]) for one in (stiffness, np.maximum(loss, -0.5 / self.interval))]
        matrix = np.zeros((count, size - 1, 2, 2))
        matrix[..., 0, 1], matrix[..., 1, 0], matrix[..., 1, 1] = 1.0, *middle
        matrix *= self.interval
        square = matrix @ matrix
        step = np.eye(2) + matrix + square / 2.0 + square @ matrix / 6.0 + square @ square / 24.0
        whole = np.empty((count, size, 2, 2))
        whole[:, 0] = np.eye(2)
        for k in range(size - 1):
            whole[:, k + 1] = step[:, k] @ whole[:, k]
        gain = 1.0 + x[2]
        start = np.zeros((count, size, count, 2))
        response = np.zeros((count, size, count, size))
        for window in range(count):
            start[window, :, window] = gain * whole[window, :, 0] * START_ERROR
            back = np.linalg.inv(whole[window])[:, :, 1]
            green = gain * whole[window, :, 0] @ back.T * self.interval
            response[window, :, window] = np.tril(green, -1)
        total = count * size
        return start.reshape(total, -1), response.reshape(total, total)


def law_covariance(states: np.ndarray, others: np.ndarray, largest: float | None = None) -> np.ndarray:
    """Of a law of one state, rough (it may jump where the motion turns): exp(-|difference| / length)."""
    length = LAW_LENGTH * (float(np.abs(others).max()) if largest is None else largest)
    return np.exp(-np.abs(states[:, None] - others) / length)


def _frictions(points: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Dry, viscous and air coefficient at each point (points, 1)."""
    values = dict.fromkeys(FRICTIONS, np.zeros((len(points), 1)))
    column = 3
    for effect in effects:
        if effect.name in values:
            values[effect.name] = np.exp(points[:, column : column + 1])
        column += len(effect.own)
    return values["dry friction"], values["viscous friction"], values["air drag"]


def _acceleration(state: np.ndarray, pull: np.ndarray, friction: tuple[np.ndarray, ...]) -> np.ndarray:
    angle, rate = state[..., 0], state[..., 1]
    dry, viscous, air = friction
    lost = dry * np.tanh(rate / SMOOTH) + viscous * rate + air * rate * np.abs(rate)
    return np.stack([rate, -pull * np.sin(angle) - lost], axis=-1)


def _runge_kutta(state: np.ndarray, h: float, pull: np.ndarray, friction: tuple[np.ndarray, ...]) -> np.ndarray:
    first = _acceleration(state, pull, friction)
    second = _acceleration(state + 0.5 * h * first, pull, friction)
    third = _acceleration(state + 0.5 * h * second, pull, friction)
    fourth = _acceleration(state + h * third, pull, friction)
    return state + h / 6.0 * (first + 2.0 * (second + third) + fourth)
