"""Track files: CSV with one row per distance, comment lines with `#`, columns `"name [unit]"`."""

import os
from functools import lru_cache
from pathlib import Path

import numpy as np

from railsim.errors import InputError
from railsim.files import replace_file
from railsim.registry import Files
from railsim.track.track import UNITS, Track, fault

DISTANCE = "s [m]"
"""Title of the first column."""

_TITLES = {f"{key} [{unit}]": key for key, unit in UNITS.items()}


TRACKS = Files("tracks", "track_data", ".csv", "track")


def shipped_tracks() -> list[str]:
    """Names of the tracks that come with the program."""
    return list(TRACKS.shipped())


def read_track(source: str | os.PathLike[str]) -> Track:
    """Read a track file.

    Parameters
    ----------
    source : path of a file, or the bare name of a track that ships or is plugged in.

    Returns
    -------
    Track named after the file; its comment lines are kept in `comments`.

    Raises
    ------
    InputError : no such file, not text, or contents that are not a track; the message names file, line and cure.
    """
    path, text = TRACKS.read(source)
    return parse_track(text, path.stem, str(source))


@lru_cache(maxsize=2)
def parse_track(text: str, name: str, source: str = "") -> Track:
    """Track from the text of a file; `source` stands in front of messages. The last two are kept: the runs of a sweep
    share them.
    """
    where = source or name
    comments, rows = _split(text)
    if not rows:
        raise InputError(f'{where}: no columns; the first line must be "{DISTANCE}" and further column names')
    keys = _header(rows[0][1], f"{where} line {rows[0][0]}")
    lines = [number for number, _ in rows[1:]]
    values = _numbers(rows[1:], keys, where)
    s, columns = values[:, 0], {key: values[:, i] for i, key in enumerate(keys) if i}
    problem = fault(s, columns)
    if problem is not None:
        line = lines[problem[0]] if lines else rows[0][0]
        raise InputError(f"{where} line {line}: {problem[1]}")
    return Track(s, columns, name, comments)


def format_track(track: Track) -> str:
    """Text of a track file; every number is written so that reading gives it back exactly."""
    comments = [line for comment in track.comments for line in comment.splitlines() or [""]]
    columns = track.columns()
    title = ",".join([DISTANCE, *(f"{key} [{UNITS[key]}]" for key in columns)])
    table = (np.column_stack([track.s, *columns.values()]) + 0.0).tolist()
    rows = [",".join(map(_text, row)) for row in table]
    return "\n".join([*(f"# {line}" for line in comments), title, *rows, ""])


def write_track(track: Track, path: str | os.PathLike[str]) -> None:
    """Write a track file; it appears under its name only when it is complete.

    Raises
    ------
    InputError : the place cannot be written.
    """
    replace_file(Path(path), format_track(track).encode())


def _split(text: str) -> tuple[list[str], list[tuple[int, str]]]:
    """Comments without their `#`, and the other lines that are not empty with their numbers from 1."""
    comments: list[str] = []
    rows: list[tuple[int, str]] = []
    for number, line in enumerate(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), 1):
        stripped = line.strip()
        if stripped.startswith("#"):
            comments.append(stripped[1:].strip())
        elif stripped:
            rows.append((number, stripped))
    return comments, rows


def _header(line: str, where: str) -> list[str]:
    titles = [title.strip().strip('"') for title in line.split(",")]
    if titles[0] != DISTANCE:
        raise InputError(f'{where}: first column is "{titles[0][:60]}"; it must be "{DISTANCE}" (columns with commas)')
    for i, title in enumerate(titles[1:], 1):
        if title in titles[:i]:
            raise InputError(f'{where}: column "{title}" appears twice; keep one')
        if title not in _TITLES:
            raise InputError(f'{where}: unknown column "{title[:60]}"; a track knows {", ".join(_TITLES)}')
    return ["s", *(_TITLES[title] for title in titles[1:])]


def _numbers(rows: list[tuple[int, str]], keys: list[str], where: str) -> np.ndarray:
    cells = [line.split(",") for _, line in rows]
    for (number, _), row in zip(rows, cells, strict=True):
        if len(row) != len(keys):
            raise InputError(f"{where} line {number}: {len(row)} values for {len(keys)} columns; complete the line")
    try:
        return np.array(cells, dtype=float).reshape(len(rows), len(keys))
    except ValueError:
        raise InputError(_not_a_number(rows, cells, keys, where)) from None


def _not_a_number(rows: list[tuple[int, str]], cells: list[list[str]], keys: list[str], where: str) -> str:
    for (number, _), row in zip(rows, cells, strict=True):
        for key, cell in zip(keys, row, strict=True):
            try:
                float(cell)
            except ValueError:
                return f"{where} line {number}: {key} is '{cell.strip()[:40]}', not a number; fill in a number"
    return f"{where}: holds something that is not a number"


def _text(number: float) -> str:
    return repr(number).removesuffix(".0")
