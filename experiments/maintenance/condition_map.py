"""Condition on a map: sections of an estimate as lines, defects and events as points (GeoJSON, RFC 7946)."""

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Any

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from experiments.maintenance.condition import condition, defects, is_track
from experiments.maintenance.limits import LEVELS
from experiments.maintenance.positions import Positions
from railsim.errors import InputError
from railsim.field.writers.interface import split_name

SECTION = 100.0
"""m, length of a section on the map."""
_APART = 20.0  # m between the points of a section's line
_MOST_SECTIONS = 200_000
_DIGITS = 7  # decimals of a degree: 1 cm
LEVEL = "level [-]"
"""Of a section: number of limits that are exceeded by the worst of its quantities, 0 to 3."""
_SAID = {
    "peak [mm or mm/m]": "peak [mm]", "level": "level", "could be": "could be", "class": "class",
    "change [mm or mm/m]": "change [mm]", "change over error [-]": "change over error [-]", "changed": "changed",
}  # fmt: skip
"""Columns of section rows, and how a section's properties call them."""
_AXES = ("s [m]", "time [s]", "valid [-]")

Feature = dict[str, Any]


def features(
    estimate: Estimate,
    positions: Positions | None,
    start: str | None = None,
    section: float = SECTION,
    rows: pd.DataFrame | None = None,
    points: pd.DataFrame | None = None,
) -> dict[str, Any]:
    """A FeatureCollection: sections in the order of the track, then defects or events.

    A section's properties are its place, the share of it that is valid, and for each quantity the standard deviation
    (bands of track geometry, mm) or the mean and the mean of its stated standard deviations. What has no position has
    no geometry.

    Parameters
    ----------
    estimate : what was estimated.
    positions : of its recording; None where none are known.
    start : instant of time 0, ISO 8601; None where it is not known.
    section : length, m.
    rows : what else there is to say of each section, as `sections.section_rows` and `comparison.with_changes` give it.
    points : the defects; None: those by the speed travelled.

    Raises
    ------
    InputError : the estimate has no times, or they are not those of the positions.
    """
    time = _times(estimate, positions)
    distance = _distance(estimate, positions, time)
    span = float(distance[-1] - min(0.0, distance[0]))
    if span / section > _MOST_SECTIONS:
        raise InputError(f"{span / 1e3:.0f} km in sections of {section:g} m are too many; give a longer --section")
    found = _sections(estimate, positions, time, distance, section)
    if rows is not None:
        _add(found, rows, section)
    found += _points(estimate, positions, time, points)
    for feature in found:
        _date(feature["properties"], start)
    about = {"estimator": estimate.name, "positions": positions.source if positions else None, "section [m]": section}
    return {"type": "FeatureCollection", "railsim": about, "features": found}


def without_place(collection: dict[str, Any]) -> int:
    """Number of features that have no position."""
    return sum(feature["geometry"] is None for feature in collection["features"])


def together(collections: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Collections of estimates over one distance as one: sections that begin alike are one section."""
    if len(collections) == 1:
        return collections[0]
    sections: dict[float, Feature] = {}
    points: list[Feature] = []
    for one in collections:
        for feature in one["features"]:
            properties = feature["properties"]
            if properties["kind"] != "section":
                points.append(feature)
                continue
            known = sections.setdefault(properties["from [m]"], feature)["properties"]
            worst = max(known.get(LEVEL) or 0, properties.get(LEVEL) or 0)
            known |= {key: value for key, value in properties.items() if key not in known} | {LEVEL: worst}
    about = collections[0]["railsim"] | {"estimator": ", ".join(one["railsim"]["estimator"] for one in collections)}
    return {"type": "FeatureCollection", "railsim": about, "features": [*sections.values(), *points]}


def _add(found: list[Feature], rows: pd.DataFrame, section: float) -> None:
    """Peaks, levels, classes and changes among the properties of the sections."""
    by_number: dict[int, dict[str, Any]] = {}
    for row in rows.to_dict("records"):
        known = by_number.setdefault(round(row["from [m]"] / section), {LEVEL: 0})
        name = f"{row['quantity']}_{str(row['band']).lower()}".rstrip("_")
        unit = "mm/m" if row["quantity"] == "twist" else "mm"
        for key, label in _SAID.items():
            if key in row and row[key] != "":
                known[f"{name} {label}".replace("[mm]", f"[{unit}]")] = row[key]
        known[LEVEL] = max(known[LEVEL], LEVELS.index(row["level"]))
    for feature in found:
        properties = feature["properties"]
        more = by_number.get(int(np.floor(properties["from [m]"] / section + 1e-9)), {})
        properties |= {key: _plain(value) for key, value in more.items() if key not in properties}


def _times(estimate: Estimate, positions: Positions | None) -> np.ndarray:
    if "time [s]" not in estimate.series.columns or len(estimate.series) < 2:
        raise InputError(f"the estimate of {estimate.name} has no rows over time, so no place on a map; export to .csv")
    time = estimate.series["time [s]"].to_numpy(dtype=float)
    if positions is None:
        return time
    if time[-1] < positions.time[0] or time[0] > positions.time[-1]:
        raise InputError(
            f"the estimate runs from {time[0]:.6g} to {time[-1]:.6g} s, the positions from {positions.time[0]:.6g} to "
            f"{positions.time[-1]:.6g} s; name by --recording the one that it was made of"
        )
    return time


def _distance(estimate: Estimate, positions: Positions | None, time: np.ndarray) -> np.ndarray:
    """Place of each row, m: of the estimate, else the way by the positions."""
    if str(estimate.series.columns[0]) == "s [m]":
        return estimate.series["s [m]"].to_numpy(dtype=float)
    if positions is None:
        raise InputError(
            f"the estimate of {estimate.name} is over time, and no positions give it a place; "
            "name by --recording one with latitude and longitude"
        )
    return positions.distance(time)


def _sections(
    estimate: Estimate, positions: Positions | None, time: np.ndarray, distance: np.ndarray, section: float
) -> list[Feature]:
    number = np.floor((distance - min(0.0, distance[0])) / section).astype(int)
    if number[-1] != number[-2]:
        number[-1] = number[-2]  # a row by itself is no line
    firsts = np.flatnonzero(np.diff(number, prepend=number[0] - 1))
    ends = [*firsts[1:], len(number)]
    bands = condition(estimate, section) if is_track(estimate) and distance[0] >= 0.0 else None
    series = estimate.series
    valid = series["valid [-]"].to_numpy() > 0.5 if "valid [-]" in series.columns else np.ones(len(series), dtype=bool)
    found = []
    for first, end in zip(firsts, ends, strict=True):
        rows = slice(first, end)
        properties = {"kind": "section", "from [m]": float(distance[first]), "to [m]": float(distance[end - 1])}
        properties |= {"time [s]": float(time[first]), "valid [-]": float(valid[rows].mean())}
        if bands is not None:
            properties |= _band(bands, int(number[first]))
        properties |= _means(series.iloc[rows], valid[rows], bands)
        found.append(_feature(_line(positions, time[first : end + 1], distance[first : end + 1]), properties))
    return found


def _band(bands: pd.DataFrame, number: int) -> dict[str, Any]:
    row = bands.iloc[number]
    return {str(name): float(row[name]) for name in bands.columns if str(name).endswith("std [mm]")}


def _means(rows: pd.DataFrame, valid: np.ndarray, bands: pd.DataFrame | None) -> dict[str, Any]:
    """Mean of each quantity where it is valid; those of which a standard deviation a band stands there are left out."""
    found = {}
    for name in map(str, rows.columns):
        if name in _AXES or (bands is not None and name.endswith(" [m]")):
            continue
        values = rows[name].to_numpy(dtype=float)[valid]
        known = values[np.isfinite(values)]
        short, unit = split_name(name)
        found[f"{short} mean [{unit}]"] = float(known.mean()) if known.size else np.nan
    return found


def _line(positions: Positions | None, time: np.ndarray, distance: np.ndarray) -> Feature | None:
    """The way through a section and on to the next one."""
    if positions is None:
        return None
    count = max(2, int(np.ceil((distance[-1] - distance[0]) / _APART)) + 1)
    rows = np.unique(np.rint(np.linspace(0, len(time) - 1, min(count, len(time)))).astype(int))
    places = positions.at(time[rows])
    places = places[np.isfinite(places).all(axis=1)]
    if len(places) < 2:
        return None
    parts = np.split(places, np.flatnonzero(np.abs(np.diff(places[:, 0])) > 180.0) + 1)  # RFC 7946, 3.1.9
    lines = [np.round(part, _DIGITS).tolist() for part in parts if len(part) > 1]
    if len(lines) != 1:
        return {"type": "MultiLineString", "coordinates": lines} if lines else None
    return {"type": "LineString", "coordinates": lines[0]}


def _points(
    estimate: Estimate, positions: Positions | None, time: np.ndarray, given: pd.DataFrame | None
) -> list[Feature]:
    """Defects of track geometry, and events as joints and switches."""
    track = is_track(estimate)
    rows = estimate.about.get("events")
    if track:
        rows = (defects(estimate) if given is None else given).to_dict("records")
    found = []
    for row in rows if isinstance(rows, list) else []:
        if not isinstance(row, dict):
            continue
        properties = {str(name): value for name, value in row.items()}
        kind = "defect" if track else str(properties.pop("kind", "event"))
        at = np.array([_time(properties, estimate, time)])
        place = np.full(2, np.nan) if positions is None else positions.at(at)[0]
        geometry = None
        if np.isfinite(place).all():
            geometry = {"type": "Point", "coordinates": np.round(place, _DIGITS).tolist()}
        found.append(_feature(geometry, {"kind": kind, **properties}))
    return found


def _time(properties: dict[str, Any], estimate: Estimate, time: np.ndarray) -> float:
    """When the vehicle was there, s, by the stated time or place; NaN where neither is known."""
    at, s = (_number(properties.get(name)) for name in ("time [s]", "s [m]"))
    if np.isfinite(at) or "s [m]" not in estimate.series.columns or not np.isfinite(s):
        return at
    return float(np.interp(s, estimate.series["s [m]"].to_numpy(dtype=float), time))


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float | np.number) else np.nan


def _feature(geometry: Feature | None, properties: dict[str, Any]) -> Feature:
    return {
        "type": "Feature",
        "geometry": geometry,
        "properties": {name: _plain(value) for name, value in properties.items()},
    }


def _plain(value: Any) -> Any:
    """Numbers with 6 digits, null where they are not finite; other values as texts."""
    if value is None or isinstance(value, str | bool):
        return value
    if isinstance(value, int | float | np.number):
        return float(f"{float(value):.6g}") if np.isfinite(value) else None
    return str(value)


def _date(properties: dict[str, Any], start: str | None) -> None:
    """Add the instant where it is known."""
    at = properties.get("time [s]")
    if start is not None and isinstance(at, float):
        properties["at"] = (datetime.fromisoformat(start) + timedelta(seconds=at)).isoformat(timespec="milliseconds")
