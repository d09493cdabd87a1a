"""A row for each section, quantity and band: standard deviation, peak, level and class by the line speed."""

from typing import Any

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from experiments.maintenance.condition import ENOUGH, SURE, bands_of, error_of, level_of, valid_of
from experiments.maintenance.limits import CLASS_SECTION, LEVELS, Limits, shipped, split
from experiments.maintenance.line_speed import TRAVELLED, LineSpeed
from experiments.reporting.units import MM
from railsim.analysis.statistics import root_mean_square

KEYS = ("from [m]", "to [m]", "quantity", "band")
"""Columns that name a row."""
TWIST = "twist [m/m]"


def quantities(estimate: Estimate) -> list[str]:
    """Columns that sections are stated of: bands, and twist."""
    return [*bands_of(estimate.series), *([TWIST] if TWIST in estimate.series.columns else [])]


def section_rows(
    estimate: Estimate, length: float, limits: Limits | None = None, speed: LineSpeed = TRAVELLED
) -> pd.DataFrame:
    """The condition by section.

    Parameters
    ----------
    length : of a section, m; sections begin at multiples of it.
    limits : None: those that come with railsim.
    speed : line speed by place; the highest of a section decides on its class.

    Returns
    -------
    Columns `KEYS`; "valid [-]" (share); "std [mm or mm/m]" and "std error" (the root mean square of the stated
    deviations: the standard deviation of a section is not farther off, however the errors hang together); "peak"
    (signed), "peak error" and "peak at [m]"; "line speed [km/h]"; "level", "could be" (at two stated deviations more);
    "class" (of sections of 200 m). Of what is valid for less than half of the section nothing is stated but the share.
    """
    series = estimate.series
    distance, time = series["s [m]"].to_numpy(), series["time [s]"].to_numpy()
    fastest = speed.at(distance, time)
    good = valid_of(series)
    ends = spans(distance, length)
    rows: list[dict[str, Any]] = []
    for name in quantities(estimate):
        limit = (limits or shipped()).peaks(name, fastest)
        values, error = np.where(good, series[name].to_numpy(), np.nan), error_of(series, name)
        quantity, band = split(name)
        for start, first, end in ends:
            inside = slice(first, end)
            row = {"from [m]": start, "to [m]": min(start + length, float(distance[-1])), "quantity": quantity}
            row |= {"band": band, **_numbers(values[inside], error[inside], distance[inside], fastest[inside])}
            row |= _levels(values[inside], error[inside], None if limit is None else limit[inside])
            whole = length == CLASS_SECTION
            quality = (limits or shipped()).quality(name, row["std [mm or mm/m]"], row["line speed [km/h]"])
            rows.append(row | {"class": quality if whole else ""})
    return pd.DataFrame(rows).sort_values("from [m]", kind="stable", ignore_index=True)


def spans(distance: np.ndarray, length: float) -> list[tuple[float, int, int]]:
    """(beginning in m, first row, one past the last row) of each section that has two rows or more."""
    number = np.floor(distance / length).astype(int)
    firsts = np.flatnonzero(np.diff(number, prepend=number[0] - 1)) if len(number) else np.zeros(0, dtype=int)
    ends = [*firsts[1:], len(number)]
    return [(float(number[a] * length), int(a), int(b)) for a, b in zip(firsts, ends, strict=True) if b - a > 1]


def _numbers(values: np.ndarray, error: np.ndarray, distance: np.ndarray, speed: np.ndarray) -> dict[str, Any]:
    known = np.isfinite(values)
    share = float(known.mean())
    found = {"valid [-]": share, "std [mm or mm/m]": np.nan, "std error [mm or mm/m]": np.nan}
    found |= {"peak [mm or mm/m]": np.nan, "peak error [mm or mm/m]": np.nan, "peak at [m]": np.nan}
    if share >= ENOUGH:
        peak = int(np.nanargmax(np.abs(values)))
        found["std [mm or mm/m]"] = MM * float(np.std(values[known]))
        found["std error [mm or mm/m]"] = MM * root_mean_square(error[known])
        found |= {"peak [mm or mm/m]": MM * values[peak], "peak error [mm or mm/m]": MM * error[peak]}
        found["peak at [m]"] = distance[peak]
    finite = speed[np.isfinite(speed)]
    return found | {"line speed [km/h]": float(finite.max()) if finite.size else np.nan}


def _levels(values: np.ndarray, error: np.ndarray, limit: np.ndarray | None) -> dict[str, str]:
    if limit is None or not np.isfinite(values).any():
        return {"level": "", "could be": ""}
    more = np.abs(values) + SURE * np.nan_to_num(error)
    return {"level": LEVELS[level_of(values, limit)], "could be": LEVELS[level_of(more, limit)]}
