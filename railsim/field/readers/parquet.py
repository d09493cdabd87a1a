"""Parquet files, read with pyarrow."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from railsim.errors import InputError
from railsim.field.readers.interface import Wanted, column, instants
from railsim.field.tables import Column, Table, place_of

_TICKS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


def read(path: Path, wanted: list[Wanted]) -> list[Table]:
    """Columns of a file; there are no groups.

    Raises
    ------
    InputError : a column or group that the file has not, or values that are no numbers, texts or instants.
    """
    with path.open("rb") as handle, pq.ParquetFile(handle) as file:
        return [_table(file, one) for one in wanted]


def _table(file: Any, wanted: Wanted) -> Table:
    if wanted.group is not None:
        raise InputError("a Parquet file has no groups; leave 'group' out")
    if wanted.clock:
        raise InputError("a Parquet file has no time axis of its own; name the column of time")
    names = list(file.schema_arrow.names)
    columns: dict[str, Column] = {}
    start, local = None, False
    for name in wanted.columns:
        own = names[place_of(name, names, "column")]
        if names.count(own) > 1:
            raise InputError(f"column '{own}' stands {names.count(own)} times in the file; rename one")
        table = file.read(columns=[own], use_threads=False)
        field = table.schema.field(0)
        columns[name], instant = _column(name, table.column(0), field)
        if instant is not None:
            start, local = instant, getattr(field.type, "tz", None) is None
    return Table(columns, start=start, local=local)


def _column(name: str, values: pa.ChunkedArray, field: pa.Field) -> tuple[Column, str | None]:
    kind = field.type
    if pa.types.is_timestamp(kind):
        lost = np.asarray(values.is_null())
        raw = values.cast(pa.timestamp("ns", tz=kind.tz)).cast(pa.int64()).fill_null(0).to_numpy()
        return instants(name, np.asarray(raw), lost)
    if pa.types.is_date(kind):
        days = values.cast(pa.timestamp("ns"))
        return instants(name, np.asarray(days.cast(pa.int64()).fill_null(0).to_numpy()), np.asarray(values.is_null()))
    if pa.types.is_duration(kind) or pa.types.is_time(kind):
        lost = np.asarray(values.is_null())
        ticks = values.cast(pa.int32() if kind.bit_width == 32 else pa.int64()).fill_null(0).to_numpy()
        seconds = np.where(lost, np.nan, np.asarray(ticks, dtype=np.float64) * _TICKS[kind.unit])
        return Column(name, seconds, "s", duration=True), None
    if pa.types.is_dictionary(kind):
        values = values.cast(kind.value_type)
    if pa.types.is_decimal(kind):
        values = values.cast(pa.float64())
    stated = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
    if pa.types.is_floating(values.type) or pa.types.is_integer(values.type) or pa.types.is_boolean(values.type):
        numbers = values.cast(pa.float64(), safe=False) if not pa.types.is_floating(values.type) else values
        return column(name, numbers.to_numpy(), stated), None
    if pa.types.is_string(values.type) or pa.types.is_large_string(values.type):
        return column(name, np.array(values.to_pylist(), dtype=object), stated), None
    raise InputError(f"column '{name}' holds {kind}; choose one with numbers")
