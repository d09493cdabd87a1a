"""What track maintenance reads from an estimate: standard deviations of 200 m sections, and a list of isolated defects.

Sections and bands follow EN 13848-1 and EN 13848-6, defects the idea of EN 13848-5: peaks of D1 from the mean that
exceed an alert limit which depends on the speed. The limits here are illustrative, of the size of that standard's.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from estimators.signals.bands import stretches
from experiments.reporting.units import KMH, MM

SECTION = 200.0  # m
ENOUGH = 0.5  # share of a section that must be valid for a standard deviation to be stated


class Limit(NamedTuple):
    """Alert limits up to a speed: m for heights and lateral positions, m/m for twist."""

    fastest: float  # km/h
    vertical: float
    lateral: float
    twist: float


LIMITS = (
    Limit(80.0, 12e-3, 12e-3, 4e-3),
    Limit(120.0, 10e-3, 8e-3, 4e-3),
    Limit(160.0, 8e-3, 6e-3, 4e-3),
    Limit(230.0, 7e-3, 5e-3, 3e-3),
    Limit(np.inf, 6e-3, 4e-3, 3e-3),
)
"""Illustrative, of the size of EN 13848-5's alert limits for isolated defects (D1 from the mean; twist on 3 m)."""


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
    rows = []
    for index in range(int(number.max()) + 1 if len(number) else 0):
        inside = number == index
        row = {"from [m]": index * section, "to [m]": min((index + 1) * section, float(distance[-1]))}
        valid = _valid(series)[inside]
        row["valid [-]"] = float(np.mean(valid)) if valid.size else 0.0
        for name in _bands(series):
            values = series[name].to_numpy()[inside]
            known = values[valid & np.isfinite(values)]
            enough = known.size >= max(1.0, ENOUGH * valid.size)
            row[f"{name.removesuffix(' [m]')} std [mm]"] = MM * float(np.std(known)) if enough else np.nan
        rows.append(row)
    return pd.DataFrame(rows)


def defects(estimate: Estimate, limits: tuple[Limit, ...] = LIMITS) -> pd.DataFrame:
    """Stretches of D1 (and of twist) beyond the limit of the speed there, one row each, by place.

    Returns
    -------
    Columns "quantity", "s [m]" and "time [s]" (of the largest value), "size [mm or mm/m]" (signed), "length [m]"
    (beyond the limit), "limit [mm or mm/m]", "speed [km/h]".
    """
    series = estimate.series
    distance, time = series["s [m]"].to_numpy(), series["time [s]"].to_numpy()
    speed = KMH * np.gradient(distance, time) if len(distance) > 1 else np.zeros(len(distance))
    rows = []
    for name in [name for name in _bands(series) if "_d1 " in name] + ["twist [m/m]"] * ("twist [m/m]" in series):
        limit = _limit(name, speed, limits)
        values = np.where(_valid(series), series[name].to_numpy(), np.nan)
        for first, last in stretches(np.abs(values) > limit):
            peak = first + int(np.argmax(np.abs(values[first:last])))
            rows.append(
                (
                    name.split(" ")[0],
                    distance[peak],
                    time[peak],
                    MM * values[peak],
                    distance[last - 1] - distance[first],
                    MM * limit[peak],
                    speed[peak],
                )
            )
    names = ["quantity", "s [m]", "time [s]", "size [mm or mm/m]", "length [m]", "limit [mm or mm/m]", "speed [km/h]"]
    return pd.DataFrame(sorted(rows, key=lambda row: row[1]), columns=names)


def tables(estimate: Estimate) -> dict[str, pd.DataFrame]:
    """Both tables by file name where the estimate is of track geometry; joints and switches where it has events."""
    if not is_track(estimate):
        events = estimate.about.get("events")
        return {"events.csv": pd.DataFrame(events)} if events else {}
    return {"condition_200m.csv": condition(estimate), "defects.csv": defects(estimate)}


def _limit(name: str, speed: np.ndarray, limits: tuple[Limit, ...]) -> np.ndarray:
    row = np.searchsorted([limit.fastest for limit in limits], speed)
    kind = "twist" if "twist" in name else "lateral" if "lateral" in name or "gauge" in name else "vertical"
    return np.array([getattr(limit, kind) for limit in limits])[np.minimum(row, len(limits) - 1)]


def _bands(series: pd.DataFrame) -> list[str]:
    return [str(name) for name in series.columns if str(name).endswith(("_d1 [m]", "_d2 [m]", "_d3 [m]"))]


def _valid(series: pd.DataFrame) -> np.ndarray:
    return series["valid [-]"].to_numpy() > 0.5 if "valid [-]" in series.columns else np.ones(len(series), dtype=bool)
