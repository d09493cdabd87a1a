"""A long record estimated section by section: sections that are done are kept, and an interrupted run goes on.

Each section is estimated with `OVERLAP` more on both sides, and its ends are thrown away. Sections are joined where
time passes from one to the next. Over distance a section's grid is laid on that of the first by whole rows, so that the
place of no section is off by more than half a row, however many there are.
"""

import hashlib
import inspect
import json
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import estimators
from estimators.interface import Estimate, Estimator
from railsim.errors import InputError
from railsim.files import json_text, read_json, replace_file
from railsim.measurements import Measurements
from railsim.parquet import read_column, read_names, write_frame
from railsim.quality.draft import tables_of
from railsim.recording import software_versions

LONGEST = 3600.0
"""s; a longer record is estimated in sections."""
SECTION, OVERLAP = 1800.0, 120.0  # s
S, TIME = "s [m]", "time [s]"
_DONE = "section.json"
_PLACES = ("s [m]",)  # keys of events that are places


@dataclass(frozen=True)
class Section:
    """Where a section lies.

    Attributes
    ----------
    number : from 0.
    begin, end : s, of what is taken from it.
    """

    number: int
    begin: float
    end: float


def in_sections(estimator: Estimator, measurements: Measurements) -> bool:
    """Whether the record is estimated in sections: it is long, and the estimator looks at what is near only."""
    first, last = measurements.span()
    return estimator.nearby and last - first > LONGEST


def sections_of(measurements: Measurements) -> list[Section]:
    """All sections, of `SECTION` each but for the last, which ends with the record."""
    first, last = measurements.span()
    count = max(1, round((last - first) / SECTION))
    bounds = [first + number * SECTION for number in range(count)]
    ends = [*bounds[1:], np.inf]
    return [Section(number, begin, end) for number, (begin, end) in enumerate(zip(bounds, ends, strict=True))]


def estimate_sections(
    estimator: Estimator,
    measurements: Measurements,
    folder: Path,
    recording: Path,
    progress: Callable[[str], None] = lambda _: None,
) -> list[Path]:
    """Estimate every section that is not done yet.

    Parameters
    ----------
    folder : of the sections; those of another recording, other settings or another version are thrown away.
    recording : folder of the recording, by the files of which it is told from another one.
    progress : takes a line for each section.

    Returns
    -------
    Folders of the sections, in their order.
    """
    stated = {"key": _key(estimator, measurements, recording)}
    if folder.is_dir() and (
        not (folder / "key.json").is_file() or read_json(folder / "key.json", "sections") != stated
    ):
        shutil.rmtree(folder)
    folder.mkdir(parents=True, exist_ok=True)
    replace_file(folder / "key.json", json_text(stated).encode())
    places = []
    sections = sections_of(measurements)
    for section in sections:
        place = folder / f"{section.number:04d}"
        places.append(place)
        if (place / _DONE).is_file():
            progress(f"section {section.number + 1} of {len(sections)}: done before")
            continue
        seen = measurements.between(section.begin - OVERLAP, section.end + OVERLAP)
        if seen is None:
            raise InputError(
                f"the recording holds nothing from {section.begin:.6g} to {section.end:.6g} s; "
                "make a recording of each part around it"
            )
        apart = Measurements(
            measurements.about, tables_of(seen[0]), measurements.track
        )  # caches may keep what they see
        _keep(estimator.estimate(apart), section, place)
        progress(f"section {section.number + 1} of {len(sections)}: done")
    return places


def joined(places: Sequence[Path]) -> Estimate:
    """The estimate of the whole record.

    Its about.json has what the first section says, the events and warnings of all, and under "sections" how they are
    joined: "seams" are the root mean squares of the differences of neighbours over what both estimated.
    """
    heads = [read_json(place / _DONE, "a section") for place in places]
    names, _ = read_names(places[0] / "estimate.parquet")
    over_distance = names[0] == S
    pieces = [_Piece.of(place, head) for place, head in zip(places, heads, strict=True)]
    shifts, spacing = _shifts(pieces) if over_distance else ([0] * len(pieces), 0.0)
    kept = _kept(pieces, shifts, spacing)
    columns = {}
    for name in names:
        parts = [read_column(place / "estimate.parquet", name)[rows] for place, rows in zip(places, kept, strict=True)]
        columns[name] = np.concatenate(parts)
    if over_distance:
        columns[S] = spacing * (shifts[0] + kept[0].start + np.arange(len(columns[TIME])))
    about = _about(heads, [spacing * shift for shift in shifts])
    about["sections"] = {"count": len(places), "length [s]": SECTION, "overlap [s]": OVERLAP}
    about["sections"] |= {"seams": _seams(places, names, pieces, shifts if over_distance else None)}
    return Estimate(heads[0]["name"], pd.DataFrame(columns, copy=False), about)


@dataclass(frozen=True)
class _Piece:
    """Places and times of the rows of a section with its overlaps, and what is taken from it."""

    section: Section
    time: np.ndarray
    distance: np.ndarray

    @classmethod
    def of(cls, place: Path, head: dict[str, Any]) -> "_Piece":
        table = place / "estimate.parquet"
        time = read_column(table, TIME)
        names, _ = read_names(table)
        end = np.inf if head["end"] is None else float(head["end"])
        distance = read_column(table, S) if names[0] == S else np.zeros(0)
        return cls(Section(int(head["number"]), float(head["begin"]), end), time, distance)

    def at(self, time: float) -> float:
        """Place at a time, m, from the section's own beginning."""
        return float(np.interp(time, self.time, self.distance))


def _keep(estimate: Estimate, section: Section, place: Path) -> None:
    """Write a section; the file that says that it is done comes last."""
    if TIME not in estimate.series.columns:
        raise InputError(f"{estimate.name} gives no times to join sections by; give a shorter record")
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    write_frame(place / "estimate.parquet", estimate.series)
    end = section.end if np.isfinite(section.end) else None
    head = {"number": section.number, "begin": section.begin, "end": end, "name": estimate.name}
    replace_file(place / _DONE, json_text(head | {"about": estimate.about}).encode())


def _shifts(pieces: Sequence[_Piece]) -> tuple[list[int], float]:
    """Rows by which each section's grid lies behind that of the first, and the spacing of the grid, m."""
    spacing = float(np.median(np.diff(pieces[0].distance)))
    offset, shifts = 0.0, [0]
    for before, after in zip(pieces, pieces[1:], strict=False):
        offset += before.at(after.section.begin) - after.at(after.section.begin)
        shifts.append(round(offset / spacing))
    return shifts, spacing


def _kept(pieces: Sequence[_Piece], shifts: Sequence[int], spacing: float) -> list[slice]:
    """Rows of each section that are taken."""
    if not spacing:
        bounds = [np.searchsorted(one.time, [one.section.begin, one.section.end]) for one in pieces]
        bounds[0][0] = 0
        return [slice(int(first), int(end)) for first, end in bounds]
    kept, first = [], 0
    for number, one in enumerate(pieces):
        end = len(one.distance)
        if number + 1 < len(pieces):
            end = min(end, int(np.floor(one.at(one.section.end) / spacing)) + 1)
            following = end + shifts[number] - shifts[number + 1]
        else:
            following = 0
        kept.append(slice(first, max(first, end)))
        first = max(0, following)
    return kept


def _about(heads: Sequence[dict[str, Any]], offsets: Sequence[float]) -> dict[str, Any]:
    """What the first says, with the events and warnings of all."""
    about = dict(heads[0]["about"])
    if any("events" in head["about"] for head in heads):
        about["events"] = [
            {key: value + offset if key in _PLACES else value for key, value in event.items()}
            for head, offset in zip(heads, offsets, strict=True)
            for event in head["about"].get("events", [])
            if head["begin"] <= event[TIME] < (np.inf if head["end"] is None else head["end"]) or _before(head, event)
        ]
    warnings = [one for head in heads for one in head["about"].get("warnings", [])]
    return about | ({"warnings": list(dict.fromkeys(warnings))} if warnings else {})


def _before(head: dict[str, Any], event: dict[str, Any]) -> bool:
    """Whether an event of the first section lies before its first sample, by a sensor that stands ahead."""
    return head["number"] == 0 and event[TIME] < head["begin"]


def _seams(
    places: Sequence[Path], names: Sequence[str], pieces: Sequence[_Piece], shifts: Sequence[int] | None
) -> dict[str, float]:
    """Root mean square of the differences of neighbours within half an overlap of the seams, by column."""
    squares: dict[str, list[float]] = {}
    for number in range(len(places) - 1):
        seam = pieces[number].section.end
        first, last = (int(np.searchsorted(pieces[number].time, seam + side * OVERLAP / 2)) for side in (-1, 1))
        if shifts is None:
            other = np.searchsorted(pieces[number + 1].time, pieces[number].time[first:last] - 1e-9)
        else:
            other = np.arange(first, last) + shifts[number] - shifts[number + 1]
        other = other[(other >= 0) & (other < len(pieces[number + 1].time))]
        for name in [one for one in names if one not in (S, TIME)]:
            mine = read_column(places[number] / "estimate.parquet", name)[first : first + len(other)]
            difference = mine - read_column(places[number + 1] / "estimate.parquet", name)[other]
            squares.setdefault(name, []).extend(np.square(difference[np.isfinite(difference)]).tolist())
    return {name: float(f"{np.sqrt(np.mean(values)):.3g}") for name, values in squares.items() if values}


def _key(estimator: Estimator, measurements: Measurements, recording: Path) -> str:
    """Digest of everything that a section depends on."""
    files = [(path.name, path.stat().st_size, path.stat().st_mtime_ns) for path in sorted(recording.glob("measured/*"))]
    parts = [estimator.name, estimator.digest(), measurements.about, files, software_versions(), SECTION, OVERLAP]
    sources = sorted(Path(estimators.__path__[0]).rglob("*.py"))
    parts += [
        hashlib.sha256(path.read_bytes()).hexdigest() for path in [*sources, Path(inspect.getfile(type(estimator)))]
    ]
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()
