"""Folders and files of results that are there whole or not at all: write aside, then rename."""

import ctypes
import errno
import json
import os
import stat
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from railsim.digests import MARKER, write_marker
from railsim.errors import InputError
from railsim.scratch import REPLACED, alone_in, is_scratch, scratch_folder

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
MOST_BYTES = 20_000_000  # of a description
_EXCHANGE = 2  # RENAME_EXCHANGE of Linux: both names change places in one step
_HERE = -100  # AT_FDCWD: paths are taken from the working folder


@contextmanager
def write_folder_atomically(target: Path | str) -> Iterator[Path]:
    """Yield an empty folder next to `target` that becomes `target` at a clean exit and vanishes on an error.

    An existing `target` stays as it is until the new one is complete and on the disk. Only a folder that railsim wrote
    (it holds the file `.railsim`), an empty one or none at all is replaced. `.railsim` gets the digests of all files.

    Raises
    ------
    InputError : `target` cannot be written, is a file or is somebody else's folder.
    """
    target = Path(target).resolve()
    with ExitStack() as stack:
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            _check_replaceable(target)
            content = stack.enter_context(scratch_folder(target.name, target.parent))
        except OSError as error:
            raise InputError(f"cannot write '{target}': {error.strerror}; name a folder that can be written") from None
        try:
            yield content
            write_marker(content)
            if not is_scratch(target.parent):
                _flush(content)
            with alone_in(target.parent):
                _check_replaceable(target)
                _swap(content, target)
        except OSError as error:
            if error.errno not in _FULL:
                raise
            text = f"cannot write '{target}': {error.strerror}; free some space or name another disk"
            raise InputError(text) from None


@contextmanager
def new_file(path: Path, keep: bool = True) -> Iterator[Path]:
    """Yield the name of a file aside that takes the place of `path` at a clean exit and vanishes on an error.

    Parameters
    ----------
    path : the file; folders that lack on its way are made. keep : False only tries whether it could be written.

    Raises
    ------
    InputError : the place cannot be written, or the disk is full.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with scratch_folder(f".{path.name}", path.parent) as aside:
            yield aside / path.name
            if keep:
                _flush(aside)
                os.replace(aside / path.name, path)
    except OSError as error:
        reason = error.strerror or error
        cure = "free some space or name another disk" if error.errno in _FULL else "name a folder that can be written"
        raise InputError(f"cannot write '{path}': {reason}; {cure}") from None


def replace_file(path: Path, content: bytes) -> None:
    """Write a file aside and rename it; after a crash there is the old one or the new one.

    Raises
    ------
    InputError : the place cannot be written, or the disk is full.
    """
    with new_file(path) as aside:
        aside.write_bytes(content)


def write_json(path: Path, values: dict[str, Any]) -> None:
    """Write `values` as JSON."""
    path.write_text(json_text(values), encoding="utf-8")


def json_text(values: dict[str, Any]) -> str:
    """Indented JSON with a final newline; keys keep their order; NaN and infinity are refused."""
    return json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def read_json(path: Path, what: str) -> dict[str, Any]:
    """The JSON object in `path`, a part of `what`.

    Raises
    ------
    InputError : no such file, or not one JSON object.
    """
    try:
        if path.stat().st_size > MOST_BYTES:
            raise InputError(f"'{path}' has {path.stat().st_size} bytes, more than {MOST_BYTES}: is it the right file?")
        values = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"'{path.parent}' is not {what}: it has no {path.name}; name the right folder") from None
    except OSError as error:
        raise InputError(f"cannot read '{path}': {error.strerror}; name one that can be read") from None
    except (ValueError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"'{path}' is not JSON (cut short?); make or copy {what} again") from None
    if not isinstance(values, dict):
        raise InputError(f"'{path}' must hold one JSON object; make or copy {what} again")
    return values


def _check_replaceable(target: Path) -> None:
    try:  # one look: another writer may put its result there at any moment
        is_folder = stat.S_ISDIR(target.stat().st_mode)
    except (FileNotFoundError, NotADirectoryError):
        return
    if not is_folder:
        raise InputError(f"'{target}' is a file; name a folder")
    if not (target / MARKER).is_file() and any(target.iterdir()):
        raise InputError(f"'{target}' is a folder that railsim did not write; name a new or empty one")


def _swap(content: Path, target: Path) -> None:
    """Put `content` in the place of `target`, in one step where the system can exchange two names."""
    if not target.exists():
        os.rename(content, target)
    elif not _exchanged(content, target):
        replaced = content.parent / REPLACED
        os.rename(target, replaced)
        try:
            os.rename(content, target)
        except OSError:
            os.rename(replaced, target)
            raise


def _exchanged(one: Path, other: Path) -> bool:
    """Exchange two names; False where the system or its file system cannot."""
    exchange = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    return exchange is not None and exchange(_HERE, os.fsencode(one), _HERE, os.fsencode(other), _EXCHANGE) == 0


def _flush(folder: Path) -> None:
    """Have the disk keep all that is in a folder before its name is given away."""
    for path in (folder, *folder.rglob("*")):
        if not path.is_symlink():
            handle = os.open(path, os.O_RDONLY)
            try:
                os.fsync(handle)
            finally:
                os.close(handle)
