"""Cells of text rows as numbers: one reader for rows that are parsed together and for those that come part by part."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from railsim.errors import InputError
from railsim.field.layout import BLANKS, ONE_COLUMN, Layout, cells_of

ROWS_AT_ONCE = 200_000
"""Rows that are parsed together where a table has more."""
EMPTY = ("", "nan", "NaN", "NAN")
UNREADABLE = (ValueError, OverflowError, pd.errors.EmptyDataError)
"""What the reader raises on rows that are no table."""


class Cells:
    """The wanted columns of a table.

    Parameters
    ----------
    layout : how it is written.
    lost : by name of each column, the texts that stand for a lost sample.
    places : of the columns, by name.
    texts : columns that stay text.
    """

    def __init__(
        self,
        layout: Layout,
        lost: Mapping[str, Sequence[str]],
        places: Mapping[str, int],
        texts: frozenset[str],
    ) -> None:
        self._decimal, self._joined = layout.decimal, layout.decimal == layout.separator
        separator = ONE_COLUMN if self._joined else layout.separator
        self._places = places
        self._keys = {place: f"{place}" for place in sorted(set(places.values()))}
        markers: dict[str, list[str]] = {key: [*EMPTY] for key in self._keys.values()}
        for name, place in places.items():
            markers[self._keys[place]] += lost[name]
        self._settings: dict[str, Any] = {
            "sep": r"\s+" if separator == BLANKS else separator,
            "decimal": layout.decimal,
            "thousands": layout.thousands,
            "names": [str(place) for place in range(max(layout.cells, max(self._keys, default=0) + 1))],
            "usecols": list(self._keys.values()),
            "dtype": {self._keys[places[name]]: str for name in places if name in texts},
            "na_values": markers,
        }

    def read(self, lines: list[str], path: Path) -> pd.DataFrame:
        """All rows.

        Raises
        ------
        InputError : they are no whole table.
        """
        if not lines:
            return pd.DataFrame({name: np.zeros(0) for name in self._places})
        try:
            frame = self._in_parts(lines) if len(lines) > ROWS_AT_ONCE else None
            frame = self._frame(lines) if frame is None else frame
        except UNREADABLE as error:
            reason = " ".join(str(error).replace("Error tokenizing data. C error: ", "").split())[:120]
            raise InputError(f"'{path}' is not a whole table ({reason}); mend that line") from None
        if len(frame) != len(lines):
            raise InputError(f"'{path}' is not a whole table (a quoted cell goes over several lines); mend that line")
        return self.named(frame)

    def named(self, frame: pd.DataFrame) -> pd.DataFrame:
        """The columns by their names."""
        return pd.DataFrame({name: frame[self._keys[place]] for name, place in self._places.items()}, copy=False)

    def part(self, lines: list[str]) -> tuple[dict[str, np.ndarray], dict[str, list[Any]]] | None:
        """Numbers and texts of some rows, by key; None where a column that may be numbers is text there, or where the
        rows are no table.
        """
        try:
            frame = self._frame(lines)
        except UNREADABLE:
            return None
        texts = [name for name in self._settings["usecols"] if name in self._settings["dtype"]]
        numeric = [name for name in self._settings["usecols"] if name not in self._settings["dtype"]]
        if len(frame) != len(lines) or any(frame[name].dtype.kind not in "iuf" for name in numeric):
            return None
        numbers = {name: frame[name].to_numpy(dtype=np.float64) for name in numeric}
        return numbers, {name: frame[name].tolist() for name in texts}

    def _frame(self, lines: list[str]) -> pd.DataFrame:
        if self._joined:
            lines = [ONE_COLUMN.join(cells_of(line, self._decimal)) for line in lines]
        return pd.read_csv(
            io.BytesIO("\n".join(lines).encode()),
            header=None,
            index_col=False,
            keep_default_na=False,
            skipinitialspace=True,
            skip_blank_lines=False,
            low_memory=False,
            on_bad_lines="error",
            **self._settings,
        )

    def _in_parts(self, lines: list[str]) -> pd.DataFrame | None:
        """Columns, read part by part to spare memory; None where one that may be numbers is text in some part.

        Such a table, and one of which a part cannot be read, is left to the reader of the whole, which knows the kind
        of a column by all of its cells and the line of an error by the whole file.
        """
        numeric: dict[str, np.ndarray] = {}
        texts: dict[str, list[Any]] = {}
        for first in range(0, len(lines), ROWS_AT_ONCE):
            some = lines[first : first + ROWS_AT_ONCE]
            found = self.part(some)
            if found is None:
                return None
            for name, values in found[0].items():
                numeric.setdefault(name, np.empty(len(lines)))[first : first + len(some)] = values
            for name, cells in found[1].items():
                texts.setdefault(name, []).extend(cells)
        return pd.DataFrame({**numeric, **{name: pd.Series(cells) for name, cells in texts.items()}}, copy=False)
