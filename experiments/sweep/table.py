"""The table of a sweep: a row a run, estimator, seed and score; the bytes depend on nothing but the contents."""

import io
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from experiments.sweep.plan import Plan
from experiments.sweep.task import Row
from railsim.errors import InputError

_GROUP_ROWS = 65536


def assemble(plan: Plan, finished: Iterable[list[Row]]) -> pa.Table:
    """All rows in design order.

    Parameters
    ----------
    plan : tells design values and bad points.
    finished : the rows of every task, in any order.

    Returns
    -------
    Columns "point", "run" (digest of the simulated run), one a factor, "sensors", "estimator", "seed", "recording"
    (digest of what was measured), "score", "unit", "value", "status", "message".
    """
    rows = [*plan.bad_rows(), *(row for rows in finished for row in rows)]
    places = {seed: place for place, seed in enumerate(plan.sweep.seeds)}
    rows.sort(key=lambda row: (row[0], row[1], row[2], places[row[3]]))  # stable: scores stay in their order
    point, at, which, seed, recording, score, unit, value, status, message = (
        list(one) for one in zip(*rows, strict=True)
    )
    arrays: dict[str, pa.Array] = {
        "point": pa.array(point, pa.int64()),
        "run": pa.array([plan.runs.get(number) for number in point], pa.string()),
    }
    for name, (kind, values) in plan.columns.items():
        arrays[name] = pa.array([values[number] for number in point], pa.float64() if kind == "number" else pa.string())
    arrays |= {
        "sensors": pa.array([plan.sweep.sets[place].name for place in at], pa.string()),
        "estimator": pa.array([plan.sweep.variants[place].label for place in which], pa.string()),
        "seed": pa.array(seed, pa.int64()),
        "recording": pa.array(recording, pa.string()),
        "score": pa.array(score, pa.string()),
        "unit": pa.array(unit, pa.string()),
        "value": pa.array(value, pa.float64()),
        "status": pa.array(status, pa.string()),
        "message": pa.array(message, pa.string()),
    }
    return pa.table(arrays)


def table_bytes(table: pa.Table) -> bytes:
    """A Parquet file of the table, without a time of writing."""
    target = io.BytesIO()
    pq.write_table(
        table, target, compression="zstd", compression_level=3, write_statistics=False, store_schema=False,
        row_group_size=_GROUP_ROWS,
    )  # fmt: skip
    return target.getvalue()


def read_table(path: Path) -> pd.DataFrame:
    """The table as a frame; raises `InputError` where there is none."""
    try:
        return pq.read_table(path).to_pandas()
    except FileNotFoundError:
        raise InputError(f"'{path.parent}' has no table yet; run the sweep to its end first") from None
    except (OSError, pa.ArrowException):
        raise InputError(f"'{path}' is not a whole Parquet file; remove it and run the sweep again") from None


def counts(table: pa.Table) -> dict[str, Any]:
    """How many rows of each status."""
    found = table.column("status").to_pylist()
    return {status: found.count(status) for status in sorted(set(found))}
