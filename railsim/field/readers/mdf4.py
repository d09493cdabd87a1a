"""MDF4 files (ASAM MDF), read with asammdf."""

from pathlib import Path
from typing import Any

import numpy as np

from railsim.errors import InputError
from railsim.field.readers.interface import MOST_NAMES, Wanted, column, pick_group
from railsim.field.tables import Column, Table, missing

_MASTER = 2  # channel types 2 and 3 of the standard: master, virtual master


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
        names = [str(group.channel_group.acq_name or "") for group in groups]
        start = file.header.start_time.isoformat()
        return [_table(file, groups, pick_group(one.group, names), one, start) for one in wanted]


def _table(file: Any, groups: list[Any], number: int, wanted: Wanted, start: str) -> Table:
    group = groups[number]
    rows = int(group.channel_group.cycles_nr)
    names = [str(channel.name) for channel in group.channels]
    columns: dict[str, Column] = {}
    for name in wanted.columns:
        if name not in names:
            raise missing(name, names, f"channel (group {number})")
        if names.count(name) > 1:
            raise InputError(f"group {number} holds {names.count(name)} channels '{name}'; rename one")
        columns[name] = _column(file, number, names.index(name), name)
    clock = None
    if wanted.clock:
        if not any(channel.channel_type in (_MASTER, _MASTER + 1) for channel in group.channels):
            raise InputError(f"group {number} has no time axis of its own; name the column of time")
        clock = np.asarray(file.get_master(number), dtype=np.float64)
    for name, filled in columns.items():
        if len(filled.values) != rows or (clock is not None and clock.size != rows):
            raise InputError(f"channel '{name}' has {len(filled.values)} of the {rows} samples that the file states")
    return Table(columns, clock, start)


def _column(file: Any, group: int, index: int, name: str) -> Column:
    signal = file.get(group=group, index=index, ignore_invalidation_bits=True)
    converted = column(name, signal.samples, str(signal.unit or ""))
    invalid = signal.invalidation_bits
    if invalid is not None and isinstance(converted.values, np.ndarray):
        converted.values[np.asarray(invalid, dtype=bool)] = np.nan
    return converted
