"""What track maintenance reads from an estimate: standard deviations of 200 m sections, and a list of isolated defects.

Sections and bands follow EN 13848-1 and EN 13848-6, defects EN 13848-5: peaks from the mean that exceed an alert,
intervention or immediate action limit, which depend on the line speed.
"""

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from estimators.signals.bands import stretches
from experiments.maintenance.limits import LEVELS, Limits, shipped
from experiments.maintenance.line_speed import TRAVELLED, LineSpeed
from experiments.reporting.units import MM

SECTION = 200.0  # m
ENOUGH = 0.5  # share of a section that must be valid for a standard deviation to be stated
SURE = 2.0
"""Stated deviations by which a value may be larger than it was estimated: 95 % of a normal distribution."""


def is_track(estimate: Estimate) -> bool:
    """Whether the estimate is of track geometry with bands: what the tables here can be made of."""
    return str(estimate.series.columns[0]) == "s [m]" and any("_d1 [m]" in str(c) for c in estimate.series.columns)


def condition(estimate: Estimate, section: float = SECTION) -> pd.DataFrame:
    """Standard deviation of every band in every section, mm; NaN where less than half of the section is valid.

    Returns
    -------
    Columns "from [m]", "to [m]", "valid [-]", then "vertical_d1 std [mm]" and the like.
    """
    series = estimate.series
    distance = series["s [m]"].to_numpy()
    number = np.floor(distance / section).astype(int)
    count = int(number.max()) + 1 if len(number) else 0
    ends = np.searchsorted(number, np.arange(count + 1))
    good = valid_of(series)
    bands = {name: series[name].to_numpy() for name in bands_of(series)}
    rows = []
    for index in range(count):
        inside = slice(ends[index], ends[index + 1])
        row = {"from [m]": index * section, "to [m]": min((index + 1) * section, float(distance[-1]))}
        valid = good[inside]
        row["valid [-]"] = float(np.mean(valid)) if valid.size else 0.0
        for name, whole in bands.items():
            values = whole[inside]
            known = values[valid & np.isfinite(values)]
            enough = known.size >= max(1.0, ENOUGH * valid.size)
            row[f"{name.removesuffix(' [m]')} std [mm]"] = MM * float(np.std(known)) if enough else np.nan
        rows.append(row)
    return pd.DataFrame(rows)


def defects(estimate: Estimate, limits: Limits | None = None, speed: LineSpeed = TRAVELLED) -> pd.DataFrame:
    """Stretches of a quantity beyond its alert limit, one row each, the worst first: by level, then by size over limit.

    Parameters
    ----------
    limits : None: those that come with railsim.
    speed : line speed by place.

    Returns
    -------
    Columns "quantity", "level", "could be" (the level at `SURE` stated deviations more), "s [m]" and "time [s]" (of
    the largest value), "size [mm or mm/m]" (signed), "error [mm or mm/m]" (stated deviation there), "length [m]"
    (beyond the limit), "limit [mm or mm/m]" (of the level), "speed [km/h]" (that the limit is for).
    """
    series = estimate.series
    distance, time = series["s [m]"].to_numpy(), series["time [s]"].to_numpy()
    fastest = speed.at(distance, time)
    known = valid_of(series)
    rows = []
    for name in [*bands_of(series), *(["twist [m/m]"] if "twist [m/m]" in series else [])]:
        limit = (limits or shipped()).peaks(name, fastest)
        if limit is None:
            continue
        values = np.where(known, series[name].to_numpy(), np.nan)
        error = error_of(series, name)
        for first, last in stretches(np.abs(values) > limit[:, 0]):
            peak = first + int(np.argmax(np.abs(values[first:last])))
            level = level_of(values[first:last], limit[first:last])
            row = {"quantity": name.split(" ")[0], "level": LEVELS[level]}
            row["could be"] = LEVELS[level_of(np.abs(values) + SURE * np.nan_to_num(error), limit, slice(first, last))]
            row |= {"s [m]": distance[peak], "time [s]": time[peak], "size [mm or mm/m]": MM * values[peak]}
            row |= {"error [mm or mm/m]": MM * error[peak], "length [m]": distance[last - 1] - distance[first]}
            row |= {"limit [mm or mm/m]": MM * limit[peak, level - 1], "speed [km/h]": fastest[peak]}
            rows.append((-level, -abs(values[peak]) / limit[peak, 0], row))
    ordered = [row for *_, row in sorted(rows, key=lambda one: one[:2])]
    return pd.DataFrame(ordered, columns=_DEFECT)


_DEFECT = [
    "quantity", "level", "could be", "s [m]", "time [s]", "size [mm or mm/m]", "error [mm or mm/m]", "length [m]",
    "limit [mm or mm/m]", "speed [km/h]",
]  # fmt: skip


def level_of(values: np.ndarray, limit: np.ndarray, inside: slice = slice(None)) -> int:
    """Number of limits, shape (n, 3), that any of the values exceeds."""
    return int((np.abs(values[inside])[:, None] > limit[inside]).any(axis=0).sum())


def tables(estimate: Estimate) -> dict[str, pd.DataFrame]:
    """Both tables by file name where the estimate is of track geometry; joints and switches where it has events."""
    if not is_track(estimate):
        events = estimate.about.get("events")
        return {"events.csv": pd.DataFrame(events)} if events else {}
    return {"condition_200m.csv": condition(estimate), "defects.csv": defects(estimate)}


def bands_of(series: pd.DataFrame) -> list[str]:
    """Names of the columns of bands."""
    return [str(name) for name in series.columns if str(name).endswith(("_d1 [m]", "_d2 [m]", "_d3 [m]"))]


def error_of(series: pd.DataFrame, name: str) -> np.ndarray:
    """Stated deviation of a column, NaN where there is none."""
    short, _, unit = name.partition(" ")
    stated = f"{short}_std {unit}"
    return series[stated].to_numpy() if stated in series.columns else np.full(len(series), np.nan)


def valid_of(series: pd.DataFrame) -> np.ndarray:
    """Where the estimate is valid."""
    return series["valid [-]"].to_numpy() > 0.5 if "valid [-]" in series.columns else np.ones(len(series), dtype=bool)
