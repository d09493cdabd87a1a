"""TDMS files (National Instruments), read with npTDMS."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from railsim.errors import InputError
from railsim.field.readers.interface import Wanted, column, instants, pick_group
from railsim.field.tables import Column, Table, missing


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
    channels = {str(channel.name): channel for channel in group.channels()}
    columns: dict[str, Column] = {}
    start = None
    for name in wanted.columns:
        if name not in channels:
            raise missing(name, channels, f"channel (group '{group.name}')")
        columns[name], instant = _column(name, channels[name])
        start = instant or start
    lengths = {len(one.values) for one in columns.values()}
    if len(lengths) > 1:
        listed = ", ".join(f"'{name}' {len(one.values)}" for name, one in columns.items())
        raise InputError(f"channels of one table differ in length ({listed}); put those of each rate in a table")
    if not wanted.clock:
        return Table(columns, start=start)
    first = channels[wanted.columns[0]]
    return Table(columns, _clock(first), _start(first))


def _column(name: str, channel: Any) -> tuple[Column, str | None]:
    values = np.asarray(channel[:])
    if values.dtype.kind == "M":
        stamps = values.astype("datetime64[ns]")
        return instants(name, stamps.astype(np.int64), np.isnat(stamps))
    return column(name, values, str(channel.properties.get("unit_string", ""))), None


def _clock(channel: Any) -> np.ndarray:
    step = channel.properties.get("wf_increment")
    if not isinstance(step, float | int) or not 0 < step < np.inf:
        raise InputError(f"channel '{channel.name}' is no waveform (no wf_increment); name the column of time")
    first = float(channel.properties.get("wf_start_offset", 0.0))
    return first + float(step) * np.arange(len(channel))


def _start(channel: Any) -> str | None:
    start = channel.properties.get("wf_start_time")
    return None if start is None else f"{np.datetime64(start)}Z"
