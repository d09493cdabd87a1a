"""GPX: points of tracks with time, position, elevation and what else stands in them as numbers.

Columns: `latitude`, `longitude` (deg), `elevation` (m), `speed` (m/s), `course` (deg) and further elements by their own
names; `track` and `segment` count from 1; `time` (instants). A document type, by which entities could grow, is refused.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np

from railsim.errors import InputError
from railsim.field.readers.interface import Wanted, from_fixes
from railsim.field.tables import Table

UNITS = {"latitude": "deg", "longitude": "deg", "elevation": "m", "speed": "m/s", "course": "deg"}
_CALLED = {"ele": "elevation", "sat": "satellites"}
_STAMP = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d{1,9})?(Z|[+-]\d\d:?\d\d)?")
_MOST_NAMES = 200
_LONGEST = 64  # characters of a number or time


def read(path: Path, wanted: list[Wanted]) -> list[Table]:
    """Points of all tracks, one after the other.

    Raises
    ------
    InputError : no track, no times, a document type, XML that is not whole, or a column that is not there.
    """
    points = _Points()
    parser = expat.ParserCreate(namespace_separator=" ")
    parser.StartDoctypeDeclHandler = _refuse
    parser.StartElementHandler = points.begin
    parser.EndElementHandler = points.end
    parser.CharacterDataHandler = points.text
    with path.open("rb") as handle:
        try:
            parser.ParseFile(handle)
        except expat.ExpatError as error:
            if not points.rows:
                raise InputError(f"it is no whole GPX ({error}); copy it again") from None
            points.told.append(f"the GPX ends or breaks in line {error.lineno}: the points before are taken")
    return [points.table(one) for one in wanted]


def _refuse(*_: Any) -> None:
    raise InputError("it declares a document type, which GPX has not; take the line <!DOCTYPE ...> out")


@dataclass
class _Points:
    """Takes the points as they come."""

    rows: list[dict[str, float]] = field(default_factory=list)
    stamps: list[int | None] = field(default_factory=list)
    told: list[str] = field(default_factory=list)
    _point: dict[str, float] | None = None
    _stamp: int | None = None
    _text: list[str] | None = None
    _track: int = 0
    _segment: int = 0

    def begin(self, tag: str, attributes: dict[str, str]) -> None:
        """An element begins."""
        name = tag.rpartition(" ")[2]
        self._track += name == "trk"
        self._segment += name == "trkseg"
        if name == "trkpt":
            self._point = {"track": float(self._track), "segment": float(self._segment)}
            self._point |= {"latitude": _number(attributes.get("lat", ""), 90.0)}
            self._point |= {"longitude": _number(attributes.get("lon", ""), 180.0)}
            self._stamp = None
        self._text = [] if self._point is not None else None

    def text(self, data: str) -> None:
        """Text of an element."""
        if self._text is not None and len(self._text) < _LONGEST:
            self._text.append(data[:_LONGEST])

    def end(self, tag: str) -> None:
        """An element ends."""
        name = tag.rpartition(" ")[2]
        if name == "trkpt" and self._point is not None:
            self.rows.append(self._point)
            self.stamps.append(self._stamp)
            self._point = None
        elif self._point is not None and self._text:
            self._take(name, "".join(self._text).strip())
        self._text = None

    def _take(self, name: str, text: str) -> None:
        assert self._point is not None
        if name == "time":
            self._stamp = _instant(text)
            return
        value = _number(text)
        if np.isfinite(value) and (name in self._point or len(self._point) < _MOST_NAMES):
            self._point[_CALLED.get(name, name)] = value

    def table(self, wanted: Wanted) -> Table:
        """Columns of the points."""
        if not self.rows:
            raise InputError("it holds no points of a track (trkpt); record a track, no route or waypoints")
        known = [one for one in self.stamps if one is not None]
        if not known:
            raise InputError("its points have no time, as those of a planned route; record a track with times")
        names = dict.fromkeys([*UNITS, *(name for row in self.rows for name in row)])
        columns = {name: np.array([row.get(name, np.nan) for row in self.rows]) for name in names}
        seconds = np.array([np.nan if one is None else (one - known[0]) * 1e-9 for one in self.stamps])
        start = f"{np.datetime64(known[0], 'ns')}Z"
        return from_fixes(wanted, seconds, start, columns, UNITS, "a GPX file", self.told)


def _number(text: str, largest: float = np.inf) -> float:
    try:
        value = float(text)
    except ValueError:
        return np.nan
    return value if abs(value) <= largest else np.nan


def _instant(text: str) -> int | None:
    """ns since 1970; without a zone it is UTC, as GPX has it."""
    found = _STAMP.fullmatch(text)
    if not found:
        return None
    zone = found[2] or "Z"
    bare = text.removesuffix(zone) if found[2] else text
    try:
        value = int(np.datetime64(bare, "ns").astype(np.int64))
    except (ValueError, OverflowError):
        return None
    if zone == "Z":
        return value
    minutes = 60 * int(zone[1:3]) + int(zone[-2:])
    return value - (-1 if zone[0] == "-" else 1) * minutes * 60_000_000_000
