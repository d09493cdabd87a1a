"""What is kept of a result: a few numbers of every column, which are written, read and compared."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

POINTS = 12  # evenly spaced rows of a column that are kept as they are
RMS = 3  # place of the root mean square among the values of a column
TOLERANCE = 1e-9  # relative to the root mean square of the column
COLUMN, SCALAR, TEXT = "column", "scalar", "text"
HEAD = "record"  # part of a file that tells of the recording of it

Key = tuple[str, str]


@dataclass(frozen=True)
class Row:
    """What is kept of one quantity.

    Attributes
    ----------
    kind : "column": length, number of finite values, mean, root mean square, least and largest of these, then some
        values; "scalar": its value; "text": length, number of different texts, then some of them.
    """

    kind: str
    values: tuple[float | str, ...]


@dataclass(frozen=True)
class Record:
    """What is kept of all that one estimator or figure gives.

    Attributes
    ----------
    rows : by part (a recording, a table) and quantity. seconds : that it took when it was recorded.
    tolerance : of differences between processors, relative to each column's root mean square.
    """

    rows: Mapping[Key, Row]
    seconds: float = 0.0
    tolerance: float = TOLERANCE

    def save(self, path: Path) -> None:
        """Write as CSV; every number keeps all its digits."""
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["part", "quantity", "kind", "values"])
            writer.writerow([HEAD, "seconds", SCALAR, f"{self.seconds:.1f}"])
            writer.writerow([HEAD, "tolerance", SCALAR, f"{self.tolerance:.1e}"])
            for (part, quantity), row in self.rows.items():
                writer.writerow([part, quantity, row.kind, *map(_written, row.values)])

    @classmethod
    def open(cls, path: Path) -> "Record":
        """Read what `save` wrote."""
        with path.open(encoding="utf-8", newline="") as file:
            found = {(part, name): _read(kind, values) for part, name, kind, *values in list(csv.reader(file))[1:]}
        seconds, tolerance = (float(found.pop((HEAD, name)).values[0]) for name in ("seconds", "tolerance"))
        return cls(found, seconds, tolerance)

    def but(self, **changes: Any) -> "Record":
        """With other seconds or another tolerance."""
        return replace(self, **changes)


def _written(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.17g}"


def _read(kind: str, values: Sequence[str]) -> Row:
    return Row(kind, tuple(values) if kind == TEXT else tuple(map(float, values)))


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


@dataclass(frozen=True)
class Differences:
    """How far two records of the same are apart.

    Attributes
    ----------
    largest : relative difference; infinite where something is lacking or another text. where : part and quantity.
    apart : what is lacking, new, or of another kind, length or text.
    """

    largest: float = 0.0
    where: Key = ("", "")
    apart: list[Key] = field(default_factory=list)

    def text(self) -> str:
        """In words."""
        also = "".join(f"\n  other: {' / '.join(key)}" for key in self.apart[:20])
        return f"largest difference {self.largest:.1e} {' / '.join(self.where)}{also}"


def differences(old: Record, new: Record) -> Differences:
    """Compare every row of two records."""
    keys = dict.fromkeys([*old.rows, *new.rows])
    found = {key: _difference(old.rows.get(key), new.rows.get(key)) for key in keys}
    worst = max(found, key=lambda key: found[key], default=("", ""))
    return Differences(found.get(worst, 0.0), worst, [key for key, one in found.items() if np.isinf(one)])


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
