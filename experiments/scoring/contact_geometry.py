"""Scores of contact geometry over time: track and shift of a wheelset, rolling radii, contact angles."""

from collections.abc import Callable
from typing import ClassVar

import numpy as np

from estimators.interface import Estimate
from experiments.reporting.units import MM
from experiments.scoring.interface import Check, Scorer
from experiments.scoring.wheel_rail_truth import ContactTruth, contact_truth
from railsim.analysis.statistics import root_mean_square
from railsim.truth import TIME, Truth

SETTLE = 10.0
"""What an online estimator has to converge, s; earlier samples do not count."""
SLOW = 1.0
"""Track positions are compared with their mean over so many s taken out: absolute place cannot be known, s."""
_READ: dict[str, Callable[[ContactTruth], np.ndarray]] = {
    "track_lateral [m]": lambda true: true.track,
    "wheelset1.lateral_shift [m]": lambda true: true.shift,
    "sum_of_radii [m]": lambda true: true.sum_of_radii,
    "difference_of_radii [m]": lambda true: 2.0 * true.half_difference,
    "sum_of_angles [rad]": lambda true: true.sum_of_angles,
    "difference_of_angles [rad]": lambda true: true.difference_of_angles,
}
"""By the column of an estimate: what is true of it."""


_ALLOWED = {
    "track_lateral [m]": (0.72, "EN 13848-2, alignment in D2, see `experiments.scoring.track`"),
    "wheelset1.lateral_shift [m]": (1.0, "illustrative: a seventh of the way to the flange"),
    "sum_of_radii [m]": (0.3, "conicity 0.05 over 3 mm on both wheels"),
    "difference_of_radii [m]": (0.3, "conicity 0.05 over 3 mm on both wheels"),
    "sum_of_angles [rad]": (50.0, "illustrative: a slope of 0.05"),
    "difference_of_angles [rad]": (50.0, "illustrative: a slope of 0.05"),
}
"""By column: allowed rms error in mm or mrad, and why."""


def _check(column: str) -> Check:
    name, unit = column.removesuffix("]").split(" [")
    allowed, source = _ALLOWED[column]
    error = f"{name} rms error [m{unit}]"
    return Check(name.replace("_", " "), error, allowed, source, f"{name} within 2 std [-]", f"{name} valid share [-]")


class ContactGeometryScorer(Scorer):
    """Lateral positions, sums and differences of rolling radii and of contact angles."""

    columns: ClassVar[tuple[str, ...]] = tuple(_READ)
    needs: ClassVar[tuple[str, ...]] = (TIME,)
    checks: ClassVar[tuple[Check, ...]] = tuple(map(_check, _ALLOWED))

    def score(self, estimate: Estimate, truth: Truth) -> dict[str, float]:
        """Errors of each column that the estimate has."""
        true = contact_truth(truth)
        scores: dict[str, float] = {}
        for column in self.columns_of(estimate):
            scores |= _signal_scores(column, estimate, true)
        return scores


def _signal_scores(column: str, estimate: Estimate, true: ContactTruth) -> dict[str, float]:
    """Rms error of a series in mm or mrad, in per cent of the true range, and coverage."""
    time, value, spread = series_of(estimate, column)
    settled = settled_rows(time, value)
    name, unit = column.removesuffix("]").split(" [")
    if not settled.any():
        return {f"{name} valid share [-]": 0.0}
    actual = np.interp(time, true.time, _READ[column](true))
    error = value - actual
    if column == "track_lateral [m]":
        error = error - _moving_mean(np.where(np.isfinite(error), error, 0.0), time)
    error = error[settled]
    low, high = np.quantile(actual[settled], [0.005, 0.995])
    scores = {
        f"{name} rms error [m{unit}]": MM * root_mean_square(error),
        f"{name} rms error of range [-]": root_mean_square(error) / max(high - low, 1e-12),
    }
    if spread is not None:
        scores[f"{name} within 2 std [-]"] = float(np.mean(np.abs(error) <= 2.0 * spread[settled]))
    return scores


def settled_rows(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Rows that count: those with a value, after `SETTLE`, or in the later half of a shorter record, shape (n,)."""
    return np.isfinite(values) & (time >= min(SETTLE, time[-1] / 2.0))


def series_of(estimate: Estimate, column: str) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Time, values and standard deviation (None where not stated) of a column."""
    series = estimate.series
    name, unit = column.removesuffix("]").split(" [")
    std = f"{name}_std [{unit}]"
    spread = series[std].to_numpy() if std in series.columns else None
    return series[TIME].to_numpy(), series[column].to_numpy(), spread


def _moving_mean(values: np.ndarray, time: np.ndarray) -> np.ndarray:
    count = max(1, round(SLOW / max(float(np.median(np.diff(time))), 1e-9)))
    weights = np.ones(count) / count
    return np.convolve(values, weights, mode="same") / np.convolve(np.ones_like(values), weights, mode="same")
