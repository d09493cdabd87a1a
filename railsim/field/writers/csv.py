"""Text: comma-separated values with decimal points; the names hold the units, as `railsim import` reads them."""

from pathlib import Path

import pyarrow as pa
import pyarrow.csv

from railsim.field.writers.interface import Content, names, parts

_ROWS = 1 << 16  # written at a time


def write(content: Content, path: Path) -> None:
    """Write all sheets as one table; every number comes back as it was.

    Parameters
    ----------
    content : sheets of several rates stand over all their times, with empty cells where one has no row.
    path : the file.
    """
    schema = pa.schema([(name, pa.float64()) for name in names(content.sheets)])
    options = pyarrow.csv.WriteOptions(quoting_header="none")
    with pyarrow.csv.CSVWriter(str(path), schema, write_options=options) as writer:
        for part in parts(content.sheets, _ROWS):
            arrays = [pa.array(column, from_pandas=True) for column in part]
            writer.write_table(pa.Table.from_arrays(arrays, schema=schema))
