"""Tables of float64 columns as Parquet files whose bytes depend on nothing but the numbers."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from railsim.errors import InputError

GROUP_ROWS = 16384
MEMORY = 1_000_000_000  # bytes of numbers that a table of any size may hold
MEMORY_A_BYTE = 20.0  # further ones for each byte of the file; equal values pack a thousand times denser


def open_writer(path: Path, columns: list[str]) -> pq.ParquetWriter:
    """A writer of float64 `columns`: byte streams split, Zstandard, no statistics, no time of writing."""
    schema = pa.schema([pa.field(name, pa.float64(), nullable=False) for name in columns])
    return pq.ParquetWriter(
        path,
        schema,
        compression="zstd",
        compression_level=1,
        use_dictionary=False,
        use_byte_stream_split=True,
        write_statistics=False,
        store_schema=False,
    )


def write_columns(writer: pq.ParquetWriter, columns: list[np.ndarray]) -> None:
    """Append one row group; `columns` in the order of the writer's schema, each of shape (n,)."""
    arrays = [pa.array(np.ascontiguousarray(column, dtype=np.float64)) for column in columns]
    writer.write_table(pa.Table.from_arrays(arrays, schema=writer.schema), row_group_size=max(1, len(columns[0])))


def write_frame(path: Path, frame: pd.DataFrame) -> None:
    """Write a frame of numbers, NaN included, in groups of `GROUP_ROWS` rows."""
    columns = [frame.iloc[:, i].to_numpy(dtype=np.float64) for i in range(frame.shape[1])]
    with open_writer(path, [str(name) for name in frame.columns]) as writer:
        for first in range(0, len(frame), GROUP_ROWS):
            write_columns(writer, [column[first : first + GROUP_ROWS] for column in columns])


def read_names(path: Path) -> tuple[list[str], int]:
    """(column names, number of rows), from the file's footer alone.

    Raises
    ------
    InputError : missing, cut short or not a table of numbers.
    """
    with _open(path) as file:
        try:
            fields = {field.name: field.type for field in file.schema_arrow}
            names, rows = list(file.schema_arrow.names), int(file.metadata.num_rows)
        except (UnicodeDecodeError, pa.ArrowException):
            raise InputError(f"'{path}' is damaged in its columns' names; make or copy it again") from None
    for name, kind in fields.items():
        if not (pa.types.is_floating(kind) or pa.types.is_integer(kind)):
            raise InputError(f"'{path}': column '{name}' holds {kind}; every column must hold numbers")
    return names, rows


def read_column(path: Path, name: str) -> np.ndarray:
    """Column `name` as float64, shape (rows,).

    Raises
    ------
    InputError : missing, cut short or damaged file.
    """
    return read_columns(path, [name])[name]


def read_columns(path: Path, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Columns as float64 by name, each of shape (rows,), one after the other from a file that is opened once.

    Raises
    ------
    InputError : missing, cut short or damaged file.
    """
    with _open(path) as file:
        return {name: _column(file, path, name) for name in names}


def _column(file: Any, path: Path, name: str) -> np.ndarray:
    try:
        column = file.read(columns=[name]).column(name)
        return np.asarray(column.to_numpy(), dtype=np.float64)
    except (OSError, pa.ArrowException):
        raise InputError(f"'{path}' is damaged at column '{name}'; make or copy it again") from None


def _open(path: Path) -> Any:
    try:
        file = pq.ParquetFile(path)
        numbers, size = 8 * file.metadata.num_rows * file.metadata.num_columns, path.stat().st_size
        if numbers <= MEMORY + MEMORY_A_BYTE * size:
            return file
    except FileNotFoundError:
        raise InputError(f"'{path}' is missing; make or copy its folder again") from None
    except (OSError, UnicodeDecodeError, pa.ArrowException):
        raise InputError(f"'{path}' is not a whole Parquet file (cut short?); make or copy it again") from None
    file.close()
    raise InputError(
        f"'{path}' has {size / 1e6:.3g} MB and would take {numbers / 1e9:.3g} GB of memory, which no measured data do; "
        "make or copy it again, or cut it into pieces"
    )
