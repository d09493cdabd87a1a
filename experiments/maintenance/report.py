"""Condition for those who act on it: tables, a map and a page of one or several estimates of a recording."""

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from experiments.maintenance.comparison import (
    Earlier,
    changed_places,
    changed_sections,
    changes_at,
    laid,
    with_changes,
)
from experiments.maintenance.condition import defects, is_track
from experiments.maintenance.condition_map import SECTION, features, together
from experiments.maintenance.kilometre import Kilometre
from experiments.maintenance.limits import CLASS_SECTION, LEVELS, Limits
from experiments.maintenance.line_speed import LineSpeed
from experiments.maintenance.map_page import page
from experiments.maintenance.positions import Positions
from experiments.maintenance.sections import section_rows
from experiments.maintenance.traces import traces
from railsim.errors import InputError

LENGTHS = (SECTION, CLASS_SECTION)
"""m, of the sections of both tables."""
_SHOWN = 500  # rows of a table on the page


@dataclass(frozen=True)
class Report:
    """What is known of the condition.

    Attributes
    ----------
    tables : by file name.
    collection : GeoJSON of the sections on the map and of the defects.
    page : HTML.
    counts : defects by level, and changes.
    notes : what the reader must know, in words.
    """

    tables: dict[str, pd.DataFrame]
    collection: dict[str, Any]
    page: str
    counts: dict[str, int]
    notes: list[str]

    def writers(self) -> dict[str, Callable[[Path], object]]:
        """What writes each file, by its name."""
        found: dict[str, Callable[[Path], object]] = {
            name: lambda path, table=table: table.to_csv(path, index=False, float_format="%.6g")
            for name, table in self.tables.items()
        }
        text = json.dumps(self.collection, allow_nan=False, ensure_ascii=False) + "\n"
        found["condition.geojson"] = lambda path: path.write_text(text, encoding="utf-8")
        found["condition.html"] = lambda path: path.write_text(self.page, encoding="utf-8")
        return found


def report(
    title: str,
    runs: Iterable[tuple[Estimate, Sequence[Estimate]]],
    limits: Limits,
    speed: LineSpeed,
    positions: Positions | None = None,
    start: str | None = None,
    along: Kilometre | None = None,
) -> Report:
    """Tables, map and page.

    Parameters
    ----------
    title : heading of the page.
    runs : estimates of one recording, each of track geometry, and those of earlier passes by the same estimator; they
        are taken one after the other, and only one is held.
    limits, speed : what the condition is held against.
    positions : of the recording; None: there is no map.
    start : instant of time 0 of the recording, ISO 8601; None where it is not known.
    along : kilometrage of the line; None where it is not known.

    Raises
    ------
    InputError : an estimate is not of track geometry, two are of one estimator, or an earlier one cannot be compared.
    """
    parts: list[_Part] = []
    for latest, before in runs:
        if not is_track(latest):
            raise InputError(f"the estimate of {latest.name} is not of track geometry with bands; name others")
        if any(one.name == latest.name for one in parts):
            raise InputError(f"two estimates are of {latest.name}; earlier passes are named by --before")
        parts.append(_part(latest, [laid(one, latest) for one in before], limits, speed, positions, start))
        del latest, before  # before the next one is opened
    compared = any(one.slips for one in parts)
    tables = {f"condition_{length:g}m.csv": pd.concat([one.rows[length] for one in parts]) for length in LENGTHS}
    found = tables["defects.csv"] = _worst_first(pd.concat([one.defects for one in parts], ignore_index=True))
    changed = pd.concat([one.changes for one in parts], ignore_index=True)
    if compared:
        tables["changes.csv"] = changed
    along = along or Kilometre()
    tables = {name: along.added(table) for name, table in tables.items()}
    collection = together([one.features for one in parts])
    notes = [speed.source, f"limits: {limits.source}", *_about_earlier(parts)]
    lists = {"Defects, the worst first": tables["defects.csv"].head(_SHOWN)}
    lists |= {"Places that have changed": tables["changes.csv"].head(_SHOWN)} if compared else {}
    html = page(title, collection, notes, [one for part in parts for one in part.traces], lists, along)
    counts = {level: list(found["level"]).count(level) for level in LEVELS[1:]}
    counts |= {"places changed": len(changed)} if compared else {}
    return Report(tables, collection, html, counts, notes)


@dataclass(frozen=True)
class _Part:
    """What is said of one estimate; `slips` of its earlier passes, m."""

    name: str
    rows: dict[float, pd.DataFrame]
    defects: pd.DataFrame
    changes: pd.DataFrame
    features: dict[str, Any]
    traces: list[dict[str, Any]]
    slips: list[float]


def _part(
    latest: Estimate,
    passes: Sequence[Earlier],
    limits: Limits,
    speed: LineSpeed,
    positions: Positions | None,
    start: str | None,
) -> _Part:
    rows = {length: _rows(latest, passes, length, limits, speed) for length in LENGTHS}
    found = defects(latest, limits, speed)
    drawn = features(latest, positions, start, SECTION, rows[SECTION], found)
    if passes:
        found = found.join(changes_at(latest, passes, found))
    slips = [one.slip for one in passes]
    changed = changed_places(latest, passes)
    return _Part(latest.name, rows, found, changed, drawn, traces(latest, passes, limits, speed), slips)


def _rows(one: Estimate, passes: Sequence[Earlier], length: float, limits: Limits, speed: LineSpeed) -> pd.DataFrame:
    rows = section_rows(one, length, limits, speed)
    return with_changes(rows, changed_sections(one, passes, length)) if passes else rows


def _worst_first(found: pd.DataFrame) -> pd.DataFrame:
    """By level, then by size over the limit of the level."""
    if found.empty:
        return found
    level = np.array([LEVELS.index(one) for one in found["level"]])
    share = np.abs(found["size [mm or mm/m]"].to_numpy() / found["limit [mm or mm/m]"].to_numpy())
    return found.iloc[np.lexsort((-share, -level))]


def _about_earlier(parts: Sequence[_Part]) -> list[str]:
    if not any(one.slips for one in parts):
        return ["no earlier pass is given: nothing is said of changes"]
    said = []
    for one in parts:
        slips = ", ".join(f"{slip:.2f}" for slip in one.slips)
        said.append(
            f"{one.name}: {len(one.slips)} earlier passes, laid on this one to {slips} m (standard deviation)"
            if one.slips
            else f"{one.name}: no earlier pass of this estimator, so nothing is said of its changes"
        )
    return said
