"""Text tables: encoding, separator and decimal mark as the map states them, or found by a rule that is said."""

import csv
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from railsim.errors import InputError
from railsim.field.map import Csv
from railsim.field.tables import Column, Notes, Table, missing

MOST_BYTES = 4_000_000_000
_LOOK = 200  # lines from which separator and decimal mark are found
_SEPARATORS = ("\t", ";", "|", ",")
_BOMS = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))
_WITH = {mark: re.compile(rf"\s*[+-]?\d*\{mark}\d+(?:[eE][+-]?\d+)?\s*") for mark in ".,"}
_UNIT = re.compile(r".*[\[(]\s*([^\[\]()]+?)\s*[\])]\s*")
_EMPTY = ("", "nan", "NaN", "NAN")


@dataclass(frozen=True)
class _Layout:
    """How the text is written: `start` lines stand before the first row of data, the header's names among them."""

    names: list[str]
    units: list[str | None]
    separator: str
    decimal: str
    start: int


def read_text(
    path: Path, options: Csv, lost: Mapping[str, Sequence[str]], notes: Notes, texts: frozenset[str] = frozenset()
) -> Table:
    """Columns of a text table: numbers where every cell that is not empty is one, otherwise texts.

    Parameters
    ----------
    path, options : the file, and how it is written.
    lost : by name of each column that is wanted, the texts that stand for a lost sample.
    notes : takes what was assumed.

    Raises
    ------
    InputError : the encoding does not fit, a column is not there or twice, a line has too many cells.
    """
    names = list(lost)
    text = _decoded(path, options, notes)
    layout = _layout(text, options, path, notes)
    for name in names:
        if name not in layout.names:
            raise InputError(f"'{path}': {missing(name, layout.names, 'column')}")
        if layout.names.count(name) > 1:
            raise InputError(f"'{path}': {layout.names.count(name)} columns are called '{name}'; rename one")
    _check_lines(text, layout, path)
    frame = _parsed(text, layout, options, lost, path, texts)
    columns = {name: _column(name, frame[name], layout) for name in names}
    return Table(columns, first_row=layout.start + 1)


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
        elif b"\0" in data[:4096]:
            raise InputError(f"'{path}' holds zero bytes: UTF-16 without mark, or no text; state csv.encoding")
        elif not data.isascii():
            notes.assume("encoding utf-8: the whole file is valid in it")
    elif encoding == "utf-8" and data.startswith(_BOMS[0][0]):
        encoding = "utf-8-sig"
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
    return text.replace("\r\n", "\n").replace("\r", "\n").removeprefix("\ufeff")


def _layout(text: str, options: Csv, path: Path, notes: Notes) -> _Layout:
    lines = list(islice(io.StringIO(text), options.skip + _LOOK + 2000))
    head = options.skip
    while head < len(lines) and (not lines[head].strip() or lines[head].startswith(options.comment)):
        head += 1
    if head >= len(lines):
        raise InputError(f"'{path}' has no header; its first line must name the columns")
    body = [line for line in lines[head + 1 :] if line.strip()][:_LOOK]
    separator = options.separator or _separator(lines[head], body, path, notes)
    names = [name.strip() for name in _cells(lines[head], separator)]
    units: list[str | None] = [found[1] if (found := _UNIT.fullmatch(name)) else None for name in names]
    start = head + 1
    if options.units_row:
        below = _cells(lines[start], separator) if start < len(lines) else []
        if len(below) != len(names):
            raise InputError(f"'{path}': {len(below)} units for {len(names)} columns; is there a row of units?")
        units = [unit.strip(" []()\t\n") or None for unit in below]
        start, body = start + 1, body[1:]
    decimal = options.decimal or _decimal(body, separator, path, notes)
    if decimal == separator:
        raise InputError(f"'{path}': '{separator}' cannot be both separator and decimal mark; state csv.separator")
    return _Layout(names, units, separator, decimal, start)


def _cells(line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator), [])
    except csv.Error:
        return []


def _separator(header: str, body: list[str], path: Path, notes: Notes) -> str:
    """The first of `_SEPARATORS` that cuts the header and most rows into the same number of cells, more than one."""
    for separator in _SEPARATORS:
        count = len(_cells(header, separator))
        alike = sum(len(_cells(line, separator)) == count for line in body[:20])
        if count > 1 and 2 * alike >= len(body[:20]):
            notes.assume(f"columns are separated by {separator!r}: header and first rows have {count} cells each")
            return separator
    raise InputError(f"'{path}': no separator gives header and rows the same number of cells; state csv.separator")


def _decimal(body: list[str], separator: str, path: Path, notes: Notes) -> str:
    """The only mark in the first rows' numbers; a point where there is none."""
    if separator == ",":
        return "."
    cells = [cell for line in body for cell in _cells(line, separator)]
    marks = [mark for mark, pattern in _WITH.items() if any(pattern.fullmatch(cell) for cell in cells)]
    if len(marks) > 1:
        raise InputError(f"'{path}': the first rows hold numbers with '.' and with ','; state csv.decimal")
    decimal = marks[0] if marks else "."
    reason = "the only one in the first rows" if marks else "no number in the first rows has any"
    notes.assume(f"decimal mark '{decimal}': {reason}")
    return decimal


def _check_lines(text: str, layout: _Layout, path: Path) -> None:
    """Refuse lines with too many or too few cells; in a text with quotes only those that have too many."""
    if '"' in text:
        return
    due = len(layout.names) - 1
    for number, line in enumerate(text.split("\n"), 1):
        if number > layout.start and line.count(layout.separator) != due and line.strip():
            found = line.count(layout.separator) + 1
            raise InputError(f"'{path}' line {number}: {found} cells for {due + 1} columns; mend that line")


def _parsed(
    text: str, layout: _Layout, options: Csv, lost: Mapping[str, Sequence[str]], path: Path, texts: frozenset[str]
) -> pd.DataFrame:
    unique = [f"{i}:{name}" for i, name in enumerate(layout.names)]
    columns = [layout.names.index(name) for name in lost]
    settings: dict[str, Any] = {"sep": layout.separator, "decimal": layout.decimal, "thousands": options.thousands}
    try:
        frame = pd.read_csv(
            io.StringIO(text),
            header=None,
            names=unique,
            index_col=False,
            usecols=[unique[i] for i in columns],
            dtype={unique[i]: str for i in columns if layout.names[i] in texts},
            skiprows=layout.start,
            keep_default_na=False,
            na_values={unique[i]: [*_EMPTY, *lost[layout.names[i]]] for i in columns},
            skipinitialspace=True,
            low_memory=False,
            on_bad_lines="error",
            **settings,
        )
    except (ValueError, OverflowError, pd.errors.EmptyDataError) as error:
        reason = " ".join(str(error).replace("Error tokenizing data. C error: ", "").split())[:120]
        raise InputError(f"'{path}' is not a whole table ({reason}); mend that line") from None
    frame = frame[[unique[i] for i in columns]]
    frame.columns = pd.Index(list(lost))
    return frame


def _column(name: str, values: Any, layout: _Layout) -> Column:
    unit = layout.units[layout.names.index(name)]
    if values.dtype.kind in "fiub":
        return Column(name, values.to_numpy(dtype=np.float64), unit)
    texts = [value if isinstance(value, str) else "" if pd.isna(value) else str(value) for value in values.tolist()]
    pattern = re.compile(rf"\s*[+-]?(\d+\{layout.decimal}?\d*|\{layout.decimal}\d+)([eE][+-]?\d+)?\s*|")
    fault = next(((row, cell) for row, cell in enumerate(texts) if not pattern.fullmatch(cell)), None)
    return Column(name, texts, unit, fault=fault)
