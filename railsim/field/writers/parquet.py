"""Parquet; every field states its unit, as `railsim import` reads it."""

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from railsim.field.writers.interface import Content, names, parts, split_name

_ROWS = 1 << 18  # of a group


def write(content: Content, path: Path) -> None:
    """Write all sheets as one table.

    Parameters
    ----------
    content : sheets of several rates stand over all their times, with null where one has no row.
    path : the file.
    """
    titles = names(content.sheets)
    fields = [pa.field(name, pa.float64(), metadata={"unit": split_name(name)[1]}) for name in titles]
    about = {"origin": content.origin} | ({} if content.start is None else {"start": content.start.isoformat()})
    schema = pa.schema(fields, metadata=about)
    with pq.ParquetWriter(path, schema) as writer:
        for part in parts(content.sheets, _ROWS):
            arrays = [pa.array(column, from_pandas=True) for column in part]
            writer.write_table(pa.Table.from_arrays(arrays, schema=schema))
