"""Time bases: whatever a logger calls time, as seconds."""

import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

from railsim.errors import InputError
from railsim.field.channels import numbers
from railsim.field.map import Counter, Gps, Iso, Own, Rows, Seconds, TableMap
from railsim.field.tables import Column, Notes, Table
from railsim.field.units import parse_unit

GPS_EPOCH = datetime(1980, 1, 6, tzinfo=UTC)
"""IS-GPS-200, 20.3.3.5.2.4."""

WEEK = 604800.0  # s


@dataclass(frozen=True)
class Clock:
    """Seconds of each row, shape (n,), after `start` (UTC), or after an unknown instant where that is None."""

    seconds: np.ndarray
    start: datetime | None


def columns_of(base: object) -> list[str]:
    """Columns that a time base needs."""
    if isinstance(base, Seconds | Iso | Counter):
        return [base.column]
    if isinstance(base, Gps):
        return [base.seconds, *([base.week] if isinstance(base.week, str) else [])]
    return []


def read_clock(mapped: TableMap, table: Table, rows: int, notes: Notes) -> Clock:
    """Times of all `rows` as the map says; NaN where a row has none.

    Raises
    ------
    InputError : a cell is no number or instant, or the format has no time axis of its own.
    """
    base = mapped.time
    if isinstance(base, Rows):
        assert mapped.rate is not None
        clock = Clock(np.arange(rows) / mapped.rate, None)
        notes.assume(f"rows follow each other at {mapped.rate:g} Hz without a gap: the file has no time")
    elif isinstance(base, Own):
        clock = _own(table, notes)
    elif isinstance(base, Seconds):
        unit = parse_unit(base.unit)
        clock = Clock(unit.to_si(numbers(table.columns[base.column], table)), None)
    elif isinstance(base, Counter):
        clock = _counter(base, table, notes)
    elif isinstance(base, Gps):
        clock = _gps(base, table, notes)
    else:
        clock = _iso(base, table, notes)
    if mapped.time_offset:
        notes.assume(f"times moved by {mapped.time_offset:g} s, as the map says")
        return Clock(clock.seconds + mapped.time_offset, clock.start)
    return clock


def _own(table: Table, notes: Notes) -> Clock:
    assert table.clock is not None
    since = f", which begins at {table.start}" if table.start else ""
    notes.assume(f"times as the file's own axis has them{since}")
    try:
        start = _instant(table.start, "UTC") if table.start else None
    except (ValueError, OverflowError):
        raise InputError(f"the file's axis begins at '{table.start[:40] if table.start else ''}', no date") from None
    return Clock(table.clock, start)


def _counter(base: Counter, table: Table, notes: Notes) -> Clock:
    count = numbers(table.columns[base.column], table)
    good = np.flatnonzero(np.isfinite(count))
    if good.size and (count[good].min() < 0 or count[good].max() >= base.modulus):
        raise InputError(f"column '{base.column}' leaves 0 ... {base.modulus:g}; correct 'modulus'")
    steps = np.diff(count[good])
    wraps = steps < -base.modulus / 2
    full = np.full(count.size, np.nan)
    full[good] = count[good] - (count[good[0]] if good.size else 0.0)
    full[good[1:]] += base.modulus * np.cumsum(wraps)
    longest = base.modulus / base.frequency
    notes.assume(
        f"counter '{base.column}' wraps at {base.modulus:g} ({int(wraps.sum())} times here); it begins at 0 s; a gap "
        f"of more than {longest:.4g} s cannot be seen"
    )
    return Clock(full / base.frequency, None)


def _gps(base: Gps, table: Table, notes: Notes) -> Clock:
    seconds = parse_unit(base.unit).to_si(numbers(table.columns[base.seconds], table))
    good = np.isfinite(seconds)
    if (np.abs(seconds[good] - WEEK / 2) > WEEK / 2).any():
        raise InputError(f"column '{base.seconds}' leaves a week (0 ... {WEEK:g} s); correct column or unit")
    if isinstance(base.week, str):
        week = numbers(table.columns[base.week], table) + 1024.0 * base.rollovers
    else:
        rollovers = np.zeros(seconds.size)
        rollovers[np.flatnonzero(good)[1:]] = np.cumsum(np.diff(seconds[good]) < -WEEK / 2)
        week = base.week + 1024.0 * base.rollovers + rollovers
        if rollovers.any():
            notes.assume("the GPS week ends within the record; the week after follows")
    known = np.isfinite(week) & good
    if not known.any():
        return Clock(np.full(seconds.size, np.nan), GPS_EPOCH)
    first = float(week[known][0])
    if not 0 <= first < 10_000 or first != round(first):
        raise InputError(f"GPS week {first:g} is none; correct 'week' or 'rollovers'")
    start = GPS_EPOCH + timedelta(weeks=first) - timedelta(seconds=base.leap_seconds)
    notes.assume(
        f"GPS time is {base.leap_seconds} s ahead of UTC, weeks count from 1980 ({base.rollovers} rollovers added)"
    )
    return Clock(np.where(known, (week - first) * WEEK + seconds, np.nan), start)


def _iso(base: Iso, table: Table, notes: Notes) -> Clock:
    column = table.columns[base.column]
    if column.instants:
        assert isinstance(column.values, np.ndarray) and table.start is not None
        start = _instant(table.start, "UTC")
        notes.assume(f"column '{base.column}' holds instants in UTC, as its type in the file says")
        return Clock(column.values, start)
    if not isinstance(column.values, list):
        raise InputError(f"column '{base.column}' holds numbers, no dates; use a time of kind 'seconds' or 'gps'")
    moments = [_moment(text, base, column, row + table.first_row) for row, text in enumerate(column.values)]
    first = next((moment for moment in moments if moment is not None), None)
    if first is None:
        raise InputError(f"column '{base.column}' holds no instant at all; name another")
    if base.zone is None and not all(_has_zone(text) for text in column.values if text.strip()):
        notes.assume(f"times in '{base.column}' without a zone are UTC")
    seconds = np.array([np.nan if m is None else (m - first).total_seconds() for m in moments])
    return Clock(seconds, first)


def _moment(text: str, base: Iso, column: Column, row: int) -> datetime | None:
    if not text.strip():
        return None
    try:
        return _instant(text.strip(), base.zone or "UTC")
    except (ValueError, OverflowError):
        cure = "write it as 2024-05-03T12:00:00.125"
        raise InputError(f"column '{column.name}' row {row} holds '{text[:40]}', no ISO 8601 time; {cure}") from None


def _instant(text: str, zone: str) -> datetime:
    """The instant in UTC; digits beyond microseconds are cut off."""
    moment = datetime.fromisoformat(re.sub(r"([.,]\d{6})\d+", r"\1", text))
    if moment.tzinfo is None:
        ahead = "+00:00" if zone in ("UTC", "Z") else zone
        moment = datetime.fromisoformat(f"{moment.isoformat()}{ahead}")
    return moment.astimezone(UTC)


def _has_zone(text: str) -> bool:
    return (
        re.search(r"(Z|[+-]\d\d(:?\d\d)?)$", text.strip().partition("T")[2] or text.strip().partition(" ")[2])
        is not None
    )
