"""A straight line with a bend: the smallest system that has everything."""

from dataclasses import dataclass, field

import numpy as np

from experiments.discrepancy.core.model import Coordinate, Effect, Level, Library, Still, as_healthy
from experiments.discrepancy.core.priors import HalfNormal, LogNormal

BEND = Effect("bend", "bend", own=(Coordinate("bend", "1/s2", 0.0, 1.0),), starts=((0.5,), (-0.5,)), place="drift")
STEEP = Effect("steep", "steep", faults=(Coordinate("slope", "1/s", 0.0, 3.0),))
LIBRARY = Library((BEND, STEEP))


@dataclass(frozen=True, eq=False)
class Line(Still):
    """y = offset + slope t + bend t^2 with white noise and a latent drift; `gain` turns all of it into other units."""

    seen: np.ndarray
    gain: float = 1.0
    levels: tuple[Level, ...] = (
        Level("noise", "sensor", LogNormal(1.0, 0.3)),
        Level("drift", "force", HalfNormal(0.02), "drift"),
    )
    coordinates: tuple[Coordinate, ...] = field(default=(Coordinate("offset", "-", 0.0, 1.0),
                                                         Coordinate("slope", "1/s", 0.0, 0.1)))  # fmt: skip

    @property
    def time(self) -> np.ndarray:
        return np.linspace(-1.0, 1.0, len(self.seen))

    @property
    def observed(self) -> tuple[np.ndarray, ...]:
        return (self.gain * self.seen[None, None],)

    def starts(self) -> np.ndarray:
        return np.zeros((1, 2))

    def predict(self, points: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        points, effects = as_healthy(points, effects, self.coordinates)
        bend = points[:, 2:3] if any(effect.family == "bend" for effect in effects) else 0.0
        lines = points[:, :1] + points[:, 1:2] * self.time + bend * self.time**2
        return (self.gain * lines[:, None, None],)

    def covariances(self, x: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        del x, effects
        apart = np.abs(self.time[:, None] - self.time)
        parts = np.stack([0.05**2 * np.eye(len(self.time)), np.exp(-apart / 0.5)])
        return (self.gain**2 * parts[:, None],)


def line(seed: int, bend: float = 0.0, slope: float = 0.05, drift: float = 0.0, count: int = 60) -> np.ndarray:
    """A record; `drift` is a random walk's size."""
    rng = np.random.default_rng(seed)
    time = np.linspace(-1.0, 1.0, count)
    walk = np.cumsum(rng.standard_normal(count)) / np.sqrt(count)
    return 0.3 + slope * time + bend * time**2 + 0.05 * rng.standard_normal(count) + drift * walk
