"""What has changed since earlier passes, and whether it is more than errors of estimates and of their alignment.

Earlier passes are laid on the latest one by correlation (`estimators.track.passes`). A section's standard deviation is
off by no more than the root mean square of the stated deviations, however errors hang together (triangle inequality);
that of both passes and what the alignment leaves open make the error of a change.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from estimators.track.passes import APART, WINDOW, Match, changes, laid_on, match
from experiments.maintenance.condition import ENOUGH, bands_of, error_of, valid_of
from experiments.maintenance.limits import split
from experiments.maintenance.sections import KEYS, quantities, spans
from experiments.reporting.units import MM
from railsim.analysis.statistics import root_mean_square
from railsim.errors import InputError

SECTION_FACTOR = 2.0
"""Errors beyond which a section is said to have changed; the error is a bound, not a standard deviation."""
PLACE_FACTOR = 3.0
"""Standard deviations beyond which a place is; there are many places."""
LEAST = 0.3
"""mm, smallest change of a place that is reported: what passes must agree to."""
FEWEST = 2  # windows that must be found again
_ALIGNED_BY = ("vertical", "left_vertical", "cross_level", "lateral")


@dataclass(frozen=True)
class Earlier:
    """An earlier pass on the grid of the latest one.

    Attributes
    ----------
    values, errors : of each quantity that both have, by column, m or m/m, NaN where it is not known or not found again.
    slip : standard deviation of what the alignment leaves open, m.
    """

    values: dict[str, np.ndarray]
    errors: dict[str, np.ndarray]
    slip: float


def laid(earlier: Estimate, latest: Estimate) -> Earlier:
    """The earlier pass on the grid of the latest one.

    Raises
    ------
    InputError : they have no quantity in common, other grids, or no stretch of the one is found in the other.
    """
    shared = [name for name in quantities(latest) if name in earlier.series.columns]
    guide = next((f"{one}_d1 [m]" for one in _ALIGNED_BY if f"{one}_d1 [m]" in shared), None)
    if guide is None:
        raise InputError(
            f"the estimates of {earlier.name} and {latest.name} have no band D1 in common to align them by; "
            "compare estimates of one estimator"
        )
    spacing = _spacing(latest)
    if abs(_spacing(earlier) / spacing - 1.0) > 1e-6:
        raise InputError(
            f"the estimates of {earlier.name} and {latest.name} have rows at other distances; "
            "make both with one estimator"
        )
    now, before = (np.where(valid_of(one.series), one.series[guide].to_numpy(), np.nan) for one in (latest, earlier))
    pairing = match(now, before, spacing)
    if len(pairing.distance) < FEWEST:
        raise InputError(
            f"no stretch of the earlier pass is found in the latest one by {guide.split(' ')[0]}; is it the same "
            "track, travelled in the same direction?"
        )
    grid = spacing * np.arange(len(now))
    found = _near(grid, pairing.distance)
    valid = valid_of(earlier.series)
    values, errors = {}, {}
    for name in shared:
        whole = np.where(valid, earlier.series[name].to_numpy(), np.nan)
        values[name] = np.where(found, laid_on(whole, spacing, pairing, grid), np.nan)
        errors[name] = laid_on(error_of(earlier.series, name), spacing, pairing, grid)
    return Earlier(values, errors, _slip(now, values[guide], spacing))


def changed_sections(latest: Estimate, earlier: Sequence[Earlier], length: float) -> pd.DataFrame:
    """Change of the standard deviation of every section since the mean of the earlier passes, over what all know.

    Returns
    -------
    Columns "from [m]", "quantity", "band", "before [mm or mm/m]", "change [mm or mm/m]", "change error [mm or mm/m]",
    "change over error [-]", "changed": "grown", "less", "no" (within `SECTION_FACTOR` errors), or "" where nothing can
    be said, as the passes have too little in common or state no errors.
    """
    distance = latest.series["s [m]"].to_numpy()
    valid = valid_of(latest.series)
    rows = []
    for name in quantities(latest):
        passes = [one for one in earlier if name in one.values]
        now, error = np.where(valid, latest.series[name].to_numpy(), np.nan), error_of(latest.series, name)
        shared = np.isfinite(now) & np.all([np.isfinite(one.values[name]) for one in passes], axis=0) & bool(passes)
        quantity, band = split(name)
        for start, first, end in spans(distance, length):
            rows.append({"from [m]": start, "quantity": quantity, "band": band, **_NOTHING})
            inside = first + np.flatnonzero(shared[first:end])
            if len(inside) >= ENOUGH * (end - first):
                sizes = [_spread(one.values[name][inside]) for one in passes]
                parts = [_error_of_spread(now[inside], error[inside], max(one.slip for one in passes), length)]
                parts += [root_mean_square([root_mean_square(one.errors[name][inside]) for one in passes])]
                parts += [float(np.std(sizes, ddof=1))] if len(sizes) > 1 else []
                before, whole = float(np.mean(sizes)), float(np.sqrt(np.sum(np.square(parts))))
                rows[-1] |= _judged(before, _spread(now[inside]) - before, whole, SECTION_FACTOR)
    return pd.DataFrame(rows)


def changed_places(latest: Estimate, earlier: Sequence[Earlier]) -> pd.DataFrame:
    """Places at which D1 has changed by more than `LEAST`, `PLACE_FACTOR` standard deviations of the difference and six
    of its own spread, the largest first.

    Returns
    -------
    Columns "quantity", "s [m]", "time [s]", "before", "now", "change", "change error [mm]", "change over error [-]",
    "length [m]", "changed": "grown" or "less".
    """
    series = latest.series
    distance, time, valid = series["s [m]"].to_numpy(), series["time [s]"].to_numpy(), valid_of(series)
    spacing = _spacing(latest)
    rows = []
    for name in [one for one in bands_of(series) if "_d1 " in one]:
        passes = [one for one in earlier if name in one.values]
        if not passes:
            continue
        now = np.where(valid, series[name].to_numpy(), np.nan)
        before, error = difference_error(name, now, error_of(series, name), passes, spacing)
        least = np.maximum(LEAST / MM, PLACE_FACTOR * np.nan_to_num(error, nan=np.inf))
        for event in changes(before, now, spacing, least):
            at = round(event["s [m]"] / spacing)
            row = {"quantity": name.split(" ")[0], "s [m]": distance[at], "time [s]": time[at]}
            row |= {"now [mm]": MM * now[at], "length [m]": event["length [m]"]}
            judged = _judged(float(before[at]), event["change [m]"], float(error[at]), 0.0, float(now[at]))
            rows.append(row | {key.replace(" or mm/m", ""): value for key, value in judged.items()})
    rows.sort(key=lambda row: -abs(row["change [mm]"]))
    return pd.DataFrame(rows, columns=_PLACE)


def changes_at(latest: Estimate, earlier: Sequence[Earlier], found: pd.DataFrame) -> pd.DataFrame:
    """What earlier passes had where `condition.defects` found something: "before", "change", "change error", "changed",
    in the order of the defects; the change counts beyond `PLACE_FACTOR` standard deviations.
    """
    series = latest.series
    distance, spacing, valid = series["s [m]"].to_numpy(), _spacing(latest), valid_of(series)
    columns = {name.split(" ")[0]: name for name in quantities(latest)}
    known: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]] = {}
    rows = []
    for quantity, place in zip(found["quantity"], found["s [m]"], strict=True):
        name = columns[quantity]
        passes = [one for one in earlier if name in one.values]
        if passes and name not in known:
            now = np.where(valid, series[name].to_numpy(), np.nan)
            known[name] = (now, *difference_error(name, now, error_of(series, name), passes, spacing))
        row = dict(_NOTHING)
        if name in known:
            now, before, error = (one[int(np.argmin(np.abs(distance - place)))] for one in known[name])
            row = _judged(before, now - before, error, PLACE_FACTOR, now) if np.isfinite(before) else row
        rows.append(row)
    return pd.DataFrame(rows, columns=list(_NOTHING), index=found.index)


_PLACE = [
    "quantity", "s [m]", "time [s]", "before [mm]", "now [mm]", "change [mm]", "change error [mm]",
    "change over error [-]", "changed", "length [m]",
]  # fmt: skip
_NOTHING = {
    "before [mm or mm/m]": np.nan, "change [mm or mm/m]": np.nan, "change error [mm or mm/m]": np.nan,
    "change over error [-]": np.nan, "changed": "",
}  # fmt: skip


def difference_error(
    name: str, now: np.ndarray, error: np.ndarray, passes: Sequence[Earlier], spacing: float
) -> tuple[np.ndarray, np.ndarray]:
    """(mean of the earlier passes, standard deviation of what is now less that) at every place, m.

    Errors of passes by the same chain hang together, so that the mean of several counts as exact as one of them. What
    the alignment leaves open moves the value by its slope.
    """
    before = np.mean([one.values[name] for one in passes], axis=0)
    stated = np.mean([np.square(one.errors[name]) for one in passes], axis=0)
    slip = max(one.slip for one in passes) * np.gradient(now, spacing) if len(now) > 1 else 0.0
    return before, np.sqrt(np.square(error) + stated + np.square(slip))


def with_changes(rows: pd.DataFrame, changed: pd.DataFrame) -> pd.DataFrame:
    """Rows of `section_rows` with what `changed_sections` says of the same sections."""
    return rows.merge(changed, on=[one for one in KEYS if one != "to [m]"], how="left")


def _judged(before: float, change: float, error: float, factor: float, now: float = np.nan) -> dict[str, Any]:
    """What is said of a change; `now`: of a place, whose size may change its sign."""
    grown = change > 0.0 if np.isnan(now) else abs(now) > abs(before)
    word = "" if not np.isfinite(error) else "no" if abs(change) <= factor * error else "grown" if grown else "less"
    return {
        "before [mm or mm/m]": MM * before, "change [mm or mm/m]": MM * change, "change error [mm or mm/m]": MM * error,
        "change over error [-]": change / error if error > 0.0 else np.nan, "changed": word,
    }  # fmt: skip


def _error_of_spread(values: np.ndarray, error: np.ndarray, slip: float, length: float) -> float:
    """Bound of the error of a section's standard deviation by stated deviations and by a shift of its ends, m."""
    ends = abs(values[-1] ** 2 - values[0] ** 2) / (2.0 * max(_spread(values), 1e-12) * length)
    return float(np.hypot(root_mean_square(error), slip * ends))


def _spread(values: np.ndarray) -> float:
    return float(np.std(values))


def _spacing(estimate: Estimate) -> float:
    distance = estimate.series["s [m]"].to_numpy()
    if len(distance) < 2:
        raise InputError(f"the estimate of {estimate.name} has fewer than two rows; estimate from a longer recording")
    return float(np.median(np.diff(distance)))


def _near(grid: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Where a window that was found again lies within its length."""
    after = np.clip(np.searchsorted(found, grid), 1, len(found) - 1)
    return np.minimum(np.abs(grid - found[after - 1]), np.abs(found[after] - grid)) <= WINDOW


def _slip(now: np.ndarray, before: np.ndarray, spacing: float) -> float:
    """Standard deviation of the lags that are left once the passes lie on each other, m, half a row at least."""
    left: Match = match(now, before, spacing)
    return max(root_mean_square(left.lag) if len(left.lag) else APART, 0.5 * spacing)
