"""Local time to UTC: offsets and places, the hour that comes twice in autumn included."""

import re
from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

import numpy as np

from railsim.errors import InputError
from railsim.field.durations import SECOND_NS
from railsim.field.tables import Notes

_QUARTER = 900 * SECOND_NS  # no zone changes its offset within one


def to_utc(local: np.ndarray, zone: str | None, what: str, notes: Notes) -> np.ndarray:
    """Nanoseconds since 1970 in UTC of local ones, in the order of the rows, shape (n,).

    Raises
    ------
    InputError : a local time that the zone does not have.
    """
    if zone is None or zone in ("Z", "UTC"):
        return local
    if re.fullmatch(r"[+-]\d\d:\d\d", zone):
        minutes = int(zone[1:3]) * 60 + int(zone[4:])
        return local - (-1 if zone[0] == "-" else 1) * minutes * 60 * SECOND_NS
    quarters, place = np.unique(local // _QUARTER, return_inverse=True)
    early, late = (np.array([_ahead(int(one), zone, fold) for one in quarters])[place] for fold in (0, 1))
    missing = early < late
    if missing.any():
        moment = datetime(1970, 1, 1) + timedelta(microseconds=int(local[int(missing.argmax())]) // 1000)
        raise InputError(
            f"{what}: {moment.isoformat(' ')} does not exist in {zone}, where clocks were set forward; give the "
            f"logger's own offset, as 'zone: \"{_offset(int(early[int(missing.argmax())]))}\"'"
        )
    return local - np.where(_second_pass(local, early != late, what, zone, notes), late, early)


def _second_pass(local: np.ndarray, twice: np.ndarray, what: str, zone: str, notes: Notes) -> np.ndarray:
    """Rows of the hour that comes twice which belong to its second pass: by the order of the rows."""
    second = np.zeros(local.size, dtype=bool)
    if not twice.any():
        return second
    back = np.diff(local, prepend=local[0]) < -_QUARTER
    edges = np.flatnonzero(np.diff(twice.astype(int), prepend=0) | (back & twice))
    blocks = [(int(a), int(b)) for a, b in zip(edges, [*edges[1:], local.size], strict=True) if twice[a]]
    for first, last in blocks:
        came_back = bool(back[first])
        goes_back = last < local.size and bool(back[last])
        alone = first == 0 and last < local.size and not goes_back
        second[first:last] = came_back or alone
        if not came_back and not goes_back:
            word = "second" if alone else "first"
            notes.assume(f"{what}: the hour that comes twice in {zone} is taken as its {word} pass")
    if any(back[first] for first, _ in blocks):
        notes.assume(f"{what}: one step back by an hour is the end of summer time in {zone}")
    return second


def _ahead(quarter: int, zone: str, fold: int) -> int:
    """Nanoseconds that a local quarter of an hour is ahead of UTC."""
    moment = datetime(1970, 1, 1) + timedelta(seconds=quarter * 900)
    offset = moment.replace(tzinfo=ZoneInfo(zone), fold=fold).utcoffset()
    return round(offset.total_seconds()) * SECOND_NS if offset is not None else 0


def _offset(nanoseconds: int) -> str:
    minutes = abs(nanoseconds) // SECOND_NS // 60
    return f"{'-' if nanoseconds < 0 else '+'}{minutes // 60:02d}:{minutes % 60:02d}"


def instant(nanoseconds: int) -> datetime:
    """The instant in UTC, to a microsecond."""
    return datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=nanoseconds // 1000)
