"""What is kept of a result: a few numbers of every column, which are written, read and compared."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

POINTS = 12  # evenly spaced rows of a column that are kept as they are
RMS = 3  # place of the root mean square among the values of a column
TOLERANCE = 1e-9  # relative to the root mean square of the column
COLUMN, SCALAR, TEXT = "column", "scalar", "text"
Key = tuple[str, str]
SECONDS: Key = ("record", "seconds")  # what a file says of the recording itself


@dataclass(frozen=True)
class Row:
    """What is kept of one quantity.

    Attributes
    ----------
    kind : "column": length, number of finite values, mean, root mean square, least and largest of these, then some
        values; "scalar": its value; "text": length, number of different texts, then some of them.
    tolerance : of differences between processors, relative to the root mean square or to the scalar's size.
    """

    kind: str
    values: tuple[float | str, ...]
    tolerance: float = TOLERANCE


@dataclass(frozen=True)
class Record:
    """What is kept of all that one estimator or figure gives.

    Attributes
    ----------
    rows : by part (a recording, a table) and quantity. seconds : of one processor, that it took when it was recorded.
    """

    rows: Mapping[Key, Row]
    seconds: float = 0.0

    def save(self, path: Path) -> None:
        """Write as CSV; every number keeps all its digits."""
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["part", "quantity", "kind", "tolerance", "values"])
            writer.writerow([*SECONDS, SCALAR, "", f"{self.seconds:.1f}"])
            for key, row in self.rows.items():
                tolerance = f"{row.tolerance:.1e}" if row.tolerance > TOLERANCE else ""
                writer.writerow([*key, row.kind, tolerance, *map(_written, row.values)])

    @classmethod
    def open(cls, path: Path) -> "Record":
        """Read what `save` wrote."""
        with path.open(encoding="utf-8", newline="") as file:
            found = {(part, name): _read(kind, *rest) for part, name, kind, *rest in list(csv.reader(file))[1:]}
        return cls(found, float(found.pop(SECONDS).values[0]))

    def loosened(self, by: Mapping[Key, float]) -> "Record":
        """With tolerances that are at least these."""
        rows = {key: replace(row, tolerance=max(row.tolerance, by.get(key, 0.0))) for key, row in self.rows.items()}
        return replace(self, rows=rows)


def _written(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.17g}"


def _read(kind: str, tolerance: str, *values: str) -> Row:
    return Row(kind, values if kind == TEXT else tuple(map(float, values)), float(tolerance or TOLERANCE))


def table_rows(part: str, table: pd.DataFrame) -> dict[Key, Row]:
    """What is kept of every column of a table."""
    return {(part, str(name)): column(table[name].tolist()) for name in table.columns}


def column(values: Sequence[Any]) -> Row:
    """What is kept of a column of numbers or texts; None is not a number."""
    places = np.linspace(0, len(values) - 1, min(POINTS, len(values))).round().astype(int) if len(values) else []
    if any(isinstance(one, str) for one in values):
        texts = [str(one) for one in values]
        return Row(TEXT, (str(len(texts)), str(len(set(texts))), *(texts[place] for place in places)))
    numbers = np.array([np.nan if one is None else one for one in values], dtype=float)
    finite = numbers[np.isfinite(numbers)]
    known: tuple[float, ...] = (np.nan,) * 4
    if len(finite):
        known = (finite.mean(), np.sqrt(np.mean(finite**2)), finite.min(), finite.max())
    head = (len(numbers), len(finite), *known)
    return Row(COLUMN, tuple(map(float, (*head, *(numbers[place] for place in places)))))


def leaf_rows(part: str, name: str, value: Any) -> dict[Key, Row]:
    """What is kept of the numbers in a JSON value; lists of numbers and of tables' rows are columns."""
    if isinstance(value, Mapping):
        return _joined(leaf_rows(part, f"{name}.{key}", one) for key, one in value.items() if key != "software")
    if isinstance(value, bool | int | float | None):
        return {(part, name): Row(SCALAR, (np.nan if value is None else float(value),))}
    if not isinstance(value, list | tuple) or not value:
        return {}
    if all(isinstance(one, Mapping) for one in value):
        keys = dict.fromkeys(key for one in value for key in one)
        return leaf_rows(part, name, {key: [one.get(key) for one in value] for key in keys})
    if all(isinstance(one, bool | int | float | None) for one in value):
        return {(part, name): column(value)}
    if all(isinstance(one, list | tuple) for one in value) and all(_number(one) for row in value for one in row):
        return {(part, name): column([one for row in value for one in row])}
    return _joined(leaf_rows(part, f"{name}.{place}", one) for place, one in enumerate(value))


def _number(value: Any) -> bool:
    return isinstance(value, bool | int | float | None)


def _joined(several: Any) -> dict[Key, Row]:
    return {key: row for rows in several for key, row in rows.items()}


def differences(old: Record, new: Record) -> dict[Key, float]:
    """Relative difference of every row; infinite where it is lacking, new, or of another kind, length or text."""
    return {key: _difference(old.rows.get(key), new.rows.get(key)) for key in dict.fromkeys([*old.rows, *new.rows])}


def beyond(old: Record, found: Mapping[Key, float], times: float = 1.0) -> dict[Key, float]:
    """Those of the differences that some times the record's tolerances do not allow."""
    return {key: one for key, one in found.items() if key not in old.rows or one > times * old.rows[key].tolerance}


def _difference(old: Row | None, new: Row | None) -> float:
    """Relative to the old root mean square, or for a scalar to its size."""
    if old is None or new is None or old.kind != new.kind or len(old.values) != len(new.values):
        return np.inf
    if old.kind == TEXT:
        return 0.0 if old.values == new.values else np.inf
    before, after = np.array(old.values, dtype=float), np.array(new.values, dtype=float)
    if old.kind == COLUMN and not np.array_equal(before[:2], after[:2]):
        return np.inf
    same = (before == after) | (np.isnan(before) & np.isnan(after))
    if same.all():
        return 0.0
    scale = float(abs(before[RMS] if old.kind == COLUMN else before[0]))
    apart = np.abs(before - after)[~same]
    return float(np.max(apart) / scale) if scale > 0.0 and np.isfinite(apart).all() else np.inf
