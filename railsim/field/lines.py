"""Rows of a text table without what is none: comments, repeated headers, the end of a file that was cut."""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from railsim.errors import InputError
from railsim.field.layout import BLANKS, Layout, cells_of
from railsim.field.map import Csv
from railsim.field.tables import Notes

_FOOTER = 20  # lines at the end that may hold no row
_LOOK = 20  # rows above the last one, to which its decimals are compared


@dataclass(frozen=True)
class Rows:
    """Lines of the table's rows, and their numbers in the file, from 1."""

    lines: list[str]
    numbers: "array[int]"


TAIL = 30
"""Rows at the end that must be there when the file has ended: the last one is judged by those above it."""


def rows_of(lines: Sequence[str], layout: Layout, options: Csv, wanted: set[int], path: Path, notes: Notes) -> Rows:
    """The lines that hold rows.

    Parameters
    ----------
    lines : of the whole file; the last one is empty where the file ends with a line end.
    layout, options : how it is written.
    wanted : places of the columns that are needed.
    path, notes : for messages; what was left out.

    Raises
    ------
    InputError : a line has too many or too few cells.
    """
    found = Sorter(layout, options, wanted)
    for number in range(layout.start, len(lines)):
        found.take(number, lines[number])
    found.end(lines[-1] if lines else "", len(lines), path, notes)
    return Rows(found.lines, found.numbers)


class Sorter:
    """Takes lines one by one and puts aside what is no row.

    Attributes
    ----------
    lines : of the rows that were not taken out yet. numbers : of all rows in the file, from 1.
    """

    def __init__(self, layout: Layout, options: Csv, wanted: set[int]) -> None:
        self._layout, self._options = layout, options
        self._wanted = max(wanted, default=0)
        self._mark = layout.separator
        self._due = max(layout.cells, 1)
        self._head = None if layout.header is None else layout.header
        self.lines: list[str] = []
        self.numbers = array("q")  # a list would take five times as much
        self._broken: list[tuple[int, str, int]] = []
        self._repeated: list[int] = []
        self._short: list[int] = []

    def take(self, number: int, line: str) -> None:
        """A line with its number from 0."""
        plain = '"' not in line
        found = (len(line.split()) if self._mark == BLANKS else line.count(self._mark) + 1) if plain else 0
        if not plain:
            found = len(cells_of(line, self._mark))
        if not line.strip() or line.lstrip().startswith(self._options.comment):
            return
        if "\0" in line:
            self._broken.append((number + 1, line, found))
        elif found == self._due:
            if self._head is not None and self._is_header(line):
                self._repeated.append(number + 1)
                return
            self._keep(number, line)
        elif self._head is not None and self._is_header(line):
            self._repeated.append(number + 1)
        elif found > self._due and not any(cell.strip() for cell in cells_of(line, self._mark)[self._due :]):
            self._keep(number, self._mark.join(self._quoted(cells_of(line, self._mark)[: self._due])))
        elif found < self._due and self._may_be_short(line, found):
            self._short.append(number + 1)
            self._keep(number, line + self._mark * (self._due - found))
        else:
            self._broken.append((number + 1, line, found))

    def take_out(self, count: int) -> list[str]:
        """The first `count` lines, which are not kept any longer; `TAIL` must stay behind until the end."""
        taken = self.lines[:count]
        del self.lines[:count]
        return taken

    def end(self, last: str, count: int, path: Path, notes: Notes) -> None:
        """Judge what was put aside, after all lines.

        Parameters
        ----------
        last : the last line, empty where the file ends with a line end. count : of all lines.

        Raises
        ------
        InputError : a line has too many or too few cells.
        """
        self.end_of_file(last, count, notes)
        self.broken_lines(path, notes)
        self.say(notes)

    def _keep(self, number: int, line: str) -> None:
        self.lines.append(line)
        self.numbers.append(number + 1)

    def _quoted(self, cells: list[str]) -> list[str]:
        return ['"' + cell.replace('"', '""') + '"' if self._mark in cell else cell for cell in cells]

    def _is_header(self, line: str) -> bool:
        first = self._head[0] if self._head else ""
        if not first or first not in line:
            return False
        return [cell.strip() for cell in cells_of(line, self._mark)] == self._head

    def _may_be_short(self, line: str, found: int) -> bool:
        """Whether the cells that are missing at the end belong to columns of text that nobody asks for."""
        numeric = self._layout.numeric
        if found <= self._wanted or any(numeric[found:]):
            return False
        cells = cells_of(line, self._mark)
        return all(_like_number(cell) for cell, number in zip(cells, numeric, strict=False) if number and cell.strip())

    def end_of_file(self, last_line: str, count: int, notes: Notes) -> None:
        """Leave out lines behind the last row, and a last row that was cut."""
        last = self.numbers[-1] if self.numbers else 0
        footer = [one for one in self._broken if one[0] > last]
        if footer and len(footer) <= _FOOTER and self.numbers:
            self._broken = self._broken[: -len(footer)]
            shown = "".join(ch if ch.isprintable() else "?" for ch in footer[0][1][:30])
            notes.repair(
                f"line {footer[0][0]} ('{shown}') and what follows hold no whole row at the end of the file: left out"
            )
        if last_line.strip() and self.numbers and self.numbers[-1] == count:
            self._unfinished(notes)

    def _unfinished(self, notes: Notes) -> None:
        """The last line has no end: whether its last number was cut, by the decimals of those above."""
        rows = [cells_of(line, self._mark) for line in self.lines[-_LOOK - 1 :]]
        decimals = [
            len(row[-1].strip().rpartition(self._layout.decimal)[2]) for row in rows if self._layout.decimal in row[-1]
        ]
        cut = len(rows) > 3 and len(decimals) == len(rows) and decimals[-1] < min(decimals[:-1])
        cut |= len(rows) > 3 and len(decimals) == len(rows) - 1 and self._layout.decimal not in rows[-1][-1]
        if cut:
            notes.repair(f"line {self.numbers[-1]}, the last one, has no line end and fewer decimals: cut, left out")
            self.lines.pop()
            self.numbers.pop()
        else:
            notes.assume("the last line has no line end; it is taken as whole")

    def broken_lines(self, path: Path, notes: Notes) -> None:
        """Refuse lines that are no row, or leave them out where the map says so."""
        if not self._broken:
            return
        number, line, found = self._broken[0]
        if self._options.broken == "drop":
            notes.repair(f"{len(self._broken)} lines that are no whole row left out, the first is line {number}")
            return
        kinds = {len(cells_of(one[1], self._mark)) for one in self._broken}
        if len(self._broken) > 3 and len(self._broken) > 0.05 * len(self.numbers):
            sensor = cells_of(line, self._mark)[0].strip()[:20]
            raise InputError(
                f"'{path}' line {number}: {found} cells for {self._due} columns, and so in {len(self._broken)} lines "
                f"({', '.join(map(str, sorted(kinds)))} cells); if rows of several sensors stand in one file, make a "
                f"table of each with 'rows: {{where: {{1: \"{sensor}\"}}}}' and columns by number"
            )
        what = "zero bytes" if "\0" in line else f"{found} cells for {self._due} columns"
        raise InputError(
            f"'{path}' line {number}: {what}; mend that line, or leave such lines out by 'csv: {{broken: drop}}'"
        )

    def say(self, notes: Notes) -> None:
        """Note headers and cells that are missing."""
        if self._repeated:
            notes.assume(
                f"the header stands again in line {self._repeated[0]} ({len(self._repeated)} such lines): left out"
            )
        if self._short:
            notes.assume(
                f"{len(self._short)} rows have fewer cells than columns (line {self._short[0]} first); the columns of "
                "text at their end are empty"
            )


def _like_number(cell: str) -> bool:
    return any(ch.isdigit() for ch in cell) or cell.strip().lower() in ("nan", "inf", "-inf")
