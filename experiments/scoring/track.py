"""Scores of track geometry: an estimate over distance against the true rails, by wavelength band.

The true geometry under the bogie's centre is found by time: where the estimate says the bogie was at `time [s]`, truth
says where it really was, so that a wrong odometer does not spoil the comparison. Both go through the same filters on
the estimate's grid. What lies within a band's longest wavelength of the ends of the grid does not count.
"""

from typing import ClassVar

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from estimators.signals.bands import Band, band_pass, bands_of, settled
from estimators.speed.odometry import Odometry
from experiments.reporting.units import MM
from experiments.scoring.interface import Check, Scorer, stated
from railsim.analysis.statistics import root_mean_square
from railsim.errors import InputError
from railsim.truth import TIME, Truth

S = "s [m]"
CANT, TWIST = "cant [m]", "twist [m/m]"
VALID = "valid [-]"
QUANTITIES = (
    "vertical",
    "lateral",
    "cross_level",
    "gauge_deviation",
    "left_vertical",
    "right_vertical",
    "left_lateral",
    "right_lateral",
)
"""Irregularities that are scored band by band."""
_DESIGN = {
    "lateral": ("curvature [1/m]", 2),
    "left_lateral": ("curvature [1/m]", 2),
    "right_lateral": ("curvature [1/m]", 2),
    "cross_level": ("cant [m]", 0),
}
"""What of the design a sensor on the vehicle cannot tell from irregularity, and how often it must be integrated."""
_RAILS = ("left_vertical", "right_vertical", "left_lateral", "right_lateral", "curvature", "cant")


_REPEATABILITY = "EN 13848-2, repeatability, as quoted in secondary sources"
_PAIR = 1.96 * 2.0**0.5
"""95 % of the differences of two measurements lie within so many rms errors of one."""
_LIMITS = {
    "vertical": (0.5, 1.0),
    "lateral": (0.7, 2.0),
    "cross_level": (1.5, 1.5),
    "gauge_deviation": (0.5, 0.5),
}
"""Repeatability in D1 and D2, mm: what 95 % of the differences of two measurements may be at most. That of alignment
and longitudinal level is the standard's for each band; cross level and gauge are not given by band there.
"""
_TWIST_LIMIT = 0.7  # mm/m, likewise


def _checks() -> tuple[Check, ...]:
    checks = []
    for quantity in QUANTITIES:
        limits = _LIMITS[quantity.removeprefix("left_").removeprefix("right_")]
        for band, limit in zip(("D1", "D2"), limits, strict=True):
            label = f"{quantity} {band}"
            checks.append(
                Check(
                    label.replace("_", " "),
                    f"{label} rms error [mm]",
                    limit / _PAIR,
                    f"{_REPEATABILITY}: {limit:g} mm",
                    f"{label} within 2 std [-]",
                    f"{label} scored share [-]",
                )
            )
    level, source = _LIMITS["cross_level"][0], f"{_REPEATABILITY}: "
    checks += [
        Check(
            "cant",
            "cant rms error [mm]",
            level / _PAIR,
            f"{source}{level:g} mm",
            "cant within 2 std [-]",
            "cant scored share [-]",
        ),
        Check(
            "twist",
            "twist rms error [mm/m]",
            _TWIST_LIMIT / _PAIR,
            f"{source}{_TWIST_LIMIT:g} mm/m",
            "twist within 2 std [-]",
            "twist scored share [-]",
        ),
    ]
    return tuple(checks)


class TrackScorer(Scorer):
    """Irregularities band by band, cant and twist."""

    columns: ClassVar[tuple[str, ...]] = (*(f"{quantity} [m]" for quantity in QUANTITIES), CANT, TWIST)
    needs: ClassVar[tuple[str, ...]] = (S, TIME)
    checks: ClassVar[tuple[Check, ...]] = _checks()

    def score(self, estimate: Estimate, truth: Truth) -> dict[str, float]:
        """Errors of each quantity that the estimate has."""
        scores: dict[str, float] = {}
        for column in self.columns_of(estimate):
            if column == CANT:
                scores |= score_cant(estimate, truth)
            elif column == TWIST:
                scores |= score_twist(estimate, truth)
            else:
                scores |= score_quantity(column.removesuffix(" [m]"), estimate, truth)
        return scores


def true_track(truth: Truth, time: np.ndarray, spacing: float) -> pd.DataFrame:
    """True geometry at the place of the bogie's centre at the instants `time`.

    Parameters
    ----------
    time : s, increasing, about `spacing` metres of travel apart, shape (n,).
    spacing : m; what is shorter than two of it is filtered out as in the estimates.

    Returns
    -------
    Columns "s [m]" (true distance) and `QUANTITIES`, "curvature [1/m]", "cant [m]" (design, without cross level).

    Raises
    ------
    InputError : the instants reach beyond the truth.
    """
    if len(time) and (time[0] < truth.time[0] - 1.0 / truth.rate or time[-1] > truth.time[-1] + 1.0 / truth.rate):
        raise InputError(
            f"the estimate covers {time[0]:g} to {time[-1]:g} s, the truth {truth.time[0]:g} to {truth.time[-1]:g} s; "
            "score it on the recording that it was made from"
        )
    centre = truth["s [m]"]
    arm = float(truth.about.get("vehicle", {}).get("semi_wheelbase [m]", 0.0))
    at = np.interp(time, truth.time, centre)
    table = {S: at}
    for name in _RAILS:
        unit = "1/m" if name == "curvature" else "m"
        table[name] = _under(truth, f"{name} [{unit}]", centre, arm, at, spacing)
    left, right = table["left_vertical"], table["right_vertical"]
    table["vertical"], table["cross_level"] = (left + right) / 2, right - left
    left, right = table["left_lateral"], table["right_lateral"]
    table["lateral"], table["gauge_deviation"] = (left + right) / 2, left - right
    units = {name: "1/m" if name == "curvature" else "m" for name in table if name != S}
    return pd.DataFrame(table).rename(columns={name: f"{name} [{unit}]" for name, unit in units.items()})


def band_errors(
    estimate: Estimate, truth: Truth, quantity: str, band: str, true: pd.DataFrame | None = None
) -> pd.DataFrame:
    """True and estimated band of a quantity over distance, only rows that count.

    The true lateral path has the design curve in it, the true cross level the design cant: what the filter leaves.
    `true` is what `true_track` gives for the estimate, where that is at hand.

    Returns
    -------
    Columns "s [m]" (true distance), "true [m]", "estimated [m]", "std [m]" (NaN where not stated).
    """
    series = estimate.series
    spacing = float(np.median(np.diff(series[S])))
    edges = bands_of(quantity)[band]
    true = true_track(truth, series[TIME].to_numpy(), spacing) if true is None else true
    wanted = band_pass(true[f"{quantity} [m]"].to_numpy(), spacing, edges)
    if quantity in _DESIGN:
        name, integrate = _DESIGN[quantity]
        wanted += band_pass(true[name].to_numpy(), spacing, edges, integrate)
    estimated = estimated_band(estimate, quantity, band)
    counts = settled(np.ones(len(estimated), dtype=bool), spacing, edges.longest) & np.isfinite(estimated)
    name = f"{quantity}_{band}_std [m]"
    spread = series[name].to_numpy() if name in series.columns else np.full(len(estimated), np.nan)
    table = {S: true[S].to_numpy(), "true [m]": wanted, "estimated [m]": estimated, "std [m]": spread}
    return pd.DataFrame({key: values[counts] for key, values in table.items()})


def estimated_band(estimate: Estimate, quantity: str, band: str) -> np.ndarray:
    """The band as the estimate states it, or else out of the whole quantity, m; NaN where not valid, shape (n,).

    Out of the whole, what lies within the longest wavelength of a gap is left out.
    """
    series = estimate.series
    valid = series[VALID].to_numpy() > 0.5 if VALID in series.columns else np.ones(len(series), dtype=bool)
    name = f"{quantity}_{band} [m]"
    if name in series.columns:
        return np.where(valid, series[name].to_numpy(), np.nan)
    spacing = float(np.median(np.diff(series[S])))
    edges: Band = bands_of(quantity)[band]
    whole = np.where(valid, series[f"{quantity} [m]"].to_numpy(), np.nan)
    found = band_pass(whole, spacing, edges)
    return np.where(settled(np.isfinite(whole), spacing, edges.longest), found, np.nan)


def score_quantity(quantity: str, estimate: Estimate, truth: Truth) -> dict[str, float]:
    """Errors band by band, beside the true size of the band, and how many lie within two standard deviations.

    Where an estimate gives some bands in columns of their own, it says nothing of the others.
    """
    scores: dict[str, float] = {}
    series = estimate.series
    given = [band for band in bands_of(quantity) if f"{quantity}_{band} [m]" in series.columns]
    true = true_track(truth, series[TIME].to_numpy(), float(np.median(np.diff(series[S]))))
    for band in given or bands_of(quantity):
        rows = band_errors(estimate, truth, quantity, band, true)
        label = f"{quantity} {band.upper()}"
        scores[f"{label} scored share [-]"] = len(rows) / max(len(estimate.series), 1)
        if rows.empty:
            continue
        error = (rows["estimated [m]"] - rows["true [m]"]).to_numpy()
        scores[f"{label} rms error [mm]"] = MM * root_mean_square(error)
        scores[f"{label} true rms [mm]"] = MM * root_mean_square(rows["true [m]"].to_numpy())
        spread = rows["std [m]"].to_numpy()
        if np.isfinite(spread).all():
            scores[f"{label} within 2 std [-]"] = float(np.mean(np.abs(error) <= 2.0 * spread))
    return scores


def score_cant(estimate: Estimate, truth: Truth) -> dict[str, float]:
    """Error of the absolute cant, cross level in it, and of its mean."""
    time, spacing = estimate.series[TIME].to_numpy(), float(np.median(np.diff(estimate.series[S])))
    true = true_track(truth, time, spacing)
    error = estimate.series["cant [m]"].to_numpy() - (true["cant [m]"] + true["cross_level [m]"]).to_numpy()
    return _plain("cant", error, estimate, "m")


def score_twist(estimate: Estimate, truth: Truth) -> dict[str, float]:
    """Error of the twist over the base that the estimate states, cant ramps in it."""
    base = stated(estimate, "twist_base [m]")
    series = estimate.series
    spacing = float(np.median(np.diff(series[S])))
    true = true_track(truth, series[TIME].to_numpy(), spacing)
    level = (true["cant [m]"] + true["cross_level [m]"]).to_numpy()
    places = series[S].to_numpy()
    ahead, behind = (np.interp(places + x, places, level, np.nan, np.nan) for x in (base / 2, -base / 2))
    error = series["twist [m/m]"].to_numpy() - (ahead - behind) / base
    return _plain("twist", error, estimate, "m/m")


def _plain(what: str, error: np.ndarray, estimate: Estimate, unit: str) -> dict[str, float]:
    valid = np.isfinite(error)
    if VALID in estimate.series.columns:
        valid &= estimate.series[VALID].to_numpy() > 0.5
    scores = {f"{what} scored share [-]": float(np.mean(valid))}
    if valid.any():
        scores[f"{what} rms error [m{unit}]"] = MM * root_mean_square(error[valid])
        scores[f"{what} bias [m{unit}]"] = MM * float(np.mean(error[valid]))
        std = f"{what}_std [{unit}]"
        if std in estimate.series.columns:
            spread = estimate.series[std].to_numpy()[valid]
            scores[f"{what} within 2 std [-]"] = float(np.mean(np.abs(error[valid]) <= 2.0 * spread))
    return scores


def _under(truth: Truth, name: str, centre: np.ndarray, arm: float, at: np.ndarray, spacing: float) -> np.ndarray:
    """A track channel at the places `at` of the bogie's centre: seen by the leading wheelset, at first by the other."""
    key = "track over distance", name, arm, spacing
    distance, smooth = truth.derived(key, lambda: _over_distance(truth, name, centre, arm, spacing))
    trail = f"track2.{name}"
    return np.interp(at - (centre[0] + arm if trail not in truth else centre[0] - arm), distance, smooth)


def _over_distance(truth: Truth, name: str, centre: np.ndarray, arm: float, spacing: float) -> np.ndarray:
    """Places `spacing` apart from the first that a wheelset sees, m, and the channel there, shape (2, n)."""
    lead, trail = f"track1.{name}", f"track2.{name}"
    distance, values = centre + arm, truth[lead]
    if trail in truth:
        early = centre - arm < distance[0]
        distance = np.concatenate([(centre - arm)[early], distance])
        values = np.concatenate([truth[trail][early], values])
    moved = np.concatenate([[True], np.diff(np.maximum.accumulate(distance)) > 1e-6])
    distance, values = distance[moved] - distance[0], values[moved]
    odometry = Odometry(distance, distance, np.ones(len(distance)), np.ones(len(distance), dtype=bool), 0.0, spacing)
    smooth, _ = odometry.resample(distance, values)
    return np.stack([odometry.s, smooth])
