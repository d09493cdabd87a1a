"""Large text tables read block by block, so that neither the text nor its lines are ever held as a whole."""

import codecs
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from railsim.field import cells
from railsim.field.cells import Cells
from railsim.field.layout import Layout, find_layout
from railsim.field.lines import TAIL, Sorter
from railsim.field.map import Csv
from railsim.field.tables import Notes
from railsim.progress import counting

LARGE = 50_000_000
"""Bytes from which a text file is read block by block."""
BLOCK = 16_000_000  # bytes

Placed = Callable[[Layout], Mapping[str, int]]
"""Places of the wanted columns by name."""


@dataclass(frozen=True)
class Read:
    """What was read of a text file.

    Attributes
    ----------
    layout : how it is written.
    places : of the wanted columns, by name.
    frame : their cells, by name.
    head : lines of the first rows.
    numbers : of the rows in the file, from 1.
    """

    layout: Layout
    places: Mapping[str, int]
    frame: pd.DataFrame
    head: list[str]
    numbers: "array[int]"


def is_plain(path: Path, options: Csv) -> bool:
    """Whether a file is ASCII without quotes, zero bytes and lone carriage returns: its lines stand for themselves."""
    if options.encoding is not None and not _holds_ascii(options.encoding):
        return False
    with path.open("rb") as file:
        while block := file.read(BLOCK):
            if block.endswith(b"\r"):
                block += file.read(1)
            if not block.isascii() or b'"' in block or b"\0" in block or block.count(b"\r") != block.count(b"\r\n"):
                return False
    return True


def _holds_ascii(encoding: str) -> bool:
    """Whether ASCII means the same in an encoding."""
    text = "".join(map(chr, range(1, 128)))
    try:
        return codecs.encode(text, encoding) == text.encode("ascii")
    except (LookupError, UnicodeError):
        return False


def read_blocks(
    path: Path,
    options: Csv,
    lost: Mapping[str, Sequence[str]],
    notes: Notes,
    texts: frozenset[str],
    look: int,
    placed: Placed,
) -> Read | None:
    """Columns of a plain file; None where a column that may be numbers is text, or rows are no table: the reader of the
    whole tells what is wrong.

    Parameters
    ----------
    path, options, lost, notes, texts : as for `text.read_text`.
    look : lines from which the layout is found.
    placed : places of the wanted columns by name; raises where there is none.

    Raises
    ------
    InputError : as the reader of the whole.
    """
    said = Notes()
    lines = _lines(path)
    first: list[str] = []
    for line in lines:
        first.append(line)
        if len(first) >= options.skip + look:
            break
    layout = find_layout(first, options, path, said)
    places = placed(layout)
    sorter, reader, parts = Sorter(layout, options, set(places.values())), Cells(layout, lost, places, texts), _Parts()
    head: list[str] = []
    count, last = 0, ""
    for number, line in enumerate(_after(first, lines)):
        count, last = number + 1, line
        if number < layout.start:
            continue
        sorter.take(number, line)
        if len(sorter.lines) >= cells.ROWS_AT_ONCE + TAIL:
            head = head or sorter.lines[:look]
            if not parts.add(reader.part(sorter.take_out(cells.ROWS_AT_ONCE))):
                return None
    sorter.end(last, count, path, said)
    head = head or sorter.lines[:look]
    if not sorter.numbers or not parts.add(reader.part(sorter.lines)):
        return None
    for text in said.assumptions:
        notes.assume(text)
    for text in said.repairs:
        notes.repair(text)
    return Read(layout, places, reader.named(parts.frame()), head, sorter.numbers)


class _Parts:
    """Columns as they grow, by key."""

    def __init__(self) -> None:
        self._numbers: dict[str, list[np.ndarray]] = {}
        self._texts: dict[str, list[str]] = {}

    def add(self, part: tuple[dict[str, np.ndarray], dict[str, list[str]]] | None) -> bool:
        """Take some rows; False where they could not be read."""
        if part is None:
            return False
        for name, values in part[0].items():
            self._numbers.setdefault(name, []).append(values.copy())  # a view would hold the whole part
        for name, values in part[1].items():
            self._texts.setdefault(name, []).extend(values)
        return True

    def frame(self) -> pd.DataFrame:
        """The columns by key; parts are let go column by column."""
        whole: dict[str, Any] = {key: np.concatenate(self._numbers.pop(key)) for key in list(self._numbers)}
        whole |= {key: pd.Series(values) for key, values in self._texts.items()}
        return pd.DataFrame(whole, copy=False)


def _after(first: list[str], rest: Iterator[str]) -> Iterator[str]:
    yield from first
    yield from rest


def _lines(path: Path) -> Iterator[str]:
    """Lines without their ends; the last is what stands after the last end, often nothing."""
    rest = ""
    with path.open("rb") as file, counting(path.stat().st_size / 1e6, f"reading {path.name}", "MB") as bar:
        while block := file.read(BLOCK):
            if block.endswith(b"\r"):
                block += file.read(1)
            some = (rest + block.decode("ascii").replace("\r\n", "\n")).split("\n")
            rest = some.pop()
            yield from some
            bar.update(len(block) / 1e6)
    yield rest
