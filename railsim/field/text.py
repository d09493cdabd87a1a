"""Text tables: encoding, separator and decimal mark as the map states them, or found by a rule that is said."""

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd

from railsim.errors import InputError
from railsim.field import streaming
from railsim.field.cells import Cells
from railsim.field.layout import ONE_COLUMN, Layout, cells_of, find_layout
from railsim.field.lines import rows_of
from railsim.field.map import Csv
from railsim.field.streaming import Placed, Read, is_plain, read_blocks
from railsim.field.tables import Column, Notes, Table, missing, place_of, same_cell
from railsim.progress import counting

MOST_BYTES = 4_000_000_000
_LOOK = 200  # lines from which the layout is found
_BOMS = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))
_NARROW = (
    "\u00a0\u2009\u202f\u2019"  # blanks that do not break and the apostrophe, as some programs put between thousands
)
_OPENED = re.compile(r'(?:^|[,;\t|])\s*"[^"]*$')
_LONGEST_CELL = 20  # lines that a quoted cell may have
_SENSORS = 1000  # rows by which rows of several sensors are told
_SENSOR = re.compile(r"\b(id|sensor|signal|channel|node|device|type|source|name)\b", re.IGNORECASE)
_MIXED = 0.2  # of the rows in which the word changes
_FORTRAN = re.compile(r"^(\s*[+-]?(?:\d+[.,]?\d*|[.,]\d+))[dD]([+-]?\d+\s*)$")  # exponents with a D


def read_text(
    path: Path,
    options: Csv,
    lost: Mapping[str, Sequence[str]],
    notes: Notes,
    texts: frozenset[str] = frozenset(),
    where: Mapping[str, str | float] = MappingProxyType({}),
) -> Table:
    """Columns of a text table: numbers where every cell that is not empty is one, otherwise texts.

    Parameters
    ----------
    path, options : the file, and how it is written.
    lost : by name of each column that is wanted, the texts that stand for a lost sample.
    notes : takes what was assumed.
    texts : columns that stay text.
    where : value by column that a row must hold; the other rows are none of this table's.

    Raises
    ------
    InputError : the encoding does not fit, a column is not there or twice, a line has too many cells.
    """

    def placed(layout: Layout) -> dict[str, int]:
        try:
            return {name: place_of(name, layout.names, "column") for name in lost}
        except InputError as error:
            raise InputError(f"'{path}': {error}{_hint(lost, layout, options)}") from None

    found = None
    if not where and path.stat().st_size >= streaming.LARGE and is_plain(path, options):
        found = read_blocks(path, options, lost, notes, texts, _LOOK + 2000, placed)
    if found is None:
        with counting(None, f"reading {path.name}", "s", by_clock=True):
            found = _whole(path, options, lost, notes, texts, where, placed)
    layout, places, frame = found.layout, found.places, found.frame
    columns = {name: _column(name, frame[name], layout, places[name]) for name in lost}
    mixed = None if where else _mixed(found.head[:_SENSORS], layout, set(places.values()), notes)
    return Table(columns, first_row=layout.start + 1, lines=np.array(found.numbers), mixed=mixed)


def _whole(
    path: Path,
    options: Csv,
    lost: Mapping[str, Sequence[str]],
    notes: Notes,
    texts: frozenset[str],
    where: Mapping[str, str | float],
    placed: Placed,
) -> Read:
    """All rows by all lines of the file."""
    lines = _whole_cells(_decoded(path, options, notes).split("\n"))
    if where:
        lines = _rows_where(lines, options, where, path)
    layout = find_layout(lines[: options.skip + _LOOK + 2000], options, path, notes)
    places = placed(layout)
    rows = rows_of(lines, layout, options, set(places.values()), path, notes)
    frame = Cells(layout, lost, places, texts).read(rows.lines, path)
    return Read(layout, places, frame, rows.lines[:_SENSORS], rows.numbers)


def _whole_cells(lines: list[str]) -> list[str]:
    """Lines of which those within a quoted cell are joined by blanks; blank lines keep the numbers of the others."""
    number = 0
    while number < len(lines):
        count = lines[number].count('"')
        end = number
        opened = count % 2 and _OPENED.search(lines[number])
        while opened and count % 2 and end + 1 < min(len(lines), number + _LONGEST_CELL):
            end += 1
            count += lines[end].count('"')
        if end > number and not count % 2:
            lines[number : end + 1] = [" ".join(lines[number : end + 1]), *[""] * (end - number)]
        number = end + 1 if not count % 2 else number + 1
    return lines


def _mixed(lines: list[str], layout: Layout, wanted: set[int], notes: Notes) -> str | None:
    """The line of the map that takes the rows of one sensor, where a column of few words changes from row to row."""
    for place, (name, numeric) in enumerate(zip(layout.names, layout.numeric, strict=False)):
        if (numeric and not _SENSOR.search(name)) or place in wanted or layout.separator == ONE_COLUMN:
            continue
        words = [cells_of(line, layout.separator)[place].strip(' "') for line in lines]
        kinds = list(dict.fromkeys(words))
        changes = sum(a != b for a, b in pairwise(words))
        if not 2 <= len(kinds) <= 20 or len(words) < 4 * len(kinds) or changes < _MIXED * len(words):
            continue
        column = name if not name.startswith("#") else name[1:]
        line = f'rows: {{where: {{{column}: "{kinds[0]}"}}}}'
        listed = ", ".join(f"'{kind[:20]}'" for kind in kinds[:6])
        notes.assume(
            f"column '{column}' changes between {len(kinds)} words ({listed}), as one that names the sensor of each "
            f"row; rows of all are taken, '{line}' of a table would take those of one"
        )
        return line
    return None


def _hint(names: Iterable[str], layout: Layout, options: Csv) -> str:
    """What may have been meant by a name that no column has."""
    for name in names:
        words = name.split()
        if name not in layout.names and len(words) > 1 and all(word in layout.names for word in words):
            return f"; for a date and a time in two columns write 'column: [{', '.join(words)}]'"
    if layout.header is not None or options.names:
        return ""
    letters = ", ".join("abcdefghijklmnopqrstuvwxyz"[: len(layout.names)])
    return f"; the file names no columns: write 'column: 2' for the second, or 'csv: {{names: [{letters}]}}'"


def _rows_where(lines: list[str], options: Csv, where: Mapping[str, str | float], path: Path) -> list[str]:
    """Lines of which all other rows are blank: those of other sensors may have other cells."""
    content = [line for line in lines[options.skip :] if line.strip() and not line.startswith(options.comment)]
    if not content:
        return lines
    counted = {one: sum(line.count(one) for line in content[:_LOOK]) for one in "\t;|,"}
    separator = options.separator or max(counted, key=lambda one: counted[one])
    names = list(options.names) or [cell.strip() for cell in cells_of(content[0], separator)]
    unknown = [name for name in where if name not in names and not name.startswith("#")]
    if unknown:
        raise InputError(f"'{path}': {missing(unknown[0], names, 'column')}")
    places = {place_of(name, [*names, *_spare(names)], "column"): value for name, value in where.items()}
    kept = list(lines)
    found = 0
    for number in range(options.skip, len(lines)):
        cells = cells_of(lines[number], separator)
        if len(cells) > max(places) and all(same_cell(cells[at], value) for at, value in places.items()):
            found += 1
        elif [cell.strip() for cell in cells] != names:
            kept[number] = ""
    if not found:
        shown = ", ".join(f"{name} = {value}" for name, value in where.items())
        raise InputError(f"'{path}': no row holds {shown.replace('#', 'column ')}; correct 'rows: where'")
    if options.names:
        return kept
    head = lines.index(content[0], options.skip)
    rows = (cells_of(line, separator) for line in kept[head + 1 :] if line.strip())
    if len(next(rows, names)) != len(names):
        kept[head] = ""
    return kept


def _spare(names: list[str]) -> list[str]:
    """Names of columns beyond those of the header."""
    return [f"#{place}" for place in range(len(names) + 1, 200)]


def _decoded(path: Path, options: Csv, notes: Notes) -> str:
    size = path.stat().st_size
    if size > MOST_BYTES:
        raise InputError(f"'{path}' has {size / 1e9:.1f} GB; convert text of this size to Parquet first")
    data = path.read_bytes()
    encoding = options.encoding
    if encoding is None:
        encoding = next((name for mark, name in _BOMS if data.startswith(mark)), "utf-8")
        if encoding != "utf-8":
            notes.assume(f"encoding {encoding.removesuffix('-sig')}, by the file's byte order mark")
        elif not data.isascii():
            notes.assume("encoding utf-8: the whole file is valid in it")
    elif encoding == "utf-8" and data.startswith(_BOMS[0][0]):
        encoding = "utf-8-sig"
    if not encoding.startswith("utf-16"):
        data = _without_padding(data, path, notes)
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        if options.undecodable == "refuse":
            line = data.count(b"\n", 0, error.start) + 1
            cure = (
                "the file mixes encodings: mend it, or set csv.undecodable: replace"
                if options.encoding
                else "state csv.encoding in the map, for example latin-1 or gb18030"
            )
            raise InputError(f"'{path}' line {line}: byte {error.start} is not {encoding}; {cure}") from None
        text = data.decode(encoding, "replace")
        lines = sum("�" in line for line in text.splitlines())
        notes.repair(f"{lines} lines hold bytes that are not {encoding}; these became '�'")
    return _plain(text.replace("\r\n", "\n").replace("\r", "\n").removeprefix("\ufeff"), notes)


def _without_padding(data: bytes, path: Path, notes: Notes) -> bytes:
    """The bytes without zeros behind the last line.

    Raises
    ------
    InputError : it is UTF-16 without a mark.
    """
    kept = data.rstrip(b"\0")
    if len(kept) < len(data):
        notes.repair(f"{len(data) - len(kept)} zero bytes at the end of the file left out")
    head = kept[:4096]
    zeros = head.count(b"\0")
    if zeros and (zeros > 0.3 * len(head)) and min(head[::2].count(b"\0"), head[1::2].count(b"\0")) < 0.1 * zeros:
        raise InputError(
            f"'{path}' holds zero bytes: UTF-16 without mark, or no text; state csv.encoding, as "
            f"'csv: {{encoding: utf-16-{'be' if head[::2].count(0) > head[1::2].count(0) else 'le'}}}'"
        )
    return kept


def _plain(text: str, notes: Notes) -> str:
    """Blanks that do not break between digits left out, minus signs of typographers as hyphens."""
    if any(mark in text for mark in _NARROW):
        text, count = re.subn(rf"(?<=\d)[{_NARROW}](?=\d{{3}})", "", text)
        if count:
            notes.assume(f"thousands are separated by blanks that do not break or by ’ ({count} places)")
    if "\u2212" in text:
        text, count = re.subn("\u2212(?=[\\d.,])", "-", text)
        notes.assume(f"the minus sign of typographers (U+2212) stands before {count} numbers")
    return text


def _column(name: str, values: Any, layout: Layout, place: int) -> Column:
    unit = layout.units[place] if place < len(layout.units) else None
    if values.dtype.kind in "fiub":
        return Column(name, values.to_numpy(dtype=np.float64), unit)
    texts = [value if isinstance(value, str) else "" if pd.isna(value) else str(value) for value in values.tolist()]
    texts = [_FORTRAN.sub(r"\1e\2", text) for text in texts]
    pattern = re.compile(rf"\s*[+-]?(\d+\{layout.decimal}?\d*|\{layout.decimal}\d+)([eE][+-]?\d+)?\s*|")
    fault = next(((row, cell) for row, cell in enumerate(texts) if not pattern.fullmatch(cell)), None)
    return Column(name, texts, unit, fault=fault)
