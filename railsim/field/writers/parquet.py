"""Parquet; every field states its unit, as `railsim import` reads it."""

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from railsim.field.writers.interface import Content, split_name, union

_ROWS = 1 << 20  # of a group


def write(content: Content, path: Path) -> None:
    """Write all sheets as one table.

    Parameters
    ----------
    content : sheets of several rates stand over all their times, with null where one has no row.
    path : the file.
    """
    columns = union(content.sheets)
    fields = [pa.field(name, pa.float64(), metadata={"unit": split_name(name)[1]}) for name in columns]
    about = {"origin": content.origin} | ({} if content.start is None else {"start": content.start.isoformat()})
    schema = pa.schema(fields, metadata=about)
    rows = next(iter(columns.values())).size
    with pq.ParquetWriter(path, schema) as writer:
        for first in range(0, max(rows, 1), _ROWS):
            part = [pa.array(column[first : first + _ROWS], from_pandas=True) for column in columns.values()]
            writer.write_table(pa.Table.from_arrays(part, schema=schema))
