"""SHA-256 of every file of a result, kept in its `.railsim`, so that a changed bit is seen when the file is read."""

import hashlib
from collections.abc import Iterator
from pathlib import Path

from railsim.errors import InputError

MARKER = ".railsim"
_HEAD = "Written by railsim, which may replace this folder as a whole. SHA-256 of its files:\n"


def write_marker(folder: Path) -> None:
    """Write `.railsim` with the digests of all files below; a folder within that has its own lists its own files."""
    lines = [f"{_digest(path)}  {path.relative_to(folder).as_posix()}\n" for path in sorted(_files(folder))]
    (folder / MARKER).write_text(_HEAD + "".join(lines), encoding="utf-8")


def as_written(folder: Path, name: str) -> bool:
    """Whether a file is as railsim wrote it; True where it is missing or `.railsim` does not say.

    Parameters
    ----------
    folder : of the result. name : of the file, from there, "measured/256hz.parquet".
    """
    due = listed(folder).get(name)
    path = folder / name
    return due is None or not path.is_file() or _digest(path) == due


def check_as_written(folder: Path, *names: str) -> None:
    """Raise `InputError` where one of the files is not as railsim wrote it."""
    for name in names:
        if not as_written(folder, name):
            raise InputError(
                f"'{folder / name}' is damaged: its SHA-256 is not the one in {MARKER}; make or copy it again, "
                f"or, if you changed it yourself, remove its line from '{folder / MARKER}'"
            )


def is_whole(folder: Path) -> bool:
    """Whether a folder has its `.railsim`, and every file that this and those further down list is as written."""
    markers = [path.parent for path in folder.rglob(MARKER)]
    return folder in markers and all(
        (place / name).is_file() and as_written(place, name) for place in markers for name in listed(place)
    )


def _files(folder: Path) -> Iterator[Path]:
    """All files below but those that a marker within lists; that marker itself is one of them."""
    for path in folder.iterdir():
        if path.is_dir() and not path.is_symlink():
            known = {path / name for name in listed(path)}
            yield from (one for one in _files(path) if one not in known)
            if (path / MARKER).is_file():
                yield path / MARKER
        elif path.name != MARKER:
            yield path


def listed(folder: Path) -> dict[str, str]:
    """Digests by the names of files, as a folder's `.railsim` states them; nothing where there is none."""
    try:
        lines = (folder / MARKER).read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return {}
    pairs = (line.split("  ", 1) for line in lines[1:])
    return {name: digest for digest, name in (pair for pair in pairs if len(pair) == 2)}


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
