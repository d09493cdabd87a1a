"""Time bases: whatever a logger calls time, as seconds."""

from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta

import numpy as np

from railsim.errors import InputError
from railsim.field.channels import numbers
from railsim.field.durations import DAY_NS, SECOND_NS
from railsim.field.map import TableMap
from railsim.field.moments import read_moments
from railsim.field.tables import Column, Notes, Table
from railsim.field.time_bases import Counter, Epoch, Gps, Iso, Own, Rows, Seconds
from railsim.field.units import parse_unit
from railsim.field.zones import instant, to_utc

GPS_EPOCH = datetime(1980, 1, 6, tzinfo=UTC)
"""IS-GPS-200, 20.3.3.5.2.4."""

WEEK = 604800.0  # s


@dataclass(frozen=True)
class Clock:
    """Seconds of each row, shape (n,), after `start` (UTC), or after an unknown instant where that is None."""

    seconds: np.ndarray
    start: datetime | None


def read_clock(mapped: TableMap, table: Table, rows: int, notes: Notes) -> Clock:
    """Times of all `rows` as the map says; NaN where a row has none.

    Raises
    ------
    InputError : a cell is no number or instant, or the format has no time axis of its own.
    """
    base = mapped.time
    _refuse_instants(base, table)
    if isinstance(base, Rows):
        assert mapped.rate is not None
        clock = Clock(np.arange(rows) / mapped.rate, None)
        notes.assume(f"rows follow each other at {mapped.rate:.10g} Hz without a gap: the file has no time")
    elif isinstance(base, Own):
        clock = _own(base, table, notes)
    elif isinstance(base, Seconds):
        clock = _seconds(base, table, notes)
    elif isinstance(base, Epoch):
        clock = _epoch(base, table, notes)
    elif isinstance(base, Counter):
        clock = _counter(base, table, notes)
    elif isinstance(base, Gps):
        clock = _gps(base, table, notes)
    else:
        clock = _iso(base, table, notes)
    if mapped.time_offset:
        notes.assume(f"times moved by {mapped.time_offset:.10g} s, as the map says")
        return Clock(clock.seconds + mapped.time_offset, clock.start)
    return clock


def _refuse_instants(base: object, table: Table) -> None:
    """Refuse instants of a file's own type where the map takes them for numbers."""
    if isinstance(base, Seconds | Epoch | Counter) and table.columns[base.column].instants:
        raise InputError(
            f"column '{base.column}' holds instants, by its type in the file; write 'time: {{kind: iso, column: "
            f'"{base.column}"}}\''
        )


def _own(base: Own, table: Table, notes: Notes) -> Clock:
    assert table.clock is not None
    since = f", which begins at {table.start}" if table.start else ""
    zone = f" in {base.zone}" if base.zone and table.local else ""
    notes.assume(f"times as the file's own axis has them{since}{zone}")
    return Clock(table.clock, _start(table, base.zone, notes) if table.start else None)


def _start(table: Table, zone: str | None, notes: Notes) -> datetime:
    """The instant at which the file's own time begins."""
    assert table.start is not None
    text = table.start.removesuffix("Z").removesuffix("+00:00")
    try:
        nanoseconds = int(np.datetime64(text, "ns").astype(np.int64))
    except (ValueError, OverflowError):
        raise InputError(f"the file's axis begins at '{table.start[:40]}', no date") from None
    if not table.local:
        return instant(nanoseconds)
    if zone is None:
        notes.assume(
            f"the file states its start in local time ({text}) and no zone: taken as UTC; 'zone: Europe/Berlin' in "
            "'time' would say which it is"
        )
    return instant(int(to_utc(np.array([nanoseconds]), zone, "start of the file", notes)[0]))


def _seconds(base: Seconds, table: Table, notes: Notes) -> Clock:
    column = table.columns[base.column]
    values = numbers(column, table, base.lost, "of 'time' and 'drop_untimed' to repair")
    if column.duration:
        notes.assume(f"column '{base.column}' holds durations, by its type in the file")
        return Clock(values, None)
    seconds = parse_unit(base.unit).to_si(values)
    days = _counted_days(values) if base.unit == "s" else None
    if days is not None:
        whose = "spreadsheets do" if days == "excel" else "MATLAB's datenum does"
        raise InputError(
            f"column '{base.column}' counts days as {whose}, by its size and steps; write 'time: {{kind: "
            f'epoch, column: "{base.column}", unit: {days}}}\''
        )
    if looks_like_epoch(seconds):
        notes.assume(
            f"column '{base.column}' counts from 1970, by its size: 'kind: epoch' in place of 'seconds' would keep the "
            "date"
        )
    return Clock(seconds, None)


_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "excel": 86_400.0, "datenum": 86_400.0}
_SERIAL = 25_569.0  # days from the zero of spreadsheets, 30 December 1899, to 1970
_DATENUM = 719_529.0  # days from the zero of MATLAB's datenum, year 0, to 1970
_RECENT = (6.3e8, 4.1e9)  # s since 1970: 1990 to 2100


def _counted_days(values: np.ndarray) -> str | None:
    """Whose days elapsed times are, `excel` or `datenum`: of this century, in steps far below a second's."""
    good = values[np.isfinite(values)]
    if good.size < 3 or not 0 < np.median(np.diff(good)) < 1e-4:
        return None
    since = {"excel": _SERIAL, "datenum": _DATENUM}
    middle = float(np.median(good))
    return next((one for one, zero in since.items() if _RECENT[0] < 86_400 * (middle - zero) < _RECENT[1]), None)


def looks_like_epoch(seconds: np.ndarray) -> bool:
    """Whether elapsed times are those since 1970."""
    middle = float(np.nanmedian(seconds)) if np.isfinite(seconds).any() else 0.0
    return _RECENT[0] < middle < _RECENT[1]


def _epoch(base: Epoch, table: Table, notes: Notes) -> Clock:
    values = numbers(table.columns[base.column], table, base.lost, "of 'time' and 'drop_untimed' to repair")
    good = np.isfinite(values)
    if not good.any():
        raise InputError(f"column '{base.column}' holds no time at all; name another")
    middle = float(np.median(values[good]))
    zero = dict.fromkeys(_UNITS, 0.0) | {"excel": _SERIAL, "datenum": _DATENUM}
    fitting = [one for one, factor in _UNITS.items() if _RECENT[0] < factor * (middle - zero[one]) < _RECENT[1]]
    unit = base.unit or next(iter(fitting), None)
    if unit is None or unit not in fitting:
        raise InputError(
            f"column '{base.column}' holds {middle:.10g}, no time since 1970 in {base.unit or 's, ms, us or ns'}; "
            + (f"write 'unit: {fitting[0]}'" if fitting else "use a time of kind 'seconds'")
        )
    if base.unit is None:
        notes.assume(f"column '{base.column}' counts {unit} since 1970 (UTC), by its size")
    first = float(values[good][0])
    nanoseconds = round((first - zero[unit]) * _UNITS[unit] * 1e6) * 1000 if unit != "ns" else int(first)
    return Clock((values - first) * _UNITS[unit], instant(nanoseconds))


def _counter(base: Counter, table: Table, notes: Notes) -> Clock:
    count = numbers(table.columns[base.column], table, base.lost, "of 'time' and 'drop_untimed' to repair")
    good = np.flatnonzero(np.isfinite(count))
    low, high = (float(count[good].min()), float(count[good].max())) if good.size else (0.0, 0.0)
    least = base.minimum if base.minimum is not None else 0.0
    if base.minimum is None and -base.modulus / 2 <= low < 0 and high < base.modulus / 2:
        least = -base.modulus / 2
        notes.assume(f"counter '{base.column}' is signed: {least:.10g} ... {least + base.modulus - 1:.10g}")
    if low < least or high >= least + base.modulus:
        raise InputError(
            f"column '{base.column}' leaves {least:.10g} ... {least + base.modulus:.10g}: it holds {low:.10g} ... "
            f"{high:.10g}; correct 'modulus' or 'minimum'"
        )
    steps = np.diff(count[good])
    wraps = steps < -base.modulus / 2
    full = np.full(count.size, np.nan)
    full[good] = count[good] - (count[good[0]] if good.size else 0.0)
    full[good[1:]] += base.modulus * np.cumsum(wraps)
    longest = base.modulus / base.frequency
    notes.assume(
        f"counter '{base.column}' wraps at {base.modulus:.10g} ({int(wraps.sum())} times here); it begins at 0 s; a "
        f"gap of more than {longest:.4g} s cannot be seen"
    )
    return Clock(full / base.frequency, None)


def _gps(base: Gps, table: Table, notes: Notes) -> Clock:
    seconds = parse_unit(base.unit).to_si(
        numbers(table.columns[base.seconds], table, base.lost, "of 'time' and 'drop_untimed' to repair")
    )
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
    columns = [table.columns[name] for name in base.column]
    name = " ".join(base.column)
    if len(columns) == 1 and columns[0].instants:
        values = columns[0].values
        assert isinstance(values, np.ndarray)
        return Clock(values, _typed_start(base, name, table, notes))
    if any(not isinstance(column.values, list) for column in columns):
        raise InputError(
            f"column '{name}' holds numbers, no dates; use a time of kind 'seconds', 'epoch' or 'gps', or state "
            "'format'"
        )
    texts = _joined(columns)
    found = read_moments(texts, base, name, table, notes)
    good = ~found.lost
    if not good.any():
        raise InputError(f"column '{name}' holds no instant at all; name another")
    if not found.dated:
        return _time_of_day(found.nanoseconds, good, base, name, notes)
    nanoseconds = found.nanoseconds - found.ahead
    plain = good & ~found.zoned
    if plain.any():
        if base.zone is None:
            notes.assume(f"times in '{name}' without a zone are UTC")
        nanoseconds[plain] = to_utc(nanoseconds[plain], base.zone, f"column '{name}'", notes)
    first = int(nanoseconds[good][0])
    return Clock(np.where(good, (nanoseconds - first) * 1e-9, np.nan), instant(first))


def _typed_start(base: Iso, name: str, table: Table, notes: Notes) -> datetime:
    """Start of a column whose type in the file is that of instants."""
    if not table.local:
        notes.assume(f"column '{name}' holds instants in UTC, as its type in the file says")
        if base.zone is not None:
            notes.assume(f"time.zone is not used: the file states the zone of '{name}'")
        return _start(table, None, notes)
    if base.zone is None:
        notes.assume(f"column '{name}' holds instants without a zone: taken as UTC; 'zone' in 'time' would state it")
        return _start(replace(table, local=False), None, notes)
    notes.assume(f"column '{name}' holds instants without a zone: in {base.zone}, as the map says")
    return _start(table, base.zone, notes)


def _joined(columns: list[Column]) -> list[str]:
    """Texts of a column, or of a date and a time that stand in two."""
    lists = [column.values for column in columns if isinstance(column.values, list)]
    if len(lists) == 1:
        return lists[0]
    return [" ".join(cells) if all(cell.strip() for cell in cells) else "" for cells in zip(*lists, strict=True)]


def _time_of_day(nanoseconds: np.ndarray, good: np.ndarray, base: Iso, name: str, notes: Notes) -> Clock:
    """Times of day, on over midnight."""
    of_day = nanoseconds[good]
    days = np.concatenate([[0], np.cumsum(np.diff(of_day) < -DAY_NS // 2)])
    if days[-1]:
        notes.assume(f"times of day in '{name}' pass midnight {int(days[-1])} times")
    local = of_day + days * DAY_NS
    start = None
    if base.date is not None:
        local = local + int(np.datetime64(base.date, "ns").astype(np.int64))
        if base.zone is None:
            notes.assume(f"times in '{name}' without a zone are UTC")
        local = to_utc(local, base.zone, f"column '{name}'", notes)
        start = instant(int(local[0]))
    else:
        notes.assume(f"column '{name}' holds times of day and no date; 'date: 2024-05-03' in 'time' would state it")
    seconds = np.full(nanoseconds.size, np.nan)
    seconds[good] = (local - local[0]) / SECOND_NS if start else local / SECOND_NS
    return Clock(seconds, start)
