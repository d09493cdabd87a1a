"""Folders and files of results that are there whole or not at all: write aside, then rename."""

import errno
import fcntl
import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from railsim.errors import InputError

MARKER = ".railsim"
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@contextmanager
def write_folder_atomically(target: Path | str) -> Iterator[Path]:
    """Yield an empty folder next to `target` that becomes `target` at a clean exit and vanishes on an error.

    An existing `target` stays as it is until the new one is complete. Only a folder that railsim wrote (it holds the
    file `.railsim`), an empty one or none at all is replaced.

    Raises
    ------
    InputError : `target` cannot be written, is a file or is somebody else's folder.
    """
    target = Path(target).resolve()
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with _alone_in(target.parent):
            _check_replaceable(target)
        aside = Path(tempfile.mkdtemp(prefix=f"{target.name}.partial-", dir=target.parent))
    except OSError as error:
        raise InputError(f"cannot write '{target}': {error.strerror}; name a folder that can be written") from None
    try:
        content = aside / "content"
        content.mkdir()
        yield content
        (content / MARKER).write_text("Written by railsim, which may replace this folder as a whole.\n")
        with _alone_in(target.parent):
            _check_replaceable(target)
            _swap(content, target, aside)
    except OSError as error:
        if error.errno not in _FULL:
            raise
        raise InputError(f"cannot write '{target}': {error.strerror}; free some space or name another disk") from None
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def replace_file(path: Path, content: bytes) -> None:
    """Write a file aside and rename it; after a crash there is the old one or the new one."""
    aside = path.parent / f".{path.name}.partial-{os.getpid()}"
    try:
        with aside.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(aside, path)
    finally:
        with suppress(FileNotFoundError):
            aside.unlink()


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
        values = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"'{path.parent}' is not {what}: it has no {path.name}; name the right folder") from None
    except OSError as error:
        raise InputError(f"cannot read '{path}': {error.strerror}") from None
    except ValueError:
        raise InputError(f"'{path}' is not JSON (cut short?); make or copy {what} again") from None
    if not isinstance(values, dict):
        raise InputError(f"'{path}' must hold one JSON object; make or copy {what} again")
    return values


def _check_replaceable(target: Path) -> None:
    if target.is_dir():
        if not (target / MARKER).is_file() and any(target.iterdir()):
            raise InputError(f"'{target}' is a folder that railsim did not write; name a new or empty one")
    elif target.exists():
        raise InputError(f"'{target}' is a file; name a folder")


def _swap(content: Path, target: Path, aside: Path) -> None:
    """Rename `content` to `target`, an older `target` first into `aside`; put that back where the first fails."""
    replaced = aside / "replaced"
    with suppress(FileNotFoundError):
        os.rename(target, replaced)
    try:
        os.rename(content, target)
    except OSError:
        if replaced.exists():
            os.rename(replaced, target)
        raise


@contextmanager
def _alone_in(parent: Path) -> Iterator[None]:
    """Keep other writers of folders in `parent` waiting; a file system without locks goes without."""
    handle = os.open(parent, os.O_RDONLY)
    try:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)
