"""Folders of things that are being made; what a killed process left of them is found and removed.

Each holds a lock file for as long as its process lives. The kernel lets go of a lock at the end of a process, however
it ends. A folder whose lock is free is therefore dead, which no process number or age could prove.
"""

import atexit
import fcntl
import os
import shutil
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path

from railsim.errors import Noticed

LOCK = ".railsim-lock"
PARTIAL = ".partial-"
REPLACED = "replaced"
"""Name in a scratch folder of the older result that stood in the place of the new one."""

_until_the_end = ExitStack()
atexit.register(_until_the_end.close)
_swept: set[tuple[int, Path]] = set()


@contextmanager
def scratch_folder(name: str = "railsim", parent: Path | str | None = None) -> Iterator[Path]:
    """A new folder `NAME.partial-*`, which vanishes at the end with all that is in it.

    The first one that a process makes in a parent folder is the occasion to remove the dead ones of this user there.

    Parameters
    ----------
    name : the first part of its name. parent : where it shall be; None is the system's temporary folder.

    Raises
    ------
    OSError : the parent cannot be written.
    """
    home = Path(parent or tempfile.gettempdir())
    with alone_in(home):
        if (os.getpid(), home) not in _swept:
            _swept.add((os.getpid(), home))
            _remove_dead(home)
        aside = Path(tempfile.mkdtemp(prefix=f"{name}{PARTIAL}", dir=home))
        lock = _locked(aside / LOCK)
    content = aside / "content"
    try:
        content.mkdir()
        yield content
    finally:
        shutil.rmtree(aside, ignore_errors=True)
        os.close(lock)


def user_cache() -> Path:
    """The user's cache folder; for a user without a home a name below which nothing can be written."""
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:
        return Path(os.devnull)


def writable_or_temporary(folder: Path, what: str, variable: str) -> Path:
    """The folder, or a temporary one that vanishes with this process where it cannot be written; said once.

    Parameters
    ----------
    folder : made where it is not there. what : is kept in it, plural. variable : of the environment, names another.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        reason = error.strerror
    return _temporary(folder, what, variable, reason)


@cache
def _temporary(folder: Path, what: str, variable: str, reason: str | None) -> Path:
    text = f"cannot write '{folder}' ({reason}): {what} are not kept; set {variable} to a folder that can be written"
    warnings.warn(text, Noticed, stacklevel=3)
    temporary = _until_the_end.enter_context(scratch_folder("railsim-cache"))
    os.environ[variable] = str(temporary)  # for processes that this one starts
    return temporary


def is_scratch(path: Path) -> bool:
    """Whether a path lies in a scratch folder: what is written there is not yet anybody's result."""
    return any(PARTIAL in part for part in path.parts)


@contextmanager
def alone_in(parent: Path) -> Iterator[None]:
    """Keep other writers in `parent` waiting; a file system without locks goes without."""
    handle = os.open(parent, os.O_RDONLY)
    try:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def _locked(path: Path) -> int:
    handle = os.open(path, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
    with suppress(OSError):
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    return handle


def _remove_dead(parent: Path) -> None:
    """Remove the scratch folders in `parent` whose processes have ended; an older result goes back to its place."""
    for path in list(parent.glob(f"*{PARTIAL}*")):
        if _is_dead(path):
            place = parent / path.name.rpartition(PARTIAL)[0]
            if (path / REPLACED).is_dir() and not place.exists():
                with suppress(OSError):
                    os.rename(path / REPLACED, place)
            shutil.rmtree(path, ignore_errors=True)


def _is_dead(path: Path) -> bool:
    """Whether it is a scratch folder of this user that no living process holds."""
    try:
        if path.is_symlink() or path.lstat().st_uid != os.geteuid():
            return False
        handle = os.open(path / LOCK, os.O_RDWR | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    finally:
        os.close(handle)
    return True
