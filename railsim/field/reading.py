"""The tables of a map from one file or several: phones write one a sensor."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from railsim.errors import InputError
from railsim.field.guard import Guard
from railsim.field.map import RecordingMap, TableMap
from railsim.field.readers.interface import Wanted
from railsim.field.source import about_file, find_format, read_tables
from railsim.field.tables import Notes, Table
from railsim.field.time_bases import Iso, Own, columns_of, lost_of


def read_all(
    paths: Sequence[Path], mapped: RecordingMap, notes: Notes, guard: Guard | None = None
) -> tuple[list[Table], dict[str, Any]]:
    """Tables in the order of the map, and what about.json says of the files.

    Parameters
    ----------
    paths : the file, or the files, or their folder; a table's `file` stands beside the first.
    mapped, notes, guard : as for `import_recording`.

    Raises
    ------
    InputError : a file is named in vain or missing, or cannot be read.
    """
    files = _files(paths, mapped)
    tables: dict[int, Table] = {}
    kinds: dict[Path, str] = {}
    for path, options in dict.fromkeys((files[n], one.csv or mapped.csv) for n, one in enumerate(mapped.tables)):
        numbers = [n for n, one in enumerate(mapped.tables) if files[n] == path and (one.csv or mapped.csv) == options]
        chosen = [mapped.tables[number] for number in numbers]
        kinds[path] = find_format(path, mapped.format, notes)
        texts = frozenset(name for one in chosen if isinstance(one.time, Iso) for name in columns_of(one.time))
        where = [one.rows.where for one in chosen]
        wanted = [_wanted(one) for one in chosen]
        found = read_tables(path, kinds[path], options, wanted, _lost(chosen), notes, guard, texts, where)
        tables |= dict(zip(numbers, found, strict=True))
    about = about_file(next(iter(kinds)), next(iter(kinds.values())))
    if len(kinds) > 1:
        about["files"] = [about_file(path, kind) for path, kind in kinds.items()]
    return [tables[number] for number in range(len(mapped.tables))], about


def file_count(mapped: RecordingMap) -> int:
    """Number of files that the tables name."""
    return len({one.file for one in mapped.tables})


def _files(paths: Sequence[Path], mapped: RecordingMap) -> list[Path]:
    """The file of each table."""
    first = paths[0]
    folder = first if first.is_dir() else first.parent
    given = {path.name: path for path in paths if not path.is_dir()}
    found: list[Path] = []
    for number, table in enumerate(mapped.tables, 1):
        if table.file is None:
            if first.is_dir():
                raise InputError(f"'{first}' is a folder; add 'file: NAME' to table {number}, or name a file")
            found.append(first)
            continue
        if Path(table.file).name != table.file:
            raise InputError(
                f"tables.{number - 1}.file: '{table.file}' is no name of a file beside the first; leave folders out"
            )
        path = given.get(table.file, folder / table.file)
        if not path.is_file():
            raise InputError(f"tables.{number - 1}.file: there is no '{path}'; correct the name or copy the file there")
        found.append(path)
    spare = [path for path in given.values() if path not in found]
    if spare:
        raise InputError(
            f"no table reads '{spare[0].name}'; add 'file: {spare[0].name}' to a table of the map, or leave it out"
        )
    return found


def _wanted(mapped: TableMap) -> Wanted:
    names = [*(channel.column for channel in mapped.channels.values()), *mapped.rows.where, *columns_of(mapped.time)]
    return Wanted(mapped.group, tuple(dict.fromkeys(names)), isinstance(mapped.time, Own))


def _lost(tables: Sequence[TableMap]) -> dict[str, list[str]]:
    """Texts that stand for a lost sample, by column."""
    by_column: dict[str, list[str]] = {}
    for table in tables:
        for channel in table.channels.values():
            texts = [marker for marker in channel.lost if isinstance(marker, str)]
            by_column.setdefault(channel.column, []).extend(texts)
        for name in columns_of(table.time):
            by_column.setdefault(name, []).extend(one for one in lost_of(table.time) if isinstance(one, str))
    return by_column
