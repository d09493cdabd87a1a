"""Scores: an estimate against the truth, one small function for each kind of estimated quantity."""

import re
from collections.abc import Callable
from typing import Any

import numpy as np

from estimators.interface import Estimate
from experiments.scoring.adhesion import ADHESION_SCORERS
from experiments.scoring.joints import JOINT_SCORERS
from experiments.scoring.suspension import SUSPENSION_SCORERS
from experiments.scoring.track import TRACK_SCORERS
from experiments.scoring.wheel_rail import CONTACT_SCORERS
from railsim.errors import InputError
from railsim.truth import TIME, Truth

KMH = 3.6  # km/h in 1 m/s
SPEED = "speed [m/s]"
_KEY = re.compile(r"(?P<score>.+) \[(?P<unit>[^\]]*)\]")


def score(estimate: Estimate, truth: Truth) -> dict[str, float]:
    """How good an estimate is, by `"score [unit]"`.

    Samples that the estimate calls invalid, or where it is NaN (before it has found anything), do not count as errors;
    their share is a score of its own. Where no sample is valid, that share is the only score.

    Raises
    ------
    InputError : the estimate holds no quantity that there is a score for, or lies outside the truth in time.
    """
    found: dict[str, float] = {}
    for quantity, function in SCORERS.items():
        if quantity in estimate.series.columns:
            found |= function(estimate, truth)
    if not found:
        known = ", ".join(f"'{name}'" for name in SCORERS)
        raise InputError(f"estimate '{estimate.name}' has no column that can be scored; there are scores for {known}")
    return found


def score_rows(estimator: str, scores: dict[str, float]) -> list[dict[str, Any]]:
    """Scores in the shape of the command's JSON: estimator, score, value, unit."""
    rows = []
    for key, value in scores.items():
        parts = _KEY.fullmatch(key)
        name, unit = (parts["score"], parts["unit"]) if parts else (key, "-")
        rows.append({"estimator": estimator, "score": name, "value": value, "unit": unit})
    return rows


def speed_errors(estimate: Estimate, truth: Truth) -> tuple[np.ndarray, np.ndarray]:
    """Time [s] of every sample and its speed error [m/s], NaN where the estimate is not valid.

    Raises
    ------
    InputError : the estimate reaches beyond the truth in time.
    """
    series = estimate.series
    time = series[TIME].to_numpy()
    true = truth.time
    if len(time) and (time[0] < true[0] - 0.5 / truth.rate or time[-1] > true[-1] + 0.5 / truth.rate):
        raise InputError(
            f"estimate '{estimate.name}' covers {time[0]:g} to {time[-1]:g} s, the truth {true[0]:g} to "
            f"{true[-1]:g} s; score it on the recording that it was made from"
        )
    error = series[SPEED].to_numpy() - np.interp(time, true, truth[SPEED])
    if "valid [-]" in series.columns:
        error = np.where(series["valid [-]"].to_numpy() > 0.5, error, np.nan)
    return time, error


def _speed(estimate: Estimate, truth: Truth) -> dict[str, float]:
    """Errors of the running speed, in km/h as in Ward et al. (2011), section 5, and in m/s."""
    _, error = speed_errors(estimate, truth)
    valid = np.isfinite(error)
    if not valid.any():
        return {"valid share [-]": 0.0}
    size = np.abs(error[valid])
    rms = float(np.sqrt(np.mean(size**2)))
    found = {
        "rms error [km/h]": KMH * rms,
        "99.9 % error [km/h]": KMH * float(np.quantile(size, 0.999)),
        "largest error [km/h]": KMH * float(size.max()),
        "bias [km/h]": KMH * float(np.mean(error[valid])),
        "rms error [m/s]": rms,
        "largest error [m/s]": float(size.max()),
    }
    if "speed_std [m/s]" in estimate.series.columns:
        spread = estimate.series["speed_std [m/s]"].to_numpy()[valid]
        found["within 2 std [-]"] = float(np.mean(size <= 2.0 * spread))
    return found | {"valid share [-]": float(np.mean(valid))}


SCORERS: dict[str, Callable[[Estimate, Truth], dict[str, float]]] = (
    {SPEED: _speed} | TRACK_SCORERS | JOINT_SCORERS | CONTACT_SCORERS | ADHESION_SCORERS | SUSPENSION_SCORERS
)
"""By the column of the estimate: what scores it."""
