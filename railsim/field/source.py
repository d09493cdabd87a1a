"""Opening the file: which format it is, and the columns that the map asks for."""

import re
import struct
from collections.abc import Mapping, Sequence
from dataclasses import replace
from hashlib import file_digest
from pathlib import Path
from typing import Any

from railsim.errors import InputError
from railsim.field.containers import other_container
from railsim.field.guard import Guard
from railsim.field.map import Csv
from railsim.field.readers.interface import Wanted
from railsim.field.tables import Notes, Table
from railsim.field.text import read_text
from railsim.progress import counted, counting

_SIGNATURES = (
    (b"PAR1", "parquet"), (b"MDF     ", "mdf4"), (b"TDSm", "tdms"), (b"MATLAB 5", "mat"), (b"MATLAB 7", "mat"),
    (b"\x89HDF\r\n\x1a\n", "hdf5"),
)  # fmt: skip
_NAMES = {"csv": "text", "parquet": "Parquet", "mdf4": "MDF", "tdms": "TDMS", "mat": "MATLAB", "hdf5": "HDF5",
          "nmea": "NMEA 0183", "gpx": "GPX"}  # fmt: skip
_SENTENCE = re.compile(rb"\$[A-Z]{2}(?:RMC|GGA|VTG|ZDA|GLL|GSA|GSV|GNS|GST|TXT|HDT),|\$P[A-Z]{3,6},")
_LOOK = 4096  # bytes
_VERSION_4 = {1000 * order + 10 * number + kind for order in (0, 1) for number in range(6) for kind in (0, 1, 2)}


def find_format(path: Path, stated: str | None, notes: Notes) -> str:
    """The stated format, or that of the file's first bytes.

    Raises
    ------
    InputError : the file cannot be read, is empty, unfinished, an archive, or of another format than stated.
    """
    try:
        with path.open("rb") as file:
            head = file.read(8)
    except OSError as error:
        raise InputError(f"cannot read '{path}': {error.strerror}; check the path") from None
    if not head:
        raise InputError(f"'{path}' is empty; copy it again")
    if head == b"UnFinMF ":
        raise InputError(f"'{path}' is an unfinished MDF4 file; finalise it with the logger's software")
    detected = next((name for mark, name in _SIGNATURES if head.startswith(mark)), None) or _by_content(path)
    other = other_container(path) if detected == "csv" else None
    if other is not None:
        raise InputError(f"'{path}' {other}")
    if stated is None:
        notes.assume(f"format {_NAMES[detected]}, by the file's first bytes")
    elif stated != detected:
        raise InputError(f"'{path}' is a {_NAMES[detected]} file, the map says {_NAMES[stated]}; correct 'format'")
    return detected


def _is_matlab_4(head: bytes) -> bool:
    """Whether a file begins with a matrix of version 4: type, rows, columns, imaginary part, a name ended by 0."""
    for order in "<>":
        if len(head) > 22:
            kind, rows, columns, imaginary, length = struct.unpack_from(f"{order}5i", head)
            name = head[20 : 20 + max(length, 0)]
            known = kind in _VERSION_4 and imaginary in (0, 1) and rows > 0 and columns > 0
            if known and 2 <= length <= 64 and re.fullmatch(rb"[A-Za-z]\w*\0", name):
                return True
    return False


def _by_content(path: Path) -> str:
    """A receiver's log, a GPX file, a MATLAB file of version 4, or text."""
    with path.open("rb") as file:
        head = file.read(_LOOK)
    if _is_matlab_4(head):
        return "mat"
    if head.lstrip(b"\xef\xbb\xbf \r\n\t")[:1] == b"<" and b"<gpx" in head:
        return "gpx"
    lines = [line for line in head.splitlines() if line.strip()]
    sentences = sum(bool(_SENTENCE.search(line)) for line in lines)
    return "nmea" if lines and 2 * sentences > len(lines) else "csv"


def read_tables(
    path: Path,
    kind: str,
    options: Csv,
    wanted: Sequence[Wanted],
    lost: dict[str, list[str]],
    notes: Notes,
    guard: Guard | None = None,
    texts: frozenset[str] = frozenset(),
    where: Sequence[Mapping[str, str | float]] = (),
) -> list[Table]:
    """Columns of each of `wanted`; binary formats are read by `guard`, or by one of its own.

    `texts` names the columns of a text file that stay text, as dates and times; `where` gives for each of `wanted` the
    values by column that a row of a text file must hold.

    Raises
    ------
    InputError : a column or group is not there, or the file is damaged.
    """
    if kind == "csv":
        if any(one.group is not None for one in wanted):
            raise InputError(f"'{path}': a text file has no groups; leave 'group' out")
        if any(one.clock for one in wanted):
            raise InputError(f"'{path}': a text file has no time axis of its own; name the column of time")
        return _text_tables(path, options, wanted, lost, notes, texts, where or [{} for _ in wanted])
    if guard is None:
        with Guard() as own:
            tables = _guarded(own, kind, path, wanted)
    else:
        tables = _guarded(guard, kind, path, wanted)
    for text in dict.fromkeys(text for table in tables for text in table.told):
        notes.repair(text)
    if any(table.cut_short for table in tables):
        notes.repair(f"the {_NAMES[kind]} file ends within its last segment: what is there is taken")
    return tables


def _guarded(guard: Guard, kind: str, path: Path, wanted: Sequence[Wanted]) -> list[Table]:
    """Tables as the guard reads them; of Parquet, which stores columns apart, one column after the other, so that the
    reading process never holds a day's data.
    """
    if kind != "parquet":
        with counting(None, f"reading {path.name}", "s", by_clock=True):
            return guard.read(kind, path, list(wanted))
    tables = []
    for one in wanted:
        parts = [
            guard.read(kind, path, [replace(one, columns=(name,))])[0]
            for name in counted(one.columns, f"reading {path.name}", "columns")
        ]
        if not parts:
            tables += guard.read(kind, path, [one])
            continue
        dated = [part for part in parts if part.start is not None] or parts
        columns = {name: column for part in parts for name, column in part.columns.items()}
        tables.append(replace(dated[-1], columns=columns))
    return tables


def _text_tables(
    path: Path,
    options: Csv,
    wanted: Sequence[Wanted],
    lost: dict[str, list[str]],
    notes: Notes,
    texts: frozenset[str],
    where: Sequence[Mapping[str, str | float]],
) -> list[Table]:
    """The file is read once for all tables of the same rows."""
    tables: dict[int, Table] = {}
    for rows in [one for number, one in enumerate(where) if one not in where[:number]]:
        numbers = [number for number, one in enumerate(where) if one == rows]
        names = dict.fromkeys(name for number in numbers for name in wanted[number].columns)
        table = read_text(path, options, {name: lost.get(name, []) for name in names}, notes, texts, rows)
        for number in numbers:
            columns = {name: table.columns[name] for name in wanted[number].columns}
            tables[number] = replace(table, columns=columns)
    return [tables[number] for number in range(len(wanted))]


def about_file(path: Path, kind: str) -> dict[str, Any]:
    """Name, size, digest and format of the file, for about.json."""
    with path.open("rb") as file:
        digest = file_digest(file, "sha256").hexdigest()
    return {"file": path.name, "bytes": path.stat().st_size, "sha256": digest, "format": kind}
