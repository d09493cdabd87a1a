"""Falling balls, filmed: heights of two drops a ball at 15 Hz. The model knows gravity; the air is what it lacks.

Data: de Silva, Higdon, Brunton and Kutz (2020), Discovery of physics from data, Frontiers in Artificial Intelligence 3.
One camera filmed all drops: what it gets wrong (scale, rate, distortion over the height) is the same for all balls, and
each ball learns it from the others.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from experiments.discrepancy.core.healthy import learned_scales, rescaled
from experiments.discrepancy.core.model import Coordinate, Effect, Fit, Level, Library, Still
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.priors import HalfNormal, LogNormal
from experiments.discrepancy.core.search import infer
from experiments.discrepancy.core.shared import Gaussian, combined, marginal, message
from experiments.discrepancy.core.verdict import Verdict
from railsim.errors import InputError

GRAVITY = 9.81  # m/s2
AIR = 1.2  # kg/m3, at 20 degrees C
OUNCE = 0.0283495  # kg
HEIGHT = 46.0  # m, of the drops
SEEN = ["time [s]", "height [m]"]
STEP = 0.02  # s, of the integration (midpoint rule)
FORCE_MEMORY = 0.3  # s; of a latent force
READING_MEMORY = 0.15  # s; of a reading's error: two frames
LAW_LENGTH = 8.0  # m/s; over which a law of the speed may change
SHEET: Mapping[str, tuple[float, float] | None] = {
    "baseball": (5.0, 22.25), "blue_basketball": (18.0, 75.0), "green_basketball": (16.0, 73.25),
    "bowling_ball": (81.0, 67.0), "golf_ball": (1.62, 13.8), "tennis_ball": (2.0, 20.75), "whiffle_1": (1.0, 22.8),
    "whiffle_2": (1.0, 22.8), "yellow_whiffle": (1.5, 29.0), "orange_whiffle": (1.5, 29.0), "volleyball": None,
}  # fmt: skip
"""Mass [ounces] and circumference [cm]; the volleyball's are not stated."""

CAMERA = ("log scale", "log rate", "distortion 1", "distortion 2", "distortion 3", "distortion 4")
CAMERA_SPREAD = np.array([0.02, 0.002, 0.5, 0.5, 0.5, 0.5])
"""Before any ball is seen: 2 % of scale, 0.2 % of the frames' rate, sines over the height of 0.5 m, 1 % of it."""

LIBRARY = Library(
    (
        Effect("quadratic drag", "drag", own=(Coordinate("log drag coefficient", "-", math.log(0.5), 0.5),),
               starts=((math.log(0.35),), (math.log(0.7),)), place="law"),
        Effect("linear drag", "drag", own=(Coordinate("log drag rate", "1/s", math.log(0.2), 1.0),),
               starts=((math.log(0.1),), (math.log(0.4),)), place="law"),
        Effect("drag by a power", "drag", own=(Coordinate("log drag coefficient at 15 m/s", "-", math.log(0.4), 0.7),
                                               Coordinate("exponent", "-", 1.5, 0.5)), place="law"),
        Effect("gravity", "gravity", faults=(Coordinate("gravity", "m/s2", 0.0, 0.05),)),
        Effect("thrown", "thrown", own=(Coordinate("speed at the start", "m/s", 0.0, 3.0),),
               starts=((1.0,), (-1.0,))),
    )
)  # fmt: skip
"""Buoyancy follows from mass and size, and is part of the model. Gravity differs by 0.05 m/s2 over the Earth."""


LEVELS = (
    Level("noise", "sensor", LogNormal(0.05, 0.5)),
    Level("reading", "reading", HalfNormal(0.1), "reading"),
    Level("force", "force", HalfNormal(0.03), "force"),
    Level("law", "law", HalfNormal(0.01), "law"),
)
"""Noise and correlated error of reading [m], latent force and law of the speed [over gravity], as they are before any
ball is seen.
"""


def read_drops(path: Path) -> dict[str, list[np.ndarray]]:
    """(samples, 2) of time [s] and height [m] of each drop, by ball.

    Raises
    ------
    InputError : there is no such file, or it has other columns.
    """
    try:
        table = pd.read_csv(path)
        columns = table[["ball", "drop", *SEEN]]
    except (OSError, KeyError, ValueError) as error:
        raise InputError(f"cannot read drops of balls from '{path}': {str(error).splitlines()[0]}") from None
    drops: dict[str, list[np.ndarray]] = {}
    for ball in dict.fromkeys(table["ball"]):
        own = pd.DataFrame(columns[table["ball"] == ball])
        drops[str(ball)] = [own.loc[own["drop"] == drop, SEEN].to_numpy(float) for drop in dict.fromkeys(own["drop"])]
    return drops


UNSEEN = Gaussian(np.zeros(len(CAMERA)), np.diag(CAMERA_SPREAD**2))
"""The camera before any ball is seen."""


@dataclass(frozen=True, eq=False)
class Ball(Still):
    """The drops of one ball; a `System` of the inference. Coordinates of the camera are normal and independent,
    `root` turns them into those of `CAMERA`.
    """

    name: str
    drops: tuple[np.ndarray, ...]
    camera: Gaussian = UNSEEN

    @cached_property
    def root(self) -> np.ndarray:
        """Lower triangle whose square is the camera's covariance."""
        return np.linalg.cholesky(self.camera.covariance)

    @property
    def area_by_mass(self) -> float:
        """Cross-section over mass [m2/kg]; that of a usual volleyball (0.27 kg, 0.21 m) where none is stated."""
        sheet = SHEET.get(self.name)
        if sheet is None:
            return 0.25 * math.pi * 0.21**2 / 0.27
        return (0.01 * sheet[1]) ** 2 / (4.0 * math.pi) / (sheet[0] * OUNCE)

    @property
    def weight(self) -> float:
        """Gravity less buoyancy, over gravity."""
        sheet = SHEET.get(self.name)
        mass = 0.27 if sheet is None else sheet[0] * OUNCE
        radius = math.sqrt(self.area_by_mass * mass / math.pi)
        return 1.0 - AIR * 4.0 / 3.0 * math.pi * radius**3 / mass

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """Start of each drop, then gravity, the sheet and the camera."""
        return self._coordinates

    @cached_property
    def _coordinates(self) -> tuple[Coordinate, ...]:
        own: list[Coordinate] = []
        for number, drop in enumerate(self.drops, 1):
            own += [
                Coordinate(f"height {number}", "m", float(drop[0, 1]), 2.0),
                Coordinate(f"speed {number}", "m/s", 0.0, 0.5),
                Coordinate(f"release {number}", "s", 0.05, 0.1),
            ]
        own += [
            Coordinate("gravity", "m/s2", 0.0, 0.005),
            Coordinate("log area by mass", "-", 0.0, 0.3 if SHEET.get(self.name) is None else 0.02),
        ]
        return (*own, *(Coordinate(f"camera {number}", "-", 0.0, 1.0) for number in range(1, len(CAMERA) + 1)))

    levels: tuple[Level, ...] = LEVELS

    @property
    def observed(self) -> tuple[np.ndarray, ...]:
        """Heights of each drop."""
        return tuple(drop[None, None, :, 1] for drop in self.drops)

    def starts(self) -> np.ndarray:
        """The heights that were seen first."""
        return np.array([[one.mean for one in self.coordinates]])

    def predict(self, points: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """Heights as the camera sees them, (points, 1, 1, samples) of each drop."""
        own = 3 * len(self.drops)
        base = len(self.coordinates)
        camera = self.camera.mean + points[:, base - len(CAMERA) : base] @ self.root.T
        area = self.area_by_mass * np.exp(points[:, own + 1])
        gravity = (GRAVITY + points[:, own]) * self.weight
        forces, thrown = self._air(points[:, base:], effects, area)
        heights = []
        for number, drop in enumerate(self.drops):
            start = points[:, 3 * number : 3 * number + 3]
            time = drop[:, 0] * np.exp(camera[:, 1:2]) - start[:, 2:3]
            fallen = _fall(time, start[:, 0], start[:, 1] + thrown, gravity, forces)
            heights.append(_seen(fallen, camera)[:, None, None, :])
        return tuple(heights)

    def _air(
        self, own: np.ndarray, effects: tuple[Effect, ...], area: np.ndarray
    ) -> tuple[list[tuple[np.ndarray, np.ndarray]], np.ndarray]:
        """Terms (a, n) of the deceleration a v^n [m/s2], and the speed upwards at the start [m/s], at each point."""
        terms, thrown, column = [], np.zeros(len(own)), 0
        for effect in effects:
            values = own[:, column : column + len(effect.own)]
            column += len(effect.own)
            if effect.name == "quadratic drag":
                terms.append((0.5 * AIR * np.exp(values[:, 0]) * area, np.full(len(own), 2.0)))
            elif effect.name == "linear drag":
                terms.append((np.exp(values[:, 0]), np.ones(len(own))))
            elif effect.name == "drag by a power":
                terms.append((0.5 * AIR * np.exp(values[:, 0]) * area * 15.0 ** (2.0 - values[:, 1]), values[:, 1]))
            elif effect.name == "thrown":
                thrown = thrown + values[:, 0]
        return terms, thrown

    def covariances(self, x: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """Noise, reading, force and law of each drop, (4, 1, samples, samples)."""
        del x, effects
        return self._components

    @cached_property
    def _components(self) -> tuple[np.ndarray, ...]:
        found = []
        for drop in self.drops:
            time, height = drop.T
            grid = np.arange(0.0, time[-1] + STEP, STEP)
            passed = np.maximum(time[:, None] - grid - 0.5 * STEP, 0.0) * STEP
            speed = np.abs(np.polyval(np.polyder(np.polyfit(time, height, 4)), grid))
            force = np.exp(-np.abs(grid[:, None] - grid) / FORCE_MEMORY)
            law = np.exp(-0.5 * ((speed[:, None] - speed) / LAW_LENGTH) ** 2)
            rest = np.exp(-0.5 * (speed / LAW_LENGTH) ** 2)
            spare = 1e-12 * np.eye(len(time))
            found.append(
                np.stack(
                    [
                        np.eye(len(time)),
                        np.exp(-np.abs(time[:, None] - time) / READING_MEMORY),
                        GRAVITY**2 * passed @ force @ passed.T + spare,
                        GRAVITY**2 * passed @ (law - np.outer(rest, rest)) @ passed.T + spare,
                    ]
                )[:, None]
            )
        return tuple(found)


def _fall(
    time: np.ndarray, height: np.ndarray, upward: np.ndarray, gravity: np.ndarray,
    forces: Sequence[tuple[np.ndarray, np.ndarray]],
) -> np.ndarray:  # fmt: skip
    """(points, samples) heights [m] at `time` after the release [s]; before it the ball is held."""
    count = int(max(float(time.max()), 0.1) / STEP) + 3
    heights = np.empty((count, len(height)))
    heights[0], speed = height, -upward

    def pull(v: np.ndarray) -> np.ndarray:
        return gravity - sum((a * np.sign(v) * np.abs(v) ** n for a, n in forces), np.zeros_like(v))

    for row in range(1, count):
        middle = speed + 0.5 * STEP * pull(speed)
        heights[row] = heights[row - 1] - STEP * middle
        speed = speed + STEP * pull(middle)
    place = np.clip(time / STEP, 0.0, count - 1.001)
    cell = place.astype(int)
    lane = np.arange(len(height))[:, None]
    share = place - cell
    return (1.0 - share) * heights[cell, lane] + share * heights[cell + 1, lane]


def _seen(height: np.ndarray, camera: np.ndarray) -> np.ndarray:
    """Heights (points, samples) as a camera (points, 6) has them."""
    phase = math.pi * (height - 0.1 * HEIGHT) / HEIGHT
    bent = height + sum(camera[:, 1 + k, None] * np.sin(k * phase) for k in range(1, 5))
    return bent * np.exp(camera[:, :1])


@dataclass(frozen=True)
class Together:
    """Verdict of each ball, and the levels it was made with."""

    verdicts: dict[str, Verdict]
    levels: dict[str, tuple[Level, ...]]


def infer_together(
    drops: Mapping[str, Sequence[np.ndarray]], library: Library = LIBRARY, policy: Policy | None = None,
    healthy: Mapping[str, tuple[Level, ...]] | None = None,
) -> Together:  # fmt: skip
    """All balls with one camera: each ball's verdict with the camera, and the scales of latent levels, of the others.

    healthy : levels that were learned before; a library that does not know what the balls have cannot learn them.
    """
    cameras, levels = dict.fromkeys(drops, UNSEEN), dict(healthy or dict.fromkeys(drops, LEVELS))
    verdicts: dict[str, Verdict] = {}
    for last in (False, False, True):
        said = {}
        for name, own in drops.items():
            ball = Ball(name, tuple(own), cameras[name], levels[name])
            verdicts[name] = infer(ball, library, policy)
            said[name] = message(_camera(ball, verdicts[name]), cameras[name])
        if last:
            break
        fits = {name: _known(verdict) for name, verdict in verdicts.items()}
        for name in drops:
            others = [other for other in drops if other != name]
            cameras[name] = combined(UNSEEN, [said[other] for other in others])
            if healthy is None:
                levels[name] = rescaled(LEVELS, learned_scales([fits[other] for other in others], LEVELS))
    return Together(verdicts, levels)


def _known(verdict: Verdict) -> Fit:
    """The best fit without anything unknown."""
    return next(row.fit for row in verdict.rows if not row.fit.hypothesis.unknown)


def _camera(ball: Ball, verdict: Verdict) -> Gaussian:
    """The camera after a ball's drops."""
    last = len(ball.coordinates)
    own = marginal(verdict, last - len(CAMERA), last)
    return Gaussian(ball.camera.mean + ball.root @ own.mean, ball.root @ own.covariance @ ball.root.T)
