"""What readers hand over: columns as they stand in the file; and the notes on every decision that was taken."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches

import numpy as np

from railsim.errors import InputError


@dataclass(frozen=True)
class Column:
    """One column of a file.

    Attributes
    ----------
    name : as in the file.
    values : numbers (float64, NaN where empty), shape (n,), or texts.
    unit : as the file states it; None where it does not.
    instants : whether the numbers are seconds after `start` of the table, read from the file's own time type.
    duration : whether the numbers are seconds by the file's own type for durations or times of day.
    fault : row and text of the first cell that is no number, among texts.
    """

    name: str
    values: np.ndarray | list[str]
    unit: str | None = None
    instants: bool = False
    fault: tuple[int, str] | None = None
    duration: bool = False


@dataclass(frozen=True)
class Table:
    """Columns of one group of a file, all of the same length.

    Attributes
    ----------
    columns : by name, those that were asked for.
    clock : the group's own time axis in s, shape (n,); None where the format has none.
    start : ISO 8601 instant of the clock's or the instants' zero; None where the file does not state it.
    first_row : number of the first row for messages (in text the line of the file).
    lines : numbers of all rows for messages, shape (n,), where they do not follow each other.
    mixed : line of the map that takes the rows of one sensor, where a column seems to name that of each row.
    local : whether `start` is a local time whose zone the file does not state.
    cut_short : whether the file ends before the rows that it states; those that are there are held.
    told : what the reader left out, one line each.
    """

    columns: dict[str, Column]
    clock: np.ndarray | None = None
    start: str | None = None
    first_row: int = 1
    cut_short: bool = False
    lines: np.ndarray | None = None
    local: bool = False
    mixed: str | None = None
    told: tuple[str, ...] = ()

    def line(self, row: int) -> int:
        """Number of a row for messages."""
        return self.first_row + row if self.lines is None else int(self.lines[row])


@dataclass
class Notes:
    """Everything that was assumed or repaired on the way, in order; printed, and stored with the result."""

    assumptions: list[str] = field(default_factory=list)
    repairs: list[str] = field(default_factory=list)

    def assume(self, text: str) -> None:
        """Note a decision that the map left open."""
        if text not in self.assumptions:
            self.assumptions.append(text)

    def repair(self, text: str) -> None:
        """Note what was changed in the data."""
        if text not in self.repairs:
            self.repairs.append(text)


def place_of(name: str, names: Sequence[str], what: str) -> int:
    """Place of a column by its name, or by its number from 1: "#3" is the third.

    Raises
    ------
    InputError : there is none, or several have the name; the line says how to name one.
    """
    count = names.count(name)
    if count == 1:
        return names.index(name)
    if count > 1:
        places = [number for number, one in enumerate(names, 1) if one == name]
        raise InputError(
            f"{count} {what}s are called '{name}', numbers {' and '.join(map(str, places))}; name one by its number, "
            f"as 'column: {places[0]}'"
        )
    number = re.fullmatch(r"#(\d{1,6})", name)
    if number and 1 <= int(number[1]) <= len(names):
        return int(number[1]) - 1
    raise missing(name, names, what)


def same_cell(cell: str | float, value: str | float) -> bool:
    """Whether a cell holds a value: numbers by size, texts without blanks around them."""
    if isinstance(cell, str) and cell.strip() == str(value).strip():
        return True
    try:
        return float(cell) == float(value)
    except ValueError:
        return False


def missing(name: str, there: Iterable[str], what: str) -> InputError:
    """The error for a name that is not there; lists similar names, or the first of all."""
    names = [str(one) for one in there]
    close = get_close_matches(name, names, 3, 0.6) or names[:20]
    more = "" if len(close) >= len(names) or len(close) <= 3 else f" and {len(names) - len(close)} more"
    listed = ", ".join(f"'{one[:60]}'" for one in close) or "none"
    return InputError(f"no {what} '{name}'; there are: {listed}{more}")
