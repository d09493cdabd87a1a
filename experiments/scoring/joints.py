"""Scores of dips that an estimator found: joints, crossings and voids against the features of the true track.

A true dip is what lies within `ABREAST` of another on either rail; its size is the mean of both rails, as a bogie feels
it. An event belongs to the dip that was nearest to the bogie's centre at the event's time, so that a wrong odometer
does not spoil the comparison.
"""

from typing import Any, ClassVar, NamedTuple

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from experiments.scoring.interface import Check, Scorer
from railsim.analysis.statistics import root_mean_square
from railsim.track.features import Feature, from_stated
from railsim.truth import TIME, Truth

NEAR = 0.5
"""An event farther from every dip is a false one, m."""
ABREAST = 0.5
"""Dips of both rails that are this close are one, m."""
ENDS = 5.0
"""Dips closer than this to an end of the record, or of a valid stretch of it, do not count, m."""


class TrueDip(NamedTuple):
    """Place m, depth m and angle rad of both rails' mean, rail ("left", "right", "both")."""

    s: float
    depth: float
    angle: float
    side: str


class JointScorer(Scorer):
    """Dips of joints, crossings and voids that were found."""

    columns: ClassVar[tuple[str, ...]] = ("dip_snr [-]",)
    needs: ClassVar[tuple[str, ...]] = (TIME, "valid [-]")
    checks: ClassVar[tuple[Check, ...]] = (
        Check("dips", "missed or false dips [-]", 0.1, "illustrative: nine dips in ten, at most one false among ten"),
        Check(
            "depth of dips",
            "rms relative error of depth [-]",
            0.25,
            "illustrative: a quarter",
            "depth within 2 std [-]",
        ),
    )

    def score(self, estimate: Estimate, truth: Truth) -> dict[str, float]:
        """Recall, precision, and errors of position, depth, angle and side of the dips that were found."""
        table = matched(estimate, truth)
        columns = {str(name): np.asarray(table[name]) for name in table.columns}
        true, detected = np.isfinite(columns["true s [m]"]), np.isfinite(columns["s [m]"])
        scores = {"true dips [-]": float(true.sum()), "events [-]": float(detected.sum())}
        if true.any():
            scores["recall [-]"] = float(detected[true].mean())
        if detected.any():
            scores["precision [-]"] = float(true[detected].mean())
        scores["missed or false dips [-]"] = float(np.mean(true != detected)) if len(true) else 0.0
        hits = {name: values[true & detected] for name, values in columns.items()}
        return scores | (_sizes(hits) if len(hits["s [m]"]) else {})


def true_dips(truth: Truth) -> list[TrueDip]:
    """Dips that the run's track states, in the order of distance."""
    return [_joined(group) for group in true_groups(truth)]


def true_groups(truth: Truth) -> list[list[Feature]]:
    """Features that make each dip: those of both rails that are abreast are one."""
    features = [from_stated(values) for values in truth.about.get("features", [])]
    groups: list[list[Feature]] = []
    for feature in sorted(
        (one for one in features if one.depth is not None and one.length is None), key=lambda one: one.s
    ):
        if groups and feature.s - groups[-1][0].s < ABREAST:
            groups[-1].append(feature)
        else:
            groups.append([feature])
    return groups


def matched(estimate: Estimate, truth: Truth) -> pd.DataFrame:
    """One row for each true dip that counts, and for each false event.

    Returns
    -------
    Columns "true s [m]", "true depth [m]", "true angle [rad]", "true side" (NaN, "" in rows of false events), "s [m]"
    (where the bogie's centre truly was at the event's time), "depth [m]", "depth_std [m]", "angle [rad]", "side" (NaN,
    "" where the dip was missed).
    """
    true = truth["s [m]"]
    every = true_dips(truth)
    dips = [dip for dip in every if _counts(dip.s, estimate, truth)]
    events = list(estimate.about.get("events", []))
    distances = np.array([np.interp(event["time [s]"], truth.time, true) for event in events])
    free = np.ones(len(events), dtype=bool)
    rows: list[dict[str, Any]] = []
    for dip in dips:
        row: dict[str, Any] = {"true s [m]": dip.s, "true depth [m]": dip.depth, "true angle [rad]": dip.angle}
        row["true side"] = dip.side
        distance = np.where(free, np.abs(distances - dip.s), np.inf)
        if distance.size and distance.min() < NEAR:
            nearest = int(distance.argmin())
            free[nearest] = False
            row |= _event_columns(events[nearest], float(distances[nearest]))
        rows.append(row)
    everything = np.array([dip.s for dip in every])
    for i in np.flatnonzero(free):
        if not everything.size or np.abs(everything - distances[i]).min() > NEAR:
            rows.append(_event_columns(events[i], float(distances[i])))
    numbers = ("true s [m]", "true depth [m]", "true angle [rad]", "s [m]", "depth [m]", "depth_std [m]", "angle [rad]")
    table: dict[str, Any] = {name: np.array([row.get(name, np.nan) for row in rows], dtype=float) for name in numbers}
    texts = {name: np.array([row.get(name, "") for row in rows], dtype=object) for name in ("true side", "side")}
    return pd.DataFrame(table | texts)


def _sizes(hits: dict[str, np.ndarray]) -> dict[str, float]:
    """Errors of the dips that were found."""
    true_depth, true_angle = hits["true depth [m]"], hits["true angle [rad]"]
    depth = hits["depth [m]"] / true_depth - 1
    angled = true_angle > 0
    scores = {
        "rms error of position [m]": root_mean_square(hits["s [m]"] - hits["true s [m]"]),
        "rms relative error of depth [-]": root_mean_square(depth),
        "depth within 15 % [-]": float(np.mean(np.abs(depth) <= 0.15)),
        "depth within 2 std [-]": float(np.mean(np.abs(depth * true_depth) <= 2 * hits["depth_std [m]"])),
    }
    if angled.any():
        scores["rms relative error of angle [-]"] = root_mean_square(
            hits["angle [rad]"][angled] / true_angle[angled] - 1
        )
    if (hits["side"] != "unknown").any():
        scores["rail named rightly [-]"] = float(np.mean(hits["side"] == hits["true side"]))
    return scores


def _joined(group: list[Feature]) -> TrueDip:
    """Mean of both rails; one rail alone counts half."""
    shares = [1.0 if one.side == "both" else 0.5 for one in group]
    depth = sum(share * (one.depth or 0.0) for share, one in zip(shares, group, strict=True))
    angle = sum(share * (one.angle or 0.0) for share, one in zip(shares, group, strict=True))
    sides = {one.side for one in group}
    return TrueDip(group[0].s, depth, angle, sides.pop() if len(sides) == 1 else "both")


def _counts(s: float, estimate: Estimate, truth: Truth) -> bool:
    """Whether the record is valid for `ENDS` on both sides of a place."""
    series = estimate.series
    distance = np.interp(np.asarray(series[TIME]), truth.time, truth["s [m]"])
    valid = np.asarray(series["valid [-]"]) > 0.5
    near = np.abs(distance - s) <= ENDS
    return bool(distance[0] <= s - ENDS and distance[-1] >= s + ENDS and valid[near].all())


def _event_columns(event: dict[str, Any], distance: float) -> dict[str, Any]:
    sizes = {key: event.get(key, np.nan) for key in ("depth [m]", "depth_std [m]", "angle [rad]")}
    return {"s [m]": distance, **sizes, "side": event.get("side", "")}
