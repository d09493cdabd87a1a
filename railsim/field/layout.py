"""How a text table is written: header, separator, decimal mark, units; stated, or found by rules that are said."""

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from railsim.errors import InputError
from railsim.field.map import Csv
from railsim.field.tables import Notes
from railsim.field.units import parse_unit

ONE_COLUMN = "\x1f"
"""Separator of a table that has none: the unit separator of ASCII, which no text holds."""
BLANKS = " "
"""Separator that stands for any number of blanks."""

_SEPARATORS = ("\t", ";", "|", ",", BLANKS)
_ROWS = 50  # rows by which columns are told
_PREAMBLE = "***End_of_Header***"  # of LabVIEW measurement files
_SEP = re.compile(r'\s*"?sep=(.)"?\s*', re.IGNORECASE)
_WITH = {mark: re.compile(rf"\s*[+-]?\d*\{mark}\d+(?:[eE][+-]?\d+)?\s*") for mark in ".,"}
_UNIT = re.compile(r".*[\[(]\s*([^\[\]()]+?)\s*[\])]\s*")
_NUMBER = re.compile(r"\s*[+-]?(\d[\d'’  .,]*|[.,]\d+)(e[+-]?\d+)?\s*|\s*[+-]?(nan|inf|infinity)\s*", re.IGNORECASE)
_MOMENT = re.compile(r"\s*(\d{1,4}[-./]\d{1,2}[-./]\d{1,4}|\d{1,4}[-./][A-Za-z]{3}[-./]\d{2,4}|\d{1,2}:\d{2}).*")
_WHOLES = {mark: re.compile(rf"\s*[+-]?\d{{1,3}}(\{mark}\d{{3}})+\s*") for mark in ".,"}
_GROUPED = {
    (".", ","): re.compile(r"\s*[+-]?\d{1,3}(\.\d{3})+,\d+\s*"),
    (",", "."): re.compile(r"\s*[+-]?\d{1,3}(,\d{3})+\.\d+\s*"),
    ("'", None): re.compile(r"\s*[+-]?\d{1,3}('\d{3})+([.,]\d+)?\s*"),
    (" ", None): re.compile(r"\s*[+-]?\d{1,3}( \d{3})+([.,]\d+)?\s*"),
}


@dataclass(frozen=True)
class Layout:
    """How a table is written.

    Attributes
    ----------
    names, units : of the columns.
    separator, decimal, thousands : characters.
    start : lines of the file before the first row of data.
    header : cells of the line of names; None where there is none.
    numeric : whether each column holds numbers or times in the first rows.
    cells : number of cells of the first rows.
    """

    names: list[str]
    units: list[str | None]
    separator: str
    decimal: str
    thousands: str | None
    start: int
    header: list[str] | None
    numeric: list[bool]
    cells: int


@dataclass(frozen=True)
class _Line:
    """A line that is neither blank nor a comment: its number from 0, its text, whether a blank line stands above it."""

    number: int
    text: str
    apart: bool


def cells_of(line: str, separator: str) -> list[str]:
    """Cells of a line; those in quotes may hold the separator."""
    if separator == BLANKS:
        return line.split()
    if '"' not in line:
        return line.split(separator)
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:
        return []


def find_layout(lines: Sequence[str], options: Csv, path: Path, notes: Notes) -> Layout:
    """Layout by the first lines of a text.

    Parameters
    ----------
    lines : the first ones of the file.
    options : what the map states.
    path, notes : for messages; what was assumed.

    Raises
    ------
    InputError : no header, or none of the separators cuts header and rows alike.
    """
    first, stated = _after_preamble(lines, options, notes)
    content = _content(lines, first, options.comment)
    if not content:
        raise InputError(f"'{path}' has no header; its first line must name the columns")
    separator = options.separator or stated or _separator(content, options, path, notes)
    rows = [cells_of(line.text, separator) for line in content]
    cells = _usual_count(rows)
    numeric = _numeric(rows, cells)
    names, data = _header(content, rows, numeric, options)
    _refuse_mixed(rows[data:], cells, path)
    head = None if names is None else [cell.strip() for cell in rows[names]]
    blank_from = max(len(_without_blanks(row)) for row in rows[data : data + _ROWS] or rows)
    titles = _titles(head, options, numeric, min(blank_from, cells), (path, notes))
    start, units = _units_below(content, rows, (names, data), titles, options, (path, notes))
    body = rows[start:][:200]
    thousands, decimal = _marks(body, separator, options, path, notes)
    if names is not None and content[names].number > first and options.skip == 0:
        _say_preamble(content, names, first, notes)
    place = content[start].number if start < len(content) else content[-1].number + 1
    return Layout(titles, units, separator, decimal, thousands, place, head, numeric, cells)


def _refuse_mixed(rows: list[list[str]], cells: int, path: Path) -> None:
    """Refuse rows of several sensors: of different lengths, told apart by few words in the first column."""
    other = [row for row in rows[:-1] if len(row) != cells and len(row) > 2 and any(_number(cell) for cell in row[1:])]
    words = {row[0].strip() for row in rows[:-1] if row}
    if (
        len(other) < 2
        or len(words) > 10
        or {row[0].strip() for row in other} & {row[0].strip() for row in rows if len(row) == cells}
    ):
        return
    counts = sorted({len(row) for row in rows[:-1]})
    listed = ", ".join(f"'{word[:20]}'" for word in sorted(words))
    raise InputError(
        f"'{path}': rows have {' or '.join(map(str, counts))} cells, as those of several sensors in one file ({listed} "
        f"in column 1); make a table of each with 'rows: {{where: {{1: \"{other[0][0].strip()[:20]}\"}}}}' and name "
        "columns by number, as 'column: 2'"
    )


def _after_preamble(lines: Sequence[str], options: Csv, notes: Notes) -> tuple[int, str | None]:
    """(first line that counts, separator that a line "sep=;" states)."""
    first = options.skip
    marks = [number for number, line in enumerate(lines) if line.startswith(_PREAMBLE)]
    if marks and not options.skip:
        first = marks[-1] + 1
        notes.assume(f"the table begins below line {first}, '{_PREAMBLE}'")
    match = _SEP.fullmatch(lines[first]) if first < len(lines) else None
    if match is None:
        return first, None
    notes.assume(f"columns are separated by {match[1]!r}, as line {first + 1} says")
    return first + 1, match[1]


def _content(lines: Sequence[str], first: int, comment: str) -> list[_Line]:
    content: list[_Line] = []
    for number in range(first, len(lines)):
        text = lines[number]
        if text.strip() and not text.lstrip().startswith(comment):
            apart = number > first and not lines[number - 1].strip()
            content.append(_Line(number, text.rstrip("\n"), apart))
    return content


def _separator(content: list[_Line], options: Csv, path: Path, notes: Notes) -> str:
    """The first of `_SEPARATORS` that cuts the line of names and most rows into the same number of cells."""
    tail = content[1:][-_ROWS:]
    for separator in _SEPARATORS:
        rows = [cells_of(line.text, separator) for line in content]
        count = _usual_count(rows)
        if count < 2 or (separator == BLANKS and not all(_number(cell) for cell in rows[-1][:count])):
            continue
        if 2 * sum(len(row) == count for row in rows[1:][-_ROWS:]) < len(tail):
            continue
        if options.names or _fitting_header(rows, count):
            shown = "blanks" if separator == BLANKS else repr(separator)
            notes.assume(f"columns are separated by {shown}: header and first rows have {count} cells each")
            return separator
    if all(_number(line.text) or _MOMENT.fullmatch(line.text) for line in tail) or len(content) == 1:
        notes.assume("one column, as no separator stands in the first rows")
        return ONE_COLUMN
    for separator in _SEPARATORS[:-1]:
        rows = [cells_of(line.text, separator) for line in content]
        _refuse_mixed(rows, _usual_count(rows), path)
    raise InputError(f"'{path}': no separator gives header and rows the same number of cells; state csv.separator")


def _fitting_header(rows: list[list[str]], count: int) -> bool:
    """Whether a line above the numbers, or the first line, has a cell for each of the rows', blank ones left out."""
    numeric = _numeric(rows, count)
    names, data = _block(rows, numeric, [False] * len(rows))
    if names is None:
        return True
    found = len(_without_blanks(rows[names]))
    return found == count or (found in (count - 1, count + 1, count + 2) and data < len(rows) and found > 1)


def _without_blanks(row: list[str]) -> list[str]:
    """Cells without the blank ones at the end."""
    end = len(row)
    while end and not row[end - 1].strip():
        end -= 1
    return row[:end]


def _usual_count(rows: list[list[str]]) -> int:
    """Cells of most of the last rows that were looked at; the very last one may be cut."""
    counts = Counter(len(row) for row in (rows[1:-1][-_ROWS:] or rows[1:] or rows))
    return max(counts, key=lambda count: (counts[count], count))


def _number(cell: str) -> bool:
    return _NUMBER.fullmatch(cell) is not None


def _numeric(rows: list[list[str]], cells: int) -> list[bool]:
    """Whether most cells of each column are numbers or times."""
    usual = [row for row in rows[1:][-_ROWS:] if len(row) == cells] or rows[-1:]
    found = []
    for place in range(cells):
        column = [row[place] for row in usual if place < len(row) and row[place].strip()]
        good = sum(_number(cell) or _MOMENT.fullmatch(cell) is not None for cell in column)
        found.append(bool(column) and 2 * good >= len(column))
    return found


def _is_data(row: list[str], numeric: list[bool], *, wholly: bool) -> bool:
    """Whether a row holds numbers where the columns do: in one of them, or `wholly` in all that are not blank."""
    cells = [cell for cell, number in zip(row, numeric, strict=False) if number and cell.strip()]
    good = [_number(cell) or _MOMENT.fullmatch(cell) is not None for cell in cells]
    return bool(good) and (all(good) if wholly else any(good))


def _header(content: list[_Line], rows: list[list[str]], numeric: list[bool], options: Csv) -> tuple[int | None, int]:
    """(place of the line of names, place of the first row of data) in `content`."""
    if options.names or options.header == "none":
        return None, 0
    if options.skip or not any(numeric):
        return 0, 1
    return _block(rows, numeric, [line.apart for line in content])


def _block(rows: list[list[str]], numeric: list[bool], apart: list[bool]) -> tuple[int | None, int]:
    """(place of the line of names, place of the first row of data): the lines without numbers right above the data."""
    if _is_data(rows[0], numeric, wholly=True) and len(rows[0]) == len(numeric):
        return None, 0
    data = _first_data(rows, numeric)
    if data is None or data == 0 or _is_data(rows[data - 1], numeric, wholly=True):
        return 0, 1
    names = data - 1
    while names > 0 and not apart[names] and _heading(rows[names - 1], numeric) and len(rows[names - 1]) >= 2:
        if len(rows[names - 1]) not in (len(numeric), len(rows[names])):
            break
        names -= 1
    return names, data


def _first_data(rows: list[list[str]], numeric: list[bool]) -> int | None:
    """The first row with numbers that others follow; a line of names may hold some, the row below it holds them all."""
    for place, row in enumerate(rows):
        if len(row) < len(numeric) and len(_without_blanks(row)) < len(_without_blanks(rows[-1])):
            continue
        if not _is_data(row, numeric, wholly=False):
            continue
        following = rows[place + 1 : place + 4]
        even = all(len(one) == len(following[0]) for one in following)
        if even and all(_is_data(one, numeric, wholly=False) for one in following[:2]):
            named = place == 0 and not _is_data(row, numeric, wholly=True)
            return 1 if named else place
    return None


def _heading(row: list[str], numeric: list[bool]) -> bool:
    """Whether a line belongs to names, descriptions or units: no number in a column of numbers, but a unit 1 or -."""
    cells = [cell for cell, number in zip(row, numeric, strict=False) if number and cell.strip(" 1-")]
    return bool(_without_blanks(row)) and not any(_number(cell) or _MOMENT.fullmatch(cell) for cell in cells)


def _titles(
    head: list[str] | None,
    options: Csv,
    numeric: list[bool],
    blank_from: int,
    about: tuple[Path, Notes],
) -> list[str]:
    """Names of the columns; "#1", "#2" ... where the file has none."""
    (path, notes), cells = about, len(numeric)
    numbers = [f"#{place}" for place in range(1, cells + 1)]
    while not numeric[len(numbers) - 1] and len(numbers) > blank_from:
        numbers.pop()
    if options.names:
        if len(options.names) > cells:
            raise InputError(f"'{path}': csv.names gives {len(options.names)} names for {cells} columns; correct it")
        return [*options.names, *numbers[len(options.names) :]]
    if head is None:
        if options.header != "none":
            notes.assume(f"no header, as the first line holds numbers: columns are called by number, 1 to {cells}")
        return numbers
    named = _without_blanks(head)
    if len(named) > cells:
        bare = ", ".join(f"'{name}'" for name in named[cells:])
        notes.assume(f"rows have {cells} cells for {len(named)} names: {bare} holds nothing")
    elif len(named) < cells:
        spare = [number for number, used in zip(numbers, numeric, strict=False) if used][len(named) :]
        if any(numeric[len(named) :]):
            raise InputError(
                f"'{path}': {len(named)} names for {cells} columns of numbers ({', '.join(spare)} has none); state "
                "'csv: {names: [...], skip: ...}'"
            )
        return [*named, *numbers[len(named) :]]
    return named


def _units_below(
    content: list[_Line],
    rows: list[list[str]],
    places: tuple[int | None, int],
    titles: list[str],
    options: Csv,
    about: tuple[Path, Notes],
) -> tuple[int, list[str | None]]:
    """(place of the first row of data, unit of each column): from the names, or from a line below them."""
    (names, data), (path, notes) = places, about
    own: list[str | None] = [found[1] if (found := _UNIT.fullmatch(name)) else None for name in titles]
    if names is None:
        return data, own
    stated = int(options.units_row)
    if options.skip or stated:
        data = max(data, names + 1)
        while data < len(rows) and data - names <= 8 and _is_below_names(rows[data], rows[data + 1 :]):
            data += 1
    data = max(data, names + 1 + stated) if options.units_row is not True else data
    below = list(range(names + 1, data))
    good = [place for place in below if _holds_units(rows[place], titles)]
    chosen = good[-1] if good else None
    if options.units_row is True and chosen is None:
        chosen, data = names + 1, max(data, names + 2)
    elif options.units_row is not True and stated:
        chosen = names + stated
    if chosen is None:
        _say_left_out(content, below, notes)
        return data, own
    line = rows[chosen] if chosen < len(rows) else []
    if len(_without_blanks(line)) > len(titles) or (options.units_row and len(line) < len(titles)):
        raise InputError(f"'{path}': {len(line)} units for {len(titles)} columns; is there a row of units?")
    if not options.units_row:
        notes.assume(f"line {content[chosen].number + 1} holds units")
    _say_left_out(content, [place for place in below if place != chosen], notes)
    line = [*line, *[""] * len(titles)][: len(titles)]
    return data, [cell.strip(" []()\t\n") or None for cell in line]


def _is_below_names(row: list[str], following: list[list[str]]) -> bool:
    """Whether a line holds no number at all, while the one after it does."""
    bare = not any(_number(cell) or _MOMENT.fullmatch(cell) for cell in row if cell.strip(" 1-"))
    return bare and any(_number(cell) for one in following[:8] for cell in one)


def _holds_units(row: list[str], titles: list[str]) -> bool:
    """Whether all cells that are not blank are units."""
    cells = [cell.strip(" []()\t\n") for cell in row]
    if not any(cells) or len(_without_blanks(row)) > len(titles):
        return False
    for cell in cells:
        if cell:
            try:
                parse_unit(cell)
            except InputError:
                return False
    return True


def _say_left_out(content: list[_Line], places: list[int], notes: Notes) -> None:
    if places:
        listed = ", ".join(str(content[place].number + 1) for place in places)
        notes.assume(f"line {listed} below the names holds no numbers and is left out")


def _say_preamble(content: list[_Line], names: int, first: int, notes: Notes) -> None:
    if names and content[0].number >= first:
        notes.assume(f"line {content[names].number + 1} names the columns; what stands above it is left out")


def _marks(body: list[list[str]], separator: str, options: Csv, path: Path, notes: Notes) -> tuple[str | None, str]:
    """(thousands separator, decimal mark), stated or as the first rows have them."""
    cells = [cell for row in body for cell in row]
    thousands, decimal = options.thousands, options.decimal
    if thousands is None:
        for (mark, point), pattern in _GROUPED.items():
            possible = separator != mark and decimal in (None, point, "," if point is None else point)
            if possible and any(pattern.fullmatch(cell) for cell in cells):
                thousands, decimal = mark, decimal or point
                notes.assume(f"thousands are separated by {mark!r} in the first rows")
                break
    if thousands is None and decimal is None and separator != ",":
        thousands = _grouped_wholes(cells, notes)
    if decimal is None:
        decimal = _decimal(cells, separator, thousands, path, notes)
    if decimal == thousands:
        raise InputError(
            f"'{path}': '{decimal}' cannot be both decimal mark and thousands separator; state csv.decimal"
        )
    return thousands, decimal


def _grouped_wholes(cells: list[str], notes: Notes) -> str | None:
    """The mark that stands in whole numbers by thousands alone, where the other one is the decimal mark."""
    numbers = {mark: [cell for cell in cells if pattern.fullmatch(cell)] for mark, pattern in _WITH.items()}
    grouped = [
        mark for mark, found in numbers.items() if found and all(_WHOLES[mark].fullmatch(cell) for cell in found)
    ]
    if not all(numbers.values()) or len(grouped) != 1:
        return None
    notes.assume(f"thousands are separated by {grouped[0]!r}, as numbers with the other mark have decimals")
    return grouped[0]


def _decimal(cells: list[str], separator: str, thousands: str | None, path: Path, notes: Notes) -> str:
    """The only mark in the first rows' numbers; a point where there is none."""
    marks = [
        mark
        for mark, pattern in _WITH.items()
        if mark != thousands and any(pattern.fullmatch(cell.replace(thousands or "", "")) for cell in cells)
    ]
    if len(marks) > 1:
        raise InputError(f"'{path}': the first rows hold numbers with '.' and with ','; state csv.decimal")
    if separator == "," and marks != [","]:
        return "."
    decimal = marks[0] if marks else "."
    reason = "the only one in the first rows" if marks else "no number in the first rows has any"
    notes.assume(f"decimal mark '{decimal}': {reason}")
    return decimal
