"""Adhesion level from features of a window: multinomial logistic regression with weights that go with the speed.

log p(level) = const + w0 + (w1 + w2 v) z + w3 v + w4 v^2 + w5 v^3 with z the features less their mean over their
spread and v = log(V / 27 m/s) / 0.35, all over a temperature that makes the probabilities those with which the level is
right (Guo et al. 2017), found on tracks that the weights were not fitted to. The slope's logarithm is a linear
regression on the same terms.
"""

import importlib.resources
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from railsim.errors import InputError

LEVELS = ("dry", "wet", "low", "very low")
FILE = "adhesion_calibration.json"
MIDDLE, SPAN = 27.0, 0.35  # m/s, -: of the speeds 15 to 45 m/s


@dataclass(frozen=True)
class Classifier:
    """Calibration for one vehicle, set of sensors and length of window.

    Attributes
    ----------
    mean, scale : of the features, (f,). weights : (2 f + 4, levels). temperature : of the softmax.
    slope : weights of the logarithm of the creep slope, (2 f + 4,). slope_std : of that logarithm's error.
    speeds : slowest and fastest speed of the calibration, m/s.
    farthest : the `distance` that 99.5 % of its windows do not exceed.
    """

    mean: np.ndarray
    scale: np.ndarray
    weights: np.ndarray
    temperature: float
    slope: np.ndarray
    slope_std: float
    speeds: tuple[float, float]
    farthest: float

    @classmethod
    def read(cls, values: Mapping[str, Any]) -> "Classifier":
        """From what stands in the file."""
        low, high = values["speeds [m/s]"]
        return cls(
            mean=np.asarray(values["mean"], dtype=float),
            scale=np.asarray(values["scale"], dtype=float),
            weights=np.asarray(values["weights"], dtype=float),
            temperature=float(values["temperature"]),
            slope=np.asarray(values["slope"], dtype=float),
            slope_std=float(values["slope_std"]),
            speeds=(float(low), float(high)),
            farthest=float(values["farthest"]),
        )

    def probabilities(self, features: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """Of the levels, (n, 4); features (n, f), speed in m/s (n,)."""
        return softmax(terms(self.normal(features), speed) @ self.weights / self.temperature)

    def creep_slope(self, features: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """Initial creep slope as a share of Kalker's, (n,)."""
        return np.exp(terms(self.normal(features), speed) @ self.slope)

    def normal(self, features: np.ndarray) -> np.ndarray:
        """Features less their mean over their spread in the calibration."""
        return (features - self.mean) / self.scale

    def distance(self, features: np.ndarray) -> np.ndarray:
        """Root mean square of the normalised features, (n,): large where a window is unlike all of the calibration."""
        return np.sqrt(np.mean(self.normal(features) ** 2, axis=1))


def terms(normal: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Terms of the regressions: features, features times speed, powers of the speed, one; (n, 2 f + 4)."""
    v = np.log(np.asarray(speed) / MIDDLE)[:, None] / SPAN
    return np.hstack([normal, normal * v, v, v**2, v**3, np.ones_like(v)])


def softmax(scores: np.ndarray) -> np.ndarray:
    """Probabilities of scores (n, k)."""
    lifted = np.exp(scores - scores.max(axis=1, keepdims=True))
    return lifted / lifted.sum(axis=1, keepdims=True)


@lru_cache(maxsize=1)
def calibrations() -> dict[str, Any]:
    """Contents of the shipped file."""
    return json.loads(importlib.resources.files("estimators.adhesion").joinpath(FILE).read_text(encoding="utf-8"))


def vehicles() -> list[str]:
    """Vehicles that have a calibration."""
    return sorted(calibrations()["vehicles"])


def no_calibration(vehicle: str) -> str:
    """What is missing for a vehicle that has no calibration, and how to get it."""
    return (
        f"an adhesion calibration for vehicle '{vehicle}' (there are: {', '.join(vehicles())}): "
        "make one by python -m experiments.calibration.adhesion --vehicle NAME"
    )


@lru_cache(maxsize=16)
def classifier(vehicle: str, sensors: str, window: float) -> Classifier:
    """The calibration for a vehicle's name, a set of sensors and a window.

    Raises
    ------
    InputError : there is none for that vehicle.
    """
    if vehicle not in vehicles():
        raise InputError(f"the level needs {no_calibration(vehicle)}")
    return Classifier.read(calibrations()["vehicles"][vehicle]["classifiers"][f"{sensors}, {window:g} s"])
