"""MDF 4.10, written with asammdf: a channel group for each sheet, its master the time or the place."""

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from railsim.errors import InputError
from railsim.field.writers.interface import Content, Sheet, split_name
from railsim.progress import counting

if TYPE_CHECKING:
    from asammdf import Signal

_TIME, _DISTANCE = 1, 3  # kinds of a master channel
_UNDATED = datetime(1970, 1, 1, tzinfo=UTC)  # `railsim import` takes it as no date; the format has no other


def write(content: Content, path: Path) -> None:
    """Write every sheet as a group of its label; a known start is that of the file.

    Raises
    ------
    InputError : asammdf is missing.
    """
    try:
        from asammdf import MDF
    except ImportError:
        raise InputError(
            "MDF needs asammdf, which is not installed: pip install 'railsim[field]'; or export to .parquet or .mat"
        ) from None
    with counting(None, f"writing {path.name}", "s", by_clock=True), MDF(version="4.10") as file:
        file.header.comment = content.origin
        file.header.start_time = content.start or _UNDATED
        for sheet in content.sheets:
            file.append(_signals(sheet), acq_name=sheet.label, comment=content.origin)
        file.save(path, overwrite=True)


def _signals(sheet: Sheet) -> "list[Signal]":
    from asammdf import Signal

    (first, axis), *rest = sheet.columns.items()
    name, unit = split_name(first)
    master = (name, _TIME if unit == "s" else _DISTANCE)
    stamps = np.asarray(axis, dtype=np.float64)
    signals = []
    for full, values in rest:
        short, unit = split_name(full)
        samples = np.asarray(values, dtype=np.float64)
        signals.append(Signal(samples, stamps, unit=unit, name=short, master_metadata=master))
    return signals
