"""Condition for those who act on it: tables, a map and a page of one or several estimates of a recording."""

import json
from collections.abc import Callable, Mapping, Sequence
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
    estimates: Sequence[Estimate],
    before: Sequence[Sequence[Estimate]],
    limits: Limits,
    speed: LineSpeed,
    positions: Positions | None = None,
    start: str | None = None,
) -> Report:
    """Tables, map and page.

    Parameters
    ----------
    title : heading of the page.
    estimates : of one recording, each of track geometry.
    before : estimates of each earlier pass; one is compared with the estimate of the same estimator.
    limits, speed : what the condition is held against.
    positions : of the recording; None: there is no map.
    start : instant of time 0 of the recording, ISO 8601; None where it is not known.

    Raises
    ------
    InputError : an estimate is not of track geometry, two are of one estimator, or an earlier one cannot be compared.
    """
    _check(estimates, before)
    earlier = {one.name: [laid(old, one) for run in before for old in run if old.name == one.name] for one in estimates}
    tables = {
        f"condition_{length:g}m.csv": pd.concat([_rows(one, earlier, length, limits, speed) for one in estimates])
        for length in LENGTHS
    }
    found = _worst_first(pd.concat([_defects(one, earlier, limits, speed) for one in estimates], ignore_index=True))
    tables["defects.csv"] = found
    changed = pd.concat([changed_places(one, earlier[one.name]) for one in estimates], ignore_index=True)
    if before:
        tables["changes.csv"] = changed
    drawn = [
        features(one, positions, start, SECTION, _rows(one, earlier, SECTION, limits, speed), _of(one, found))
        for one in estimates
    ]
    collection = together(drawn)
    notes = [speed.source, f"limits: {limits.source}", *_about_earlier(earlier, len(before))]
    lists = {"Defects, the worst first": found.head(_SHOWN)}
    lists |= {"Places that have changed": changed.head(_SHOWN)} if before else {}
    html = page(title, collection, notes, traces(estimates, earlier, limits, speed), lists)
    counts = {level: list(found["level"]).count(level) for level in LEVELS[1:]}
    counts |= {"places changed": len(changed)} if before else {}
    return Report(tables, collection, html, counts, notes)


def _check(estimates: Sequence[Estimate], before: Sequence[Sequence[Estimate]]) -> None:
    names = [one.name for one in estimates]
    for one in estimates:
        if not is_track(one):
            raise InputError(f"the estimate of {one.name} is not of track geometry with bands; name others")
    if len(set(names)) < len(names):
        raise InputError(f"two estimates are of {max(names, key=names.count)}; earlier passes are named by --before")
    for run in before:
        for old in run:
            if old.name not in names:
                raise InputError(
                    f"--before: an estimate of {old.name} has none beside it; there are: {', '.join(names)}"
                )


def _rows(
    one: Estimate, earlier: Mapping[str, Sequence[Earlier]], length: float, limits: Limits, speed: LineSpeed
) -> pd.DataFrame:
    rows = section_rows(one, length, limits, speed)
    passes = earlier[one.name]
    return with_changes(rows, changed_sections(one, passes, length)) if passes else rows


def _defects(one: Estimate, earlier: Mapping[str, Sequence[Earlier]], limits: Limits, speed: LineSpeed) -> pd.DataFrame:
    """Defects, with what earlier passes had in the same place."""
    found = defects(one, limits, speed)
    passes = earlier[one.name]
    if not passes:
        return found
    return found.join(changes_at(one, passes, found))


def _worst_first(found: pd.DataFrame) -> pd.DataFrame:
    """By level, then by size over the limit of the level."""
    if found.empty:
        return found
    level = np.array([LEVELS.index(one) for one in found["level"]])
    share = np.abs(found["size [mm or mm/m]"].to_numpy() / found["limit [mm or mm/m]"].to_numpy())
    return found.iloc[np.lexsort((-share, -level))]


def _of(one: Estimate, found: pd.DataFrame) -> pd.DataFrame:
    """The defects of an estimate."""
    names = {str(name).split(" ")[0] for name in one.series.columns}
    return found.iloc[np.flatnonzero([quantity in names for quantity in found["quantity"]])]


def _about_earlier(earlier: Mapping[str, Sequence[Earlier]], count: int) -> list[str]:
    if not count:
        return ["no earlier pass is given: nothing is said of changes"]
    said = []
    for name, passes in earlier.items():
        slips = ", ".join(f"{one.slip:.2f}" for one in passes)
        said.append(
            f"{name}: {len(passes)} earlier passes, laid on this one to {slips} m (standard deviation)"
            if passes
            else f"{name}: no earlier pass of this estimator, so nothing is said of its changes"
        )
    return said
