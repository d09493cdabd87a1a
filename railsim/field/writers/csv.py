"""Text: comma-separated values with decimal points; the names hold the units, as `railsim import` reads them."""

from pathlib import Path

import pyarrow as pa
import pyarrow.csv

from railsim.field.writers.interface import Content, union

_ROWS = 1 << 16  # written at a time


def write(content: Content, path: Path) -> None:
    """Write all sheets as one table; every number comes back as it was.

    Parameters
    ----------
    content : sheets of several rates stand over all their times, with empty cells where one has no row.
    path : the file.
    """
    columns = union(content.sheets)
    schema = pa.schema([(name, pa.float64()) for name in columns])
    rows = next(iter(columns.values())).size
    options = pyarrow.csv.WriteOptions(quoting_header="none")
    with pyarrow.csv.CSVWriter(str(path), schema, write_options=options) as writer:
        for first in range(0, max(rows, 1), _ROWS):
            part = [pa.array(column[first : first + _ROWS], from_pandas=True) for column in columns.values()]
            writer.write_table(pa.Table.from_arrays(part, schema=schema))
