"""MCAP, which viewers of time series read: a topic for each sensor with JSON messages and their schema."""

import heapq
import json
from collections.abc import Callable, Iterator, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from railsim.errors import InputError
from railsim.field.writers.interface import Content, Sheet
from railsim.measurements import TIME
from railsim.progress import counting

_ROWS = 1 << 14  # of a sheet at a time
_NANO = 1_000_000_000

Message = tuple[int, str, dict[str, float]]
"""Time in nanoseconds, topic, and values by field."""


def write(content: Content, path: Path) -> None:
    """Write all sheets over time, as the message `{"rate_pitch [rad/s]": 0.01}` of the topic `bogie`.

    Lost samples are left out. Times are nanoseconds since 1970 where the start is known, else since time 0. A column
    that no sensor measures, as of an estimate, has the label of its sheet as topic.

    Raises
    ------
    InputError : mcap is missing, or a sheet has no times, or some before 0 of an unknown start.
    """
    try:
        from mcap.writer import Writer
    except ImportError:
        raise InputError(
            "MCAP needs mcap, which is not installed: pip install 'railsim[mcap]'; or export to .parquet or .mat"
        ) from None
    begin = 0 if content.start is None else round(content.start.timestamp() * 1e6) * 1000
    _check(content.sheets, begin)
    about = {"origin": content.origin} | ({} if content.start is None else {"start": content.start.isoformat()})
    rows = sum(len(sheet.axis) for sheet in content.sheets)
    with path.open("wb") as file, counting(rows, f"writing {path.name}", "rows") as bar:
        writer = Writer(file)
        writer.start(library="railsim")
        writer.add_metadata("railsim", about)
        channels = {}
        for topic, fields in _fields(content.sheets).items():
            schema = {"title": topic, "type": "object", "properties": {name: {"type": "number"} for name in fields}}
            number = writer.register_schema(topic, "jsonschema", _bytes(schema))
            channels[topic] = writer.register_channel(topic, "json", number)
        parts = [_messages(sheet, begin, bar.update) for sheet in content.sheets]
        for nano, topic, values in heapq.merge(*parts, key=lambda message: message[0]):
            writer.add_message(channels[topic], nano, _bytes(values), nano)
        writer.finish()


def _check(sheets: Sequence[Sheet], begin: int) -> None:
    for sheet in sheets:
        if TIME not in sheet.columns:
            raise InputError(f"'{sheet.label}' has no times, which MCAP needs; export to .csv or .parquet")
        time = sheet.columns[TIME]
        if np.any(time < -begin / _NANO):
            raise InputError(f"'{sheet.label}' has times before 0, which MCAP cannot hold; export to .csv or .parquet")


def _place(name: str, label: str) -> tuple[str, str]:
    """Topic and field of a column: ("bogie", "rate_pitch [rad/s]") of "bogie.rate_pitch [rad/s]"."""
    full, bracket, unit = name.partition(" [")
    sensor, dot, quantity = full.rpartition(".")
    return (sensor, quantity + bracket + unit) if dot else (label, name)


def _fields(sheets: Sequence[Sheet]) -> dict[str, list[str]]:
    """Fields by topic; a sensor may measure at several rates."""
    found: dict[str, list[str]] = {}
    for sheet in sheets:
        for topic, field in (_place(name, sheet.label) for name in sheet.columns if name != TIME):
            found.setdefault(topic, []).append(field)
    return found


def _messages(sheet: Sheet, begin: int, done: Callable[[int], object]) -> Iterator[Message]:
    """Those of a sheet in the order of time; a row without a time, or of lost samples alone, has none."""
    time = sheet.columns[TIME]
    order = np.argsort(time, kind="stable")[: np.count_nonzero(np.isfinite(time))]
    topics: dict[str, list[tuple[str, np.ndarray]]] = {}
    for name, values in sheet.columns.items():
        if name != TIME:
            topic, field = _place(name, sheet.label)
            topics.setdefault(topic, []).append((field, values))
    for first in range(0, len(order), _ROWS):
        rows = order[first : first + _ROWS]
        nanos = [begin + round(one * 1e9) for one in time[rows].tolist()]
        lists = {topic: [(name, values[rows].tolist()) for name, values in some] for topic, some in topics.items()}
        for at, nano in enumerate(nanos):
            for topic, columns in lists.items():
                values = {name: column[at] for name, column in columns if isfinite(column[at])}
                if values:
                    yield nano, topic, values
        done(len(rows))


def _bytes(value: dict[str, Any]) -> bytes:
    return json.dumps(value).encode()
