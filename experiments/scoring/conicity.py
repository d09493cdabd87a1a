"""Scores of conicity: over time, and over the lateral shift.

An estimator may give the conicity as a series, "conicity [-]", and as a function of the shift in its
`about["conicity_function"]`: {"shift [m]": [...], "conicity [-]": [...], "conicity_std [-]": [...], "kind": "secant" or
"local"}, see `contact_truth`.
"""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from experiments.scoring.contact_geometry import series_of, settled_rows
from experiments.scoring.interface import Check, Scorer
from experiments.scoring.wheel_rail_truth import ContactTruth, contact_truth
from railsim.analysis.statistics import root_mean_square
from railsim.truth import TIME, Truth

WINDOW = 4.0
"""Window over which the true conicity is the best fitting cone's, s."""
INNER = 0.8
"""Share of the visited range of the shift that counts as inner."""
RARE = 0.002
"""Share of the time that a bin of the shift needs to count at all."""


class ConicityScorer(Scorer):
    """Conicity by the best cone of a moving window, and as a function of the shift."""

    columns: ClassVar[tuple[str, ...]] = ("conicity [-]",)
    needs: ClassVar[tuple[str, ...]] = (TIME,)
    checks: ClassVar[tuple[Check, ...]] = (
        Check(
            "conicity",
            "conicity rms error [-]",
            0.05,
            "illustrative: an eighth of the limit at which wheels are due",
            "conicity within 2 std [-]",
            "valid share [-]",
        ),
        Check(
            "conicity over the shift",
            "function rms error by data [-]",
            0.05,
            "as of the conicity",
            "function within 2 std [-]",
            "function covered [-]",
        ),
    )

    def score(self, estimate: Estimate, truth: Truth) -> dict[str, float]:
        """Errors of the conicity over time against the cone that fits best in a moving window, and of its function."""
        true = contact_truth(truth)
        time, value, spread = series_of(estimate, "conicity [-]")
        settled = settled_rows(time, value)
        if not settled.any():
            return {"valid share [-]": 0.0}
        error = value[settled] - np.interp(time[settled], true.time, true.effective(WINDOW))
        scores = {
            "conicity rms error [-]": root_mean_square(error),
            "conicity bias [-]": float(np.mean(error)),
            "conicity largest error [-]": float(np.abs(error).max()),
        }
        if spread is not None:
            scores["conicity within 2 std [-]"] = float(np.mean(np.abs(error) <= 2.0 * spread[settled]))
        if isinstance(estimate.about.get("conicity_function"), Mapping):
            scores |= function_scores(function_errors(estimate.about["conicity_function"], true))
        return scores


def function_errors(function: Mapping[str, Any], true: ContactTruth) -> pd.DataFrame:
    """Error of a conicity function in each visited bin of the shift.

    Returns
    -------
    Columns "shift [m]", "true [-]", "estimate [-]" (NaN outside its range), "std [-]" (NaN where not stated), "share
    [-]" of the time, "inner [-]" (1 within the inner part of the visited range).
    """
    table = {name: values.to_numpy() for name, values in true.table.items()}
    common = table["share [-]"] >= RARE
    shift = table["shift [m]"][common]
    nodes = np.asarray(function["shift [m]"], dtype=float)
    outside = (shift < nodes.min()) | (shift > nodes.max())

    def at(name: str) -> np.ndarray:
        values = function.get(name)
        if values is None:
            return np.full(len(shift), np.nan)
        return np.where(outside, np.nan, np.interp(shift, nodes, np.asarray(values, dtype=float)))

    middle, half = (shift.max() + shift.min()) / 2.0, (shift.max() - shift.min()) / 2.0
    return pd.DataFrame(
        {
            "shift [m]": shift,
            "true [-]": table[f"{function.get('kind', 'secant')} [-]"][common],
            "estimate [-]": at("conicity [-]"),
            "std [-]": at("conicity_std [-]"),
            "share [-]": table["share [-]"][common],
            "inner [-]": (np.abs(shift - middle) <= INNER * half).astype(float),
        }
    )


def function_scores(errors: pd.DataFrame) -> dict[str, float]:
    """Rms errors, weighted by how often each shift was visited and not; inner part; coverage."""
    known = errors.dropna(subset=["estimate [-]"])
    if not len(known):
        return {"function covered [-]": 0.0}
    error = (known["estimate [-]"] - known["true [-]"]).to_numpy()
    share = known["share [-]"].to_numpy()
    inner = known["inner [-]"].to_numpy() > 0.5
    scores = {
        "function rms error by data [-]": float(np.sqrt(np.average(error**2, weights=share))),
        "function rms error by shift [-]": root_mean_square(error),
        "function covered [-]": float(share.sum() / errors["share [-]"].sum()),
    }
    if inner.any():
        scores["function inner rms error [-]"] = root_mean_square(error[inner])
        scores["function inner largest error [-]"] = float(np.abs(error[inner]).max())
    stated = known["std [-]"].notna().to_numpy()
    if stated.any():
        within = np.abs(error[stated]) <= 2.0 * known["std [-]"].to_numpy()[stated]
        scores["function within 2 std [-]"] = float(np.average(within, weights=share[stated]))
    return scores
