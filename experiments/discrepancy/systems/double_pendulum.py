"""A free double pendulum seen by two encoders. The model knows gravity and the coupling of the arms, not the friction.

Data: Kaheman, Fasel, Bramburger, Strom, Kutz and Brunton (2022), The experimental multi-arm pendulum on a cart. Angles
p, q of the arms from where they hang, over the inertia of both arms about the upper joint (Lagrange):

    p'' + B cos(p - q) q'' = -B sin(p - q) q'^2 - G sin(p) + upper - lower
    B cos(p - q) p'' + C q'' = B sin(p - q) p'^2 - H sin(q) + lower

upper, lower: torques of the joints [rad/s2], lower by the rate q' - p'. Windows, errors and laws as those of the single
pendulum (`pendulum.py`), but linearised by differences of the motion over one interval.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from experiments.discrepancy.core.model import Coordinate, Effect, Level, Library, Still
from experiments.discrepancy.core.priors import HalfNormal, LogNormal
from experiments.discrepancy.systems.pendulum import (
    BEGIN,
    EVERY,
    HANGS,
    MEMORY,
    SMOOTH,
    START_ERROR,
    TORQUE,
    WINDOW,
    law_covariance,
    read_columns,
)

ANGLES = ["angle1 [rad]", "angle2 [rad]"]
INNER = 5  # steps of the integration from one used sample to the next
BUILD = ("log B", "log C", "log G", "log H")
JOINTS = ("upper", "lower")
NUDGE = np.array([1e-5, 1e-5, 1e-4, 1e-4])  # rad, rad/s; of the differences that linearise the motion
PUSH = 1e-2  # rad/s2; of a torque, likewise

LEVELS = (
    Level("noise", "sensor", LogNormal(1e-3, 1.0)),
    Level("start", "input", LogNormal(1.0, 0.5)),
    *(Level(f"reading of the {one} angle", "reading", HalfNormal(1e-3), f"{one} angle") for one in JOINTS),
    *(Level(f"force in the {one} joint", "force", HalfNormal(3e-3), f"{one} joint") for one in JOINTS),
    *(Level(f"law of the {one} rate", "law", HalfNormal(6e-3), f"law of the {one} rate") for one in JOINTS),
)
"""As those of the single pendulum, for each arm and joint."""


def _friction(kind: str, joint: str, unit: str, mean: float) -> Effect:
    own = (Coordinate(f"log {kind} {joint}", unit, math.log(mean), 1.0),)
    return Effect(f"{kind} friction, {joint} joint", f"{kind} friction", own=own, place=f"law of the {joint} rate")


LIBRARY = Library(
    (
        *(_friction("dry", joint, "rad/s2", 0.3) for joint in JOINTS),
        *(_friction("viscous", joint, "1/s", 0.1) for joint in JOINTS),
        *(Effect(f"scale of the {joint} encoder", "encoder scale", (Coordinate(f"scale {joint}", "-", 0.0, 0.05),))
          for joint in JOINTS),
    )
)  # fmt: skip


def read_double_pendulum(path: Path) -> np.ndarray:
    """(2, samples) angles [rad] of a record; raises as `read_columns`."""
    return read_columns(path, ANGLES)


@dataclass(frozen=True, eq=False)
class DoublePendulum(Still):
    """A record of a double pendulum. `angles` (2, samples) [rad] at equal steps of `step` [s]."""

    angles: np.ndarray
    step: float = 0.002
    levels: tuple[Level, ...] = LEVELS
    coordinates: tuple[Coordinate, ...] = (
        *(Coordinate(name, "-", math.log(mean), 0.5) for name, mean in zip(BUILD, (0.4, 0.4, 60.0, 20.0), strict=True)),
        *(Coordinate(f"offset {joint}", "rad", 0.0, 0.03) for joint in JOINTS),
        *(Coordinate(f"scale {joint}", "-", 0.0, 0.002) for joint in JOINTS),
    )

    @property
    def interval(self) -> float:
        """Between two used samples [s]."""
        return EVERY * self.step

    @cached_property
    def windows(self) -> np.ndarray:
        """(windows, samples) places of the used samples."""
        count = (self.angles.shape[1] - 2 * BEGIN) // (EVERY * WINDOW)
        return BEGIN + np.arange(count)[:, None] * EVERY * WINDOW + EVERY * np.arange(WINDOW)

    @cached_property
    def begins(self) -> np.ndarray:
        """(windows, 4): angles and rates of the encoders at the windows' beginnings."""
        near = np.arange(-BEGIN, BEGIN + 1)
        rows = self.angles[:, self.windows[:, :1] + near]
        cubic = np.polyfit(near * self.step, rows.reshape(-1, len(near)).T, 3).reshape(4, 2, -1)
        return np.concatenate([cubic[3] - HANGS, cubic[2]]).T

    @property
    def observed(self) -> tuple[np.ndarray, ...]:
        """All used angles, those of the upper arm first."""
        return (self.angles[:, self.windows].reshape(1, 1, -1),)

    def starts(self) -> np.ndarray:
        """One: B and G, then C and H, by least squares on the accelerations of cubics through the record."""
        near = np.arange(-BEGIN, BEGIN + 1)
        rows = self.angles[:, np.arange(BEGIN, self.angles.shape[1] - BEGIN)[:, None] + near]
        cubic = np.polyfit(near * self.step, rows.reshape(-1, len(near)).T, 3).reshape(4, 2, -1)
        (p, q), (v, w), (a, b) = cubic[3] - HANGS, cubic[2], 2.0 * cubic[1]
        first = np.stack([np.cos(p - q) * b + np.sin(p - q) * w**2, np.sin(p)], axis=1)
        coupled, upper = np.linalg.lstsq(first, -a, rcond=None)[0]
        second = coupled * (np.sin(p - q) * v**2 - np.cos(p - q) * a)
        own, lower = np.linalg.lstsq(np.stack([b, np.sin(q)], axis=1), second, rcond=None)[0]
        values = np.log(np.maximum([coupled, own, upper, lower], 1e-3))
        return np.concatenate([values, np.zeros(4)])[None]

    def predict(self, points: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """Angles of the encoders, (points, 1, 1, samples)."""
        motion = self.motion(points, effects)[..., :2]
        seen = HANGS + points[:, None, None, 4:6] + (1.0 + points[:, None, None, 6:8]) * motion
        return (np.moveaxis(seen, -1, 1).reshape(len(points), 1, 1, -1),)

    def motion(self, points: np.ndarray, effects: tuple[Effect, ...]) -> np.ndarray:
        """(points, windows, samples, 4): true angles and rates."""
        scale = 1.0 + points[:, None, 6:8]
        angles = (self.begins[:, :2] - points[:, None, 4:6]) / scale
        state, build = np.concatenate([angles, self.begins[:, 2:] / scale], axis=-1), built(points, effects)
        rows = [state]
        for _ in range(WINDOW - 1):
            state = self._onwards(state, build)
            rows.append(state)
        return np.stack(rows, axis=2)

    def _onwards(self, state: np.ndarray, build: np.ndarray, torque: np.ndarray | float = 0.0) -> np.ndarray:
        """States one interval later (Runge and Kutta), with torques (..., 2) [rad/s2] in the joints."""
        h = self.interval / INNER
        for _ in range(INNER):
            first = slope(state, build, torque)
            second = slope(state + 0.5 * h * first, build, torque)
            third = slope(state + 0.5 * h * second, build, torque)
            fourth = slope(state + h * third, build, torque)
            state = state + h / 6.0 * (first + 2.0 * (second + third) + fourth)
        return state

    def covariances(self, x: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """(levels, 1, samples, samples), linearised about the motion at x."""
        motion = self.motion(x[None], effects)[0]
        start, response = self.response(x, motion, effects)
        unit, size = TORQUE * math.exp(x[2]), self.windows.size
        time = np.arange(size) * self.interval
        memory, spare = np.exp(-np.abs(time[:, None] - time) / MEMORY), 1e-14 * np.eye(2 * size)
        parts = [np.eye(2 * size), start @ start.T + spare]
        parts += [np.kron(np.diag(one), memory) + spare for one in np.eye(2)]
        rates = (motion[..., 2].ravel(), (motion[..., 3] - motion[..., 2]).ravel())
        inner = [memory, memory, *(law_covariance(rate, rate) for rate in rates)]
        parts += [unit**2 * response[k % 2] @ one @ response[k % 2].T + spare for k, one in enumerate(inner)]
        return (np.stack(parts)[:, None],)

    def response(self, x: np.ndarray, motion: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Of small motions: the angles by the errors of the states at the beginnings (samples, 4 windows), and by a
        torque in each joint that acts for one interval (2, samples, intervals).
        """
        onwards, pushed = self._linear(motion, built(x[None], effects)[0])
        count, size = motion.shape[:2]
        start = np.zeros((2, count, size, count, 4))
        found = np.zeros((2, 2, count, size, count, size))
        gain = 1.0 + x[6:8]
        for window in range(count):
            whole = np.diag([*np.repeat(START_ERROR, 2)])
            effect = np.zeros((4, 2, size))
            for k in range(size):
                start[:, window, k, window] = gain[:, None] * whole[:2]
                found[:, :, window, k, window] = (gain[:, None, None] * effect[:2]).swapaxes(0, 1)
                if k < size - 1:
                    whole = onwards[window, k] @ whole
                    effect = np.einsum("ij,jlm->ilm", onwards[window, k], effect)
                    effect[:, :, k] = pushed[window, k]
        total = 2 * count * size
        return start.reshape(total, -1), found.reshape(2, total, count * size)

    def _linear(self, motion: np.ndarray, build: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of each interval: (windows, intervals, 4, 4) state by state and (windows, intervals, 4, 2) by torques."""
        state = motion[:, :-1]
        onwards = [
            (self._onwards(state + step, build) - self._onwards(state - step, build)) / (2.0 * step.max())
            for step in np.diag(NUDGE)
        ]
        pushed = [
            (self._onwards(state, build, PUSH * one) - self._onwards(state, build, -PUSH * one)) / (2.0 * PUSH)
            for one in np.eye(2)
        ]
        return np.stack(onwards, axis=-1), np.stack(pushed, axis=-1)


def built(points: np.ndarray, effects: tuple[Effect, ...]) -> np.ndarray:
    """(points, 1, 8): B, C, G, H, dry and viscous friction of both joints."""
    found = np.zeros((len(points), 1, 8))
    found[:, 0, :4] = np.exp(points[:, :4])
    names = [f"{kind} friction, {joint} joint" for kind in ("dry", "viscous") for joint in JOINTS]
    column = 8
    for effect in effects:
        if effect.name in names:
            found[:, 0, 4 + names.index(effect.name)] = np.exp(points[:, column])
        column += len(effect.own)
    return found


def slope(state: np.ndarray, build: np.ndarray, torque: np.ndarray | float) -> np.ndarray:
    """Rates and accelerations of states (..., 4)."""
    p, q, v, w = np.moveaxis(state, -1, 0)
    b, c, g, h, *friction = np.moveaxis(build, -1, 0)
    outer = np.broadcast_to(torque, (*p.shape, 2))
    upper = outer[..., 0] - friction[0] * np.tanh(v / SMOOTH) - friction[2] * v
    lower = outer[..., 1] - friction[1] * np.tanh((w - v) / SMOOTH) - friction[3] * (w - v)
    sine, cosine = b * np.sin(p - q), b * np.cos(p - q)
    first = -sine * w**2 - g * np.sin(p) + upper - lower
    second = sine * v**2 - h * np.sin(q) + lower
    determinant = c - cosine**2
    a, d = (c * first - cosine * second) / determinant, (second - cosine * first) / determinant
    return np.stack([v, w, a, d], axis=-1)
