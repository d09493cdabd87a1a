"""Opening the file: which format it is, and the columns that the map asks for."""

from collections.abc import Sequence
from hashlib import file_digest
from pathlib import Path
from typing import Any

from railsim.errors import InputError
from railsim.field.guard import Guard
from railsim.field.map import Csv
from railsim.field.readers.interface import Wanted
from railsim.field.tables import Notes, Table
from railsim.field.text import read_text

_SIGNATURES = ((b"PAR1", "parquet"), (b"MDF     ", "mdf4"), (b"TDSm", "tdms"))
_NAMES = {"csv": "text", "parquet": "Parquet", "mdf4": "MDF4", "tdms": "TDMS"}


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
    if head[:4] == b"PK\x03\x04" or head[:2] == b"\x1f\x8b":
        raise InputError(f"'{path}' is an archive; unpack it and import the file inside")
    detected = next((name for mark, name in _SIGNATURES if head.startswith(mark)), "csv")
    if stated is None:
        notes.assume(f"format {_NAMES[detected]}, by the file's first bytes")
    elif stated != detected:
        raise InputError(f"'{path}' is a {_NAMES[detected]} file, the map says {_NAMES[stated]}; correct 'format'")
    return detected


def read_tables(
    path: Path,
    kind: str,
    options: Csv,
    wanted: Sequence[Wanted],
    lost: dict[str, list[str]],
    notes: Notes,
    guard: Guard | None = None,
    texts: frozenset[str] = frozenset(),
) -> list[Table]:
    """Columns of each of `wanted`; binary formats are read by `guard`, or by one of its own.

    `texts` names the columns of a text file that stay text, as dates and times.

    Raises
    ------
    InputError : a column or group is not there, or the file is damaged.
    """
    if kind == "csv":
        if any(one.group is not None for one in wanted):
            raise InputError(f"'{path}': a text file has no groups; leave 'group' out")
        if any(one.clock for one in wanted):
            raise InputError(f"'{path}': a text file has no time axis of its own; name the column of time")
        names = dict.fromkeys(name for one in wanted for name in one.columns)
        table = read_text(path, options, {name: lost.get(name, []) for name in names}, notes, texts)
        return [
            Table({name: table.columns[name] for name in one.columns}, None, None, table.first_row) for one in wanted
        ]
    if guard is None:
        with Guard() as own:
            tables = own.read(kind, path, list(wanted))
    else:
        tables = guard.read(kind, path, list(wanted))
    if any(table.cut_short for table in tables):
        notes.repair(f"the {_NAMES[kind]} file ends within its last segment: what is there is taken")
    return tables


def about_file(path: Path, kind: str) -> dict[str, Any]:
    """Name, size, digest and format of the file, for about.json."""
    with path.open("rb") as file:
        digest = file_digest(file, "sha256").hexdigest()
    return {"file": path.name, "bytes": path.stat().st_size, "sha256": digest, "format": kind}
