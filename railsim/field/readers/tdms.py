"""TDMS files (National Instruments), read with npTDMS."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from railsim.errors import InputError
from railsim.field.readers.interface import Wanted, column, instants, pick_group
from railsim.field.tables import Column, Table, place_of
from railsim.field.units import converter


def read(path: Path, wanted: list[Wanted]) -> list[Table]:
    """Channels of groups; an index file beside it is not used.

    Raises
    ------
    InputError : npTDMS is missing, or a group or channel is not in the file, or channels differ in length.
    """
    try:
        from nptdms import TdmsFile
    except ImportError:
        raise InputError("TDMS needs npTDMS, which is not installed: pip install 'railsim[field]'") from None
    with path.open("rb") as handle, TdmsFile.open(handle, raw_timestamps=False) as file:
        groups = file.groups()
        names = [str(group.name) for group in groups]
        tables = [_table(groups[pick_group(one.group, names)], one) for one in wanted]
        return [replace(table, cut_short=file.file_status.incomplete_final_segment) for table in tables]


def _table(group: Any, wanted: Wanted) -> Table:
    channels = list(group.channels())
    names = [str(channel.name) for channel in channels]
    columns: dict[str, Column] = {}
    start = None
    chosen = {name: channels[place_of(name, names, f"channel (group '{group.name}')")] for name in wanted.columns}
    for name, channel in chosen.items():
        columns[name], instant = _column(name, channel)
        start = instant or start
    lengths = {len(one.values) for one in columns.values()}
    if len(lengths) > 1:
        listed = ", ".join(f"'{name}' {len(one.values)}" for name, one in columns.items())
        raise InputError(f"channels of one table differ in length ({listed}); put those of each rate in a table")
    if not wanted.clock:
        return Table(columns, start=start)
    axes = {name: _axis(channel) for name, channel in chosen.items()}
    if len(set(axes.values())) > 1:
        listed = ", ".join(f"'{name}' {axis}" for name, axis in axes.items())
        raise InputError(
            f"channels of one table have different time axes ({listed}); give each of them a table of its own with "
            f"'group: \"{group.name}\"' and 'time: {{kind: own}}'"
        )
    axis = next(iter(axes.values()))
    return Table(columns, axis.first + axis.step * np.arange(max(lengths)), axis.start)


@dataclass(frozen=True)
class _Axis:
    """A waveform's own axis: distance of the samples and place of the first, s, and the instant of its zero."""

    step: float
    first: float
    start: str | None

    def __str__(self) -> str:
        since = "" if self.start is None else f" of {self.start}"
        return f"every {self.step:.6g} s from {self.first:.6g} s{since}"


def _column(name: str, channel: Any) -> tuple[Column, str | None]:
    values = np.asarray(channel[:])
    if values.dtype.kind == "M":
        stamps = values.astype("datetime64[ns]")
        return instants(name, stamps.astype(np.int64), np.isnat(stamps))
    return column(name, values, str(channel.properties.get("unit_string", ""))), None


def _axis(channel: Any) -> _Axis:
    """The axis of a waveform.

    Raises
    ------
    InputError : the channel is no waveform, or its axis is no time.
    """
    properties = channel.properties
    step, first = properties.get("wf_increment"), properties.get("wf_start_offset", 0.0)
    if not isinstance(step, float | int) or not 0 < step < np.inf:
        raise InputError(f"channel '{channel.name}' is no waveform (no wf_increment); name the column of time")
    unit = str(properties.get("wf_xunit_string", "") or "").strip() or "s"
    try:
        factor = converter(unit, "s", "wf_xunit_string").factor
    except InputError:
        raise InputError(
            f"the axis of channel '{channel.name}' is in '{unit}' (wf_xunit_string), no time; name a channel of time "
            "by 'time: {kind: seconds, column: ...}', or export the data over time"
        ) from None
    start = properties.get("wf_start_time")
    return _Axis(float(step) * factor, float(first) * factor, None if start is None else f"{np.datetime64(start)}Z")
