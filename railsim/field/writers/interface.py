"""What a writer is given, and how names and units go into a format."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from railsim.measurements import TIME
from railsim.progress import counted

_NAME = re.compile(r"(.*\S)\s+\[([^\[\]]+)\]")


@dataclass(frozen=True)
class Sheet:
    """Columns of equal length, the axis (time or place) first.

    Attributes
    ----------
    label : what stands for the sheet among others, as "256 Hz".
    columns : float64, shape (n,), by full name, as "bogie.rate_pitch [rad/s]"; NaN is a lost sample.
    """

    label: str
    columns: Mapping[str, np.ndarray]

    @property
    def axis(self) -> np.ndarray:
        """The first column."""
        return next(iter(self.columns.values()))

    @property
    def size(self) -> int:
        """Bytes of all numbers."""
        return sum(column.nbytes for column in self.columns.values())


@dataclass(frozen=True)
class Content:
    """What is written: a recording (a sheet for each rate) or an estimate (one sheet).

    Attributes
    ----------
    origin : where it comes from, in one line.
    sheets : at least one.
    start : instant of time 0; None where it is not known.
    """

    origin: str
    sheets: Sequence[Sheet]
    start: datetime | None = None


Writer = Callable[[Content, Path], None]


def split_name(name: str) -> tuple[str, str]:
    """("bogie.rate_pitch", "rad/s") of "bogie.rate_pitch [rad/s]"; the unit is "" where none stands there."""
    found = _NAME.fullmatch(name)
    return (found[1], found[2]) if found else (name, "")


def parts(sheets: Sequence[Sheet], length: int) -> Iterator[list[np.ndarray]]:
    """One table of all sheets over all their times, `length` rows at a time; NaN where a sheet has no row.

    Parameters
    ----------
    sheets : one of any axis, or several over time.

    Yields
    ------
    Columns in the order of `names`; one part without rows where the table has none.
    """
    if len(sheets) == 1:
        columns = list(sheets[0].columns.values())
        for first in counted(range(0, max(columns[0].size, 1), length), "writing", "blocks"):
            yield [column[first : first + length] for column in columns]
        return
    axis = np.unique(np.concatenate([sheet.axis for sheet in sheets]))
    places = [np.searchsorted(axis, sheet.axis) for sheet in sheets]
    for first in counted(range(0, max(axis.size, 1), length), "writing", "blocks"):
        part = axis[first : first + length]
        found = [part]
        for sheet, rows in zip(sheets, places, strict=True):
            begin, end = np.searchsorted(rows, [first, first + length])
            for values in list(sheet.columns.values())[1:]:
                column = np.full(part.size, np.nan)
                column[rows[begin:end] - first] = values[begin:end]
                found.append(column)
        yield found


def names(sheets: Sequence[Sheet]) -> list[str]:
    """Columns of the table of all sheets."""
    first = next(iter(sheets[0].columns)) if len(sheets) == 1 else TIME
    return [first, *(name for sheet in sheets for name in list(sheet.columns)[1:])]
