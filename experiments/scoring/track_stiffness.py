"""Scores of the track's stiffness along the line: a rail's static stiffness under the wheelset that felt it.

The truth of a window is the geometric mean, over its length, of the stiffness that one rail had under the wheelset
while both rails were loaded alike. Rails that do not give have none: whatever is stated of them is wrong.
"""

from typing import ClassVar

import numpy as np

from estimators.interface import Estimate
from experiments.scoring.interface import Check, Scorer
from railsim.analysis.statistics import root_mean_square
from railsim.truth import TIME, Truth

STIFFNESS, STIFFNESS_STD = "track_stiffness [N/m]", "track_stiffness_std [N/m]"
RATIO, RATIO_STD = "track_stiffness_ratio [-]", "track_stiffness_ratio_std [-]"
SOURCE = "illustrative: a zone of half the stiffness stands out by more than twice that"


class TrackStiffnessScorer(Scorer):
    """Stiffness of the rails under the wheels, and how it varies along the line."""

    columns: ClassVar[tuple[str, ...]] = (STIFFNESS, RATIO)
    needs: ClassVar[tuple[str, ...]] = ("s [m]", TIME, "valid [-]", STIFFNESS_STD, RATIO_STD)
    checks: ClassVar[tuple[Check, ...]] = tuple(
        Check(
            quantity,
            f"{quantity} relative error [-]",
            0.2,
            SOURCE,
            f"{quantity} within 2 std [-]",
            "track stiffness answered [-]",
        )
        for quantity in ("track stiffness", "ratio of track stiffness")
    )

    def score(self, estimate: Estimate, truth: Truth) -> dict[str, float]:
        """Relative errors (rms), shares within two and 1.645 stated deviations, and the share of windows answered."""
        valid = estimate.series["valid [-]"].to_numpy() > 0.5
        found = estimate.series[STIFFNESS].to_numpy()
        answered = valid & np.isfinite(found)
        if not valid.any():
            return {"track stiffness valid share [-]": 0.0}
        scores = {
            "track stiffness valid share [-]": float(np.mean(valid)),
            "track stiffness answered [-]": float(np.mean(answered[valid])),
        }
        if not answered.any():
            return scores
        true = true_stiffness(estimate, truth)[answered]
        rigid = np.isinf(true).any()
        known = {STIFFNESS: true, RATIO: true if rigid else true / np.exp(np.mean(np.log(true)))}
        for name, column, std in (
            ("track stiffness", STIFFNESS, STIFFNESS_STD),
            ("ratio of track stiffness", RATIO, RATIO_STD),
        ):
            value, deviation = (estimate.series[one].to_numpy()[answered] for one in (column, std))
            if rigid:  # the whole of the stated give is wrong
                scores |= _scored(name, np.ones(len(value)), np.zeros(len(value)))
            else:
                scores |= _scored(name, value / known[column] - 1.0, deviation / value)
        return scores


def true_stiffness(estimate: Estimate, truth: Truth) -> np.ndarray:
    """Geometric mean of the rails' stiffness in each window, N/m, shape (windows,); infinite where rails are rigid."""
    settings = estimate.about["settings"]
    length, axle = float(settings["length"]), int(settings["axle"])
    column = f"track{axle}.support_stiffness [N/m]"
    if column not in truth:
        return np.full(len(estimate.series), np.inf)
    passed = truth["s [m]"]
    area = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(passed) * np.add(*_neighbours(np.log(truth[column]))))])
    middle = np.interp(estimate.series[TIME].to_numpy(), truth.time, passed)
    ends = [np.clip(middle + sign * length / 2.0, passed[0], passed[-1]) for sign in (-1.0, 1.0)]
    forward = np.concatenate([[True], np.diff(passed) > 0.0])
    low, high = (np.interp(end, passed[forward], area[forward]) for end in ends)
    return np.exp((high - low) / np.maximum(ends[1] - ends[0], 1e-9))


def _neighbours(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return values[:-1], values[1:]


def _scored(name: str, error: np.ndarray, std: np.ndarray) -> dict[str, float]:
    return {
        f"{name} relative error [-]": root_mean_square(error),
        f"{name} within 2 std [-]": float(np.mean(np.abs(error) <= 2.0 * std)),
        f"{name} within 90 % [-]": float(np.mean(np.abs(error) <= 1.645 * std)),
        f"{name} relative std [-]": root_mean_square(std),
    }
