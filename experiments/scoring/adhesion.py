"""Scores of adhesion: level and its probability against the friction under the wheels, forces against the contacts'."""

from collections.abc import Callable

import numpy as np

from estimators.adhesion.adhesion_level import COLUMNS, WINDOW
from estimators.adhesion.channels import high_pass
from estimators.adhesion.classifier import LEVELS
from estimators.interface import Estimate
from railsim.truth import TIME, Truth

BOUNDS = (0.35, 0.134, 0.042)
"""Friction coefficients between the levels: 0.35, so that 0.4 of ordinary dry rails is dry; then geometric means."""
SIDES = ("left", "right")
FORCE = "wheelset1.lateral_creep_force [N]"


def true_level(truth: Truth) -> np.ndarray:
    """Place in `LEVELS` of the mean friction coefficient under the four wheels, by the rows of truth."""
    mean = np.mean([truth[f"wheel{i}_{side}.friction [-]"] for i in (1, 2) for side in SIDES], axis=0)
    return np.asarray(np.sum(mean[:, None] < np.array(BOUNDS), axis=1))


def level_scores(estimate: Estimate, truth: Truth) -> dict[str, float]:
    """Share of windows whose level is right, probability that is honest, places of changes.

    Windows in which the true level changes count for the places of changes only.
    """
    series = estimate.series
    time, valid = series[TIME].to_numpy(float), series["valid [-]"].to_numpy(float) > 0.5
    scores = {"windows that count [-]": float(np.mean(valid)) if len(valid) else 0.0}
    level = true_level(truth)
    first = np.searchsorted(truth.time, time - WINDOW / 2.0).clip(0, len(level) - 1)
    last = np.searchsorted(truth.time, time + WINDOW / 2.0).clip(0, len(level) - 1)
    changes = np.concatenate([[0], np.cumsum(np.diff(level) != 0)])
    counts = valid & (changes[first] == changes[last])
    if counts.any():
        given = series[list(COLUMNS)].to_numpy(float)[counts]
        real = level[first][counts]
        right = given.argmax(axis=1) == real
        scores["level right [-]"] = float(np.mean(right))
        scores["mean probability of the level named [-]"] = float(np.mean(given.max(axis=1)))
        scores["Brier score [-]"] = float(np.mean(np.sum((given - np.eye(len(LEVELS))[real]) ** 2, axis=1)))
    return scores | _change_scores(estimate, truth, level)


def _change_scores(estimate: Estimate, truth: Truth, level: np.ndarray) -> dict[str, float]:
    real = truth.time[np.flatnonzero(np.diff(level)) + 1]
    named = np.array([change["time"] for change in estimate.about.get("changes", [])])
    if not len(real):
        return {"changes that are none [-]": float(len(named))}
    scores = {"true changes [-]": float(len(real)), "changes named [-]": float(len(named))}
    if len(named):
        errors = np.abs(named[:, None] - real[None, :]).min(axis=0)
        scores["largest error of a change's place [s]"] = float(errors.max())
    return scores


def true_forces(truth: Truth, number: int) -> dict[str, np.ndarray]:
    """Net forces of the rails on a wheelset, as the estimators mean them, by the rows of truth.

    Returns
    -------
    "creep" : lateral creep force along the axle, N. "gravity" : lateral part of the normal forces, less that of a load
    that leans with the wheelset, N. "moment" : yaw moment of the longitudinal creep forces, N m. "creepage" : mean
    lateral creepage of both wheels, -.
    """
    columns = {
        quantity: np.stack([truth[f"wheel{number}_{side}.{quantity}"] for side in SIDES])
        for quantity in (
            "creep_force_y [N]",
            "creep_force_x [N]",
            "normal_force [N]",
            "contact_angle [rad]",
            "creepage_y [-]",
        )
    }
    angle, normal = columns["contact_angle [rad]"], columns["normal_force [N]"]
    roll = truth[f"wheelset{number}.roll [rad]"]
    along = columns["creep_force_x [N]"]
    return {
        "creep": np.sum(columns["creep_force_y [N]"] * np.cos(angle), axis=0),
        "gravity": -np.sum(normal * np.sin(angle), axis=0) + np.sum(normal, axis=0) * roll,
        "moment": -truth.about["vehicle"]["half_gauge [m]"] * (along[0] - along[1]),
        "creepage": np.mean(columns["creepage_y [-]"], axis=0),
    }


def force_scores(estimate: Estimate, truth: Truth) -> dict[str, float]:
    """Errors of forces and moments against the contacts', both high-passed at the estimator's corner."""
    series = estimate.series
    valid = series["valid [-]"].to_numpy(float) > 0.5
    if not valid.any():
        return {"valid share [-]": 0.0}
    time = series[TIME].to_numpy(float)[valid]
    corner = float(estimate.about["settings"]["corner"])
    scores = {"valid share [-]": float(np.mean(valid))}
    for number in (1, 2):
        true = {key: _as_seen(values, truth, time, corner) for key, values in true_forces(truth, number).items()}
        name = f"wheelset{number}"
        force = series[f"{name}.lateral_creep_force [N]"].to_numpy(float)[valid]
        moment = series[f"{name}.creep_yaw_moment [N m]"].to_numpy(float)[valid]
        gravity = f"{name}.gravity_force [N]"  # stands apart where the estimator knows the profile
        apart = series[gravity].to_numpy(float)[valid] if gravity in series.columns else 0.0
        scores |= {
            f"{name} lateral force rms error, gravity's included [N]": _rms(
                force + apart - true["creep"] - true["gravity"]
            ),
            f"{name} lateral force rms error, creep alone [N]": _rms(force - true["creep"]),
            f"{name} lateral force true rms, creep alone [N]": _rms(true["creep"]),
            f"{name} yaw moment rms error [N m]": _rms(moment - true["moment"]),
            f"{name} yaw moment true rms [N m]": _rms(true["moment"]),
        }
    return scores


def _as_seen(values: np.ndarray, truth: Truth, time: np.ndarray, corner: float) -> np.ndarray:
    return np.interp(time, truth.time, high_pass(values, corner, rate=truth.rate))


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


ADHESION_SCORERS: dict[str, Callable[[Estimate, Truth], dict[str, float]]] = {
    COLUMNS[0]: level_scores,
    FORCE: force_scores,
}
"""By the column of the estimate: what scores it."""
