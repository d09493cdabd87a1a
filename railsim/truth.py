"""Truth: every channel of a simulated run at one uniform rate, kept on disk so that long runs need little memory."""

import difflib
import json
from collections.abc import Callable, Hashable, Iterable
from contextlib import ExitStack
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import pandas as pd

from railsim.digests import check_as_written
from railsim.errors import InputError
from railsim.files import read_json, write_folder_atomically, write_json
from railsim.parquet import GROUP_ROWS, open_writer, read_column, read_names, write_columns
from railsim.shown import html

if TYPE_CHECKING:
    from railsim.plots.style import Picture

TIME = "time [s]"
SPEED = "speed [m/s]"
FORMAT = "railsim truth"
FORMAT_VERSION = 1
_CHANNELS = "channels.parquet"
_ABOUT = "about.json"
_WHAT = "a truth folder"
NOWHERE = "memory"
"""Stands for the folder of a run that is in memory only."""


class Truth:
    """The channels of one run; a column is read from disk when it is asked for.

    Attributes
    ----------
    folder : where the run is stored.
    rate : samples a second, Hz.
    columns : channel names, "time [s]" first.
    about : what the engine wrote about the run; `about["vehicle"]` holds the vehicle's data.
    """

    def __init__(self, folder: Path, rate: float, rows: int, columns: list[str], about: dict[str, Any]) -> None:
        self.folder = folder
        self.rate = rate
        self.columns = columns
        self.about = about
        self._rows = rows
        self._checked = False

    @classmethod
    def open(cls, folder: Path | str) -> Self:
        """Open what `TruthWriter` wrote.

        Raises
        ------
        InputError : missing, cut short, of another format version, or the table is not the one that was written.
        """
        folder = Path(folder)
        stated = read_json(folder / _ABOUT, _WHAT)
        if (stated.get("format"), stated.get("format_version")) != (FORMAT, FORMAT_VERSION):
            raise InputError(f"'{folder}' is not {_WHAT} of format version {FORMAT_VERSION}; simulate it again")
        columns, rows = read_names(folder / _CHANNELS)
        rate, about = stated.get("rate"), stated.get("about")
        if columns != stated.get("columns") or rows != stated.get("rows"):
            raise InputError(f"'{folder}': {_CHANNELS} and {_ABOUT} are of different runs; simulate it again")
        if not isinstance(rate, float) or not rate > 0 or not isinstance(about, dict):
            raise InputError(f"'{folder / _ABOUT}' has no valid rate or description; simulate it again")
        check_as_written(folder, _ABOUT)
        return cls(folder, rate, rows, columns, about)

    def check(self) -> None:
        """Raise `InputError` where the channels are not those that were written; looked at once."""
        if not self._checked:
            check_as_written(self.folder, _CHANNELS)
            self._checked = True

    @cached_property
    def time(self) -> np.ndarray:
        """Time of every sample, s, shape (n,)."""
        return self[TIME]

    @property
    def duration(self) -> float:
        """Time from the first to the last sample, s."""
        return max(len(self) - 1, 0) / self.rate

    def __len__(self) -> int:
        """Number of samples."""
        return self._rows

    def __repr__(self) -> str:
        """Place, number of channels, rate and duration in one line."""
        size = f"{len(self.columns)} channels at {self.rate:g} Hz, {self.duration:g} s"
        return f"<{type(self).__name__} in '{self.folder}': {size}>"

    def _repr_html_(self) -> str:
        """A table of the channels, for notebooks; none is read for it."""
        parts = (name.rpartition(" [") for name in self.columns)
        return html(repr(self), ("channel", "unit"), ((name, unit[:-1]) for name, _, unit in parts))

    def __contains__(self, name: object) -> bool:
        """Whether there is a channel of that full name."""
        return name in self.columns

    def __getitem__(self, name: str) -> np.ndarray:
        """Channel `name` ("bogie.roll [rad]"), float64, shape (n,).

        Raises
        ------
        InputError : no such channel; the line names similar ones. The channels are not those that were written.
        """
        if name not in self.columns:
            similar = ", ".join(difflib.get_close_matches(name, self.columns, 3, 0.5)) or "see its columns"
            raise InputError(f"the truth in '{self.folder}' has no channel '{name}'; similar: {similar}")
        self.check()
        return read_column(self.folder / _CHANNELS, name)

    def derived(self, key: Hashable, make: Callable[[], np.ndarray]) -> np.ndarray:
        """What `make` makes of the channels and of `key` alone; a truth in memory makes it once and keeps it.

        Shape and units are those of what `make` returns. It may be read only. What is made of long runs is not kept.
        """
        del key
        return make()

    def frame(self, names: Iterable[str] | None = None) -> pd.DataFrame:
        """The channels `names` (all where None) side by side, without an index of their own."""
        return pd.DataFrame({name: self[name] for name in (self.columns if names is None else names)})

    def plot(self, *channels: str, begin: float | None = None, end: float | None = None, over: str = TIME) -> "Picture":
        """A picture of channels over time or distance, in panels by body and quantity.

        Parameters
        ----------
        channels : full names, or patterns without a unit such as "wheelset1.*"; a usual choice where none is given.
        begin, end : first and last time, s; None is that of the run.
        over : channel of the horizontal axis, such as "s [m]".

        Raises
        ------
        InputError : a name fits no channel.
        """
        from railsim.plots.channels import channels_picture, chosen, rows_between, usual

        rows, names = rows_between(self.time, begin, end), self.columns[1:]
        shown, places = chosen(names, channels) if channels else usual(names), self[over][rows]
        title = f"truth, {self.rate:g} Hz, {self.duration:g} s"
        return channels_picture(title, shown, lambda name: (places, self[name][rows]), over)


class HeldTruth(Truth):
    """A run whose channels stay in memory; nothing of it is on the disk.

    Parameters
    ----------
    values : one row a channel, shape (columns, n), float64; not to be changed any more. rate, columns, about : as of
        `Truth`.
    """

    def __init__(self, values: np.ndarray, rate: float, columns: list[str], about: dict[str, Any]) -> None:
        if values.ndim != 2 or len(values) != len(columns):
            raise ValueError(f"values must have shape ({len(columns)}, n), not {values.shape}")
        told = json.loads(json.dumps(about))  # as a reader of the folder would get it
        super().__init__(Path(NOWHERE), float(rate), values.shape[1], list(columns), told)
        self._held = values
        self._columns: dict[str, np.ndarray] = {}
        self._derived: dict[Hashable, np.ndarray] = {}
        self._places = {name: place for place, name in enumerate(self.columns)}

    def check(self) -> None:
        """What is in memory is as it was made."""

    def __getitem__(self, name: str) -> np.ndarray:
        """As of `Truth`; the column cannot be written."""
        if name not in self._columns:
            place = self._places.get(name)
            if place is None:
                return super().__getitem__(name)
            column = np.ascontiguousarray(self._held[place], dtype=np.float64)
            column.setflags(write=False)
            self._columns[name] = column
        return self._columns[name]

    def derived(self, key: Hashable, make: Callable[[], np.ndarray]) -> np.ndarray:
        """As of `Truth`; kept for as long as the truth lives."""
        if key not in self._derived:
            made = make()
            made.setflags(write=False)
            self._derived[key] = made
        return self._derived[key]

    def write(self, folder: Path | str) -> Truth:
        """Write the run as a truth folder, byte for byte as if it had never been held; raises as `TruthWriter`."""
        with TruthWriter(folder, self.columns, self.rate, self.about) as writer:
            writer.append(self._held.T)
        return Truth.open(folder)


class TruthWriter:
    """Context manager that gathers rows into a truth folder; the folder appears, whole, at a clean exit.

    Rows are stored in groups of a fixed size, so the bytes do not depend on how the run was cut into chunks.

    Parameters
    ----------
    folder : where the truth shall be; an earlier one of railsim's is replaced at the end.
    columns : channel names with units, "time [s]" first.
    rate : samples a second, Hz.
    about : JSON-able description of the run.
    """

    def __init__(self, folder: Path | str, columns: list[str], rate: float, about: dict[str, Any]) -> None:
        if not columns or columns[0] != TIME:
            raise ValueError(f"the first column must be '{TIME}'")
        if len(set(columns)) != len(columns):
            raise ValueError("a column name appears twice")
        self.folder = Path(folder)
        self.columns = list(columns)
        self.rate = float(rate)
        self.about = about
        self._rows = 0
        self._start = 0.0
        self._buffer = np.empty((GROUP_ROWS, len(columns)))
        self._filled = 0
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        """Open a partial folder next to the final one; raises InputError where that cannot be written."""
        with ExitStack() as stack:
            self._aside = stack.enter_context(write_folder_atomically(self.folder))
            self._writer = stack.enter_context(open_writer(self._aside / _CHANNELS, self.columns))
            stack.push(self._finish)
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finish and rename, or remove the partial folder where there was an error."""
        self._stack.__exit__(kind, error, trace)

    def append(self, rows: np.ndarray) -> None:
        """Append samples, shape (n, columns), at the stated rate from the first one on.

        Raises
        ------
        ValueError : wrong shape, or times off the uniform grid by more than a thousandth of a sample.
        """
        rows = np.asarray(rows, dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != len(self.columns):
            raise ValueError(f"rows must have shape (n, {len(self.columns)}), not {rows.shape}")
        if not len(rows):
            return
        if self._rows == 0:
            self._start = rows[0, 0]
        due = self._start + (self._rows + np.arange(len(rows))) / self.rate
        if not np.all(np.abs(rows[:, 0] - due) < 1e-3 / self.rate):
            raise ValueError(f"times must follow each other by 1/{self.rate:g} s")
        self._rows += len(rows)
        while len(rows):
            taken = rows[: GROUP_ROWS - self._filled]
            self._buffer[self._filled : self._filled + len(taken)] = taken
            self._filled += len(taken)
            rows = rows[len(taken) :]
            if self._filled == GROUP_ROWS:
                self._flush()

    def _flush(self) -> None:
        if self._filled:
            write_columns(self._writer, list(self._buffer[: self._filled].T))
            self._filled = 0

    def _finish(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            return
        self._flush()
        stated = {"format": FORMAT, "format_version": FORMAT_VERSION, "rate": self.rate, "rows": self._rows}
        write_json(self._aside / _ABOUT, {**stated, "columns": self.columns, "about": self.about})
