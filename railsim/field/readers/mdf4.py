"""MDF files (ASAM MDF) of versions 3 and 4, read with asammdf."""

from dataclasses import replace
from datetime import UTC
from pathlib import Path
from typing import Any

import numpy as np

from railsim.errors import InputError
from railsim.field.readers.interface import MOST_NAMES, Wanted, column, pick_group
from railsim.field.tables import Column, Table, place_of

_MASTERS = (2, 3)  # channel types of version 4: master, virtual master; of version 3: 1
_SYNC = {1: "time", 2: "an angle", 3: "a distance", 4: "an index"}
_TIME, _DISTANCE, _INDEX = 1, 3, 4
_LOCAL = 1  # flag of the header: its start is a local time
_UNDATED = "1980-01-01T00:00:00"  # start of files of version 3 whose writer knew no date


def read(path: Path, wanted: list[Wanted]) -> list[Table]:
    """Channels of channel groups; attachments and bus logging are left alone.

    Raises
    ------
    InputError : asammdf is missing, or a group or channel is not in the file or ambiguous.
    """
    try:
        from asammdf import MDF
        from asammdf.blocks.utils import MdfException
    except ImportError:
        raise InputError("MDF4 needs asammdf, which is not installed: pip install 'railsim[field]'") from None
    try:
        return _tables(MDF, path, wanted)
    except MdfException as error:
        raise ValueError(str(error)) from None


def _tables(mdf: Any, path: Path, wanted: list[Wanted]) -> list[Table]:
    with path.open("rb") as handle:
        file = mdf(handle, process_bus_logging=False, use_display_names=False)
        groups = list(file.groups)
        if sum(len(group.channels) for group in groups) > MOST_NAMES:
            raise InputError(f"the file states more than {MOST_NAMES} channels; damaged?")
        names = [_group_name(group.channel_group) for group in groups]
        contents = [[str(channel.name) for channel in group.channels] for group in groups]
        start, local = _start(file.header, str(file.version))
        return [_table(file, groups, pick_group(one.group, names, contents), one, (start, local)) for one in wanted]


def _group_name(group: Any) -> str:
    """Name of the acquisition, or the group's comment, or its source; version 3 has comments alone."""
    source = getattr(getattr(group, "acq_source", None), "name", None)
    found = [getattr(group, "acq_name", None), getattr(group, "comment", None), source]
    return next((str(text).strip() for text in found if text and str(text).strip()), "")


def _start(header: Any, version: str) -> tuple[str | None, bool]:
    """(instant at which the file begins, whether that is a local time)."""
    start = header.start_time
    if version < "4":
        text = start.replace(tzinfo=None).isoformat()
        return (None, False) if text == _UNDATED else (text, True)
    if int(getattr(header, "time_flags", 0) or 0) & _LOCAL:
        return start.replace(tzinfo=None).isoformat(), True
    if start.timestamp() == 0.0:
        return None, False  # nanosecond 0 of 1970: whoever wrote it knew no date
    return start.astimezone(UTC).isoformat(), False


def _table(file: Any, groups: list[Any], number: int, wanted: Wanted, start: tuple[str | None, bool]) -> Table:
    group = groups[number]
    rows = int(group.channel_group.cycles_nr)
    names = [str(channel.name) for channel in group.channels]
    columns = {name: _column(file, number, place_of(name, names, "channel"), name) for name in wanted.columns}
    clock = None
    if wanted.clock:
        _check_master(group, number, names)
        clock = np.asarray(file.get_master(number), dtype=np.float64)
    for name, filled in columns.items():
        if len(filled.values) != rows or (clock is not None and clock.size != rows):
            raise InputError(
                f"channel '{name}' has {len(filled.values)} of the {rows} samples that the file states; copy it again"
            )
    return Table(columns, clock, start[0], local=start[1])


def _check_master(group: Any, number: int, names: list[str]) -> None:
    """Refuse a group whose own axis is no time.

    Raises
    ------
    InputError : no master channel, or one of a distance, angle or index; the line says how to go on.
    """
    masters = [one for one in group.channels if _is_master(one)]
    if not masters:
        raise InputError(f"group {number} has no time axis of its own; name the column of time{_times(group, names)}")
    sync = int(getattr(masters[0], "sync_type", _TIME) or _TIME)
    if sync == _TIME:
        return
    name, unit = str(masters[0].name), str(getattr(masters[0], "unit", "") or "-")
    cure = f"name a column of time{_times(group, names)}, or export the data over time"
    if sync == _DISTANCE:
        cure += f"; a file of a track-recording car is a 'kind: track' with 'kilometrage: {{column: \"{name}\"}}'"
    if sync == _INDEX:
        cure = "write 'time: {kind: rows}' and the 'rate' of the rows"
    raise InputError(f"the axis of group {number}, '{name}' [{unit}], is {_SYNC.get(sync, 'no time')}, no time; {cure}")


def _is_master(channel: Any) -> bool:
    return channel.channel_type in ((1,) if not hasattr(channel, "sync_type") else _MASTERS)


def _times(group: Any, names: list[str]) -> str:
    """The channel that may be the time, as the line of the map that reads it."""
    for channel, name in zip(group.channels, names, strict=True):
        unit = str(getattr(channel, "unit", "") or "").strip()
        if unit in ("s", "ms", "us", "ns", "min", "h") and not _is_master(channel):
            return f", as 'time: {{kind: seconds, column: \"{name}\", unit: {unit}}}'"
    return ""


def _column(file: Any, group: int, index: int, name: str) -> Column:
    signal = file.get(group=group, index=index, ignore_invalidation_bits=True)
    converted = column(name, signal.samples, str(signal.unit or ""))
    invalid = signal.invalidation_bits
    if invalid is None or not isinstance(converted.values, np.ndarray):
        return converted
    return replace(converted, values=np.where(np.asarray(invalid, dtype=bool), np.nan, converted.values))
