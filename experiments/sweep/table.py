"""The table of a sweep: a row a run, estimator, seed and score; the bytes depend on nothing but the contents."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from experiments.sweep.plan import Plan
from experiments.sweep.task import Row, Task
from railsim.errors import InputError
from railsim.files import new_file

_GROUP_ROWS = 65536
_NEAR = 64  # tasks whose rows are kept while points that follow each other are gathered
_STATUS = 8  # its place in a row


def write_table(plan: Plan, rows_of: Callable[[Task], list[Row]], path: Path) -> dict[str, int]:
    """Write all rows in design order, part by part: the memory that it takes does not grow with the sweep.

    Parameters
    ----------
    plan : tells design values and bad points. rows_of : the rows of a finished task. path : of the Parquet file.

    Returns
    -------
    How many rows of each status.

    Columns: "point", "run" (digest of the simulated run), one a factor, "sensors", "estimator", "seed", "recording"
    (digest of what was measured), "score", "unit", "value", "status", "message".
    """
    status: Counter[str] = Counter()
    with new_file(path) as aside, _writer(aside, _schema(plan)) as writer:
        for rows in _parts(_ordered(plan, rows_of)):
            status.update(row[_STATUS] for row in rows)
            writer.write_table(_table(plan, rows), row_group_size=_GROUP_ROWS)
    return dict(sorted(status.items()))


def _ordered(plan: Plan, rows_of: Callable[[Task], list[Row]]) -> Iterator[Row]:
    """Rows by point, sensor set, variant and seed; the scores of one estimate stay in their order."""
    places = {seed: place for place, seed in enumerate(plan.sweep.seeds)}
    owner = {point.number: task for task in plan.tasks for point in task.points}

    @lru_cache(_NEAR)
    def by_point(number: int) -> dict[int, list[Row]]:
        found: dict[int, list[Row]] = {}
        for row in rows_of(plan.tasks[number]):
            found.setdefault(row[0], []).append(row)
        return found

    bad = {number: [] for number in plan.bad}
    for row in plan.bad_rows():
        bad[row[0]].append(row)
    for number in range(plan.points):
        rows = bad[number] if number in bad else by_point(owner[number].number).get(number, [])
        yield from sorted(rows, key=lambda row: (row[1], row[2], places[row[3]]))


def _parts(rows: Iterator[Row]) -> Iterator[list[Row]]:
    part: list[Row] = []
    for row in rows:
        part.append(row)
        if len(part) == _GROUP_ROWS:
            yield part
            part = []
    if part:
        yield part


def _schema(plan: Plan) -> pa.Schema:
    factors = [(name, pa.float64() if kind == "number" else pa.string()) for name, (kind, _) in plan.columns.items()]
    before = [("point", pa.int64()), ("run", pa.string()), *factors]
    names = [(name, pa.string()) for name in ("sensors", "estimator")]
    found = [(name, pa.string()) for name in ("recording", "score", "unit")]
    end = [("value", pa.float64()), ("status", pa.string()), ("message", pa.string())]
    return pa.schema([*before, *names, ("seed", pa.int64()), *found, *end])


def _table(plan: Plan, rows: Sequence[Row]) -> pa.Table:
    point, at, which, seed, *measured = (list(one) for one in zip(*rows, strict=True))
    columns: list[list[Any]] = [point, [plan.runs.get(number) for number in point]]
    columns += [[values[number] for number in point] for _, values in plan.columns.values()]
    columns += [[plan.sweep.sets[place].name for place in at], [plan.sweep.variants[place].label for place in which]]
    columns += [seed, *measured]
    schema = _schema(plan)
    return pa.table([pa.array(one, kind) for one, kind in zip(columns, schema.types, strict=True)], schema=schema)


def _writer(path: Path, schema: pa.Schema) -> pq.ParquetWriter:
    """A Parquet file without a time of writing."""
    return pq.ParquetWriter(
        path, schema, compression="zstd", compression_level=3, write_statistics=False, store_schema=False
    )


def table_parts(path: Path, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
    """Some columns of the table in parts of at most `_GROUP_ROWS` rows; raises as `read_table`."""
    with _told(path), pq.ParquetFile(path) as file:
        for part in file.iter_batches(_GROUP_ROWS, columns=list(columns)):
            yield part.to_pandas()


def read_table(path: Path, columns: Sequence[str] | None = None) -> pd.DataFrame:
    """The table as a frame, all of its columns or some; raises `InputError` where there is none."""
    with _told(path):
        return pq.read_table(path, columns=list(columns) if columns else None).to_pandas()


@contextmanager
def _told(path: Path) -> Iterator[None]:
    try:
        yield
    except FileNotFoundError:
        raise InputError(f"'{path.parent}' has no table yet; run the sweep to its end first") from None
    except (OSError, pa.ArrowException):
        raise InputError(f"'{path}' is not a whole Parquet file; remove it and run the sweep again") from None
