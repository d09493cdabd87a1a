"""Runs that were simulated before: one truth folder a digest, safe to share between processes."""

import fcntl
import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from railsim.errors import InputError
from railsim.scratch import user_cache, writable_or_temporary
from railsim.truth import Truth

VARIABLE = "RAILSIM_CACHE"
MOST_BYTES = 8 * 1024**3
IN_USE = 3600.0  # s; a run that was asked for within this time is not removed


def cache_folder() -> Path:
    """Folder of the cache: `RAILSIM_CACHE`, or railsim/truth in the user's cache folder."""
    given = os.environ.get(VARIABLE)
    if given:
        return Path(given)
    return user_cache() / "railsim" / "truth"


def cached(key: str, write: Callable[[Path], None], again: bool = False) -> Truth:
    """The run with the digest `key`; `write` makes it where the cache has none, it is damaged, or `again` is asked for.

    Other processes that want the same run wait for it. Where the cache cannot be written, the run is kept in a
    temporary folder for as long as this process lives.

    Raises
    ------
    InputError : what `write` raises.
    """
    folder = writable_or_temporary(cache_folder(), "simulated runs", VARIABLE)
    target = folder / key
    with _alone(folder / f"{key}.lock"):
        truth = None if again else _open(target)
        if truth is None:
            write(target)
            truth = Truth.open(target)
        with suppress(OSError):
            os.utime(target)
    _prune(folder, keep=target)
    return truth


def _open(target: Path) -> Truth | None:
    try:
        truth = Truth.open(target)
        truth.check()
    except InputError:
        return None
    return truth


def _prune(folder: Path, keep: Path) -> None:
    """Remove the runs that were longest not asked for, until at most `MOST_BYTES` are left."""
    entries = [(used, size, path) for path in folder.iterdir() if path.is_dir() for used, size in _facts(path)]
    total = sum(size for _, size, _ in entries)
    for used, size, path in sorted(entries):
        if total <= MOST_BYTES or time.time() - used < IN_USE:
            return
        if path != keep:
            shutil.rmtree(path, ignore_errors=True)
            path.with_name(f"{path.name}.lock").unlink(missing_ok=True)
            total -= size


def _facts(path: Path) -> list[tuple[float, int]]:
    """[(time of last use, bytes)], or nothing where another process removes the folder right now."""
    with suppress(OSError):
        return [(path.stat().st_mtime, sum(one.stat().st_size for one in path.rglob("*") if one.is_file()))]
    return []


@contextmanager
def _alone(lock: Path) -> Iterator[None]:
    """Hold `lock` among processes; a file system without locks goes without."""
    with lock.open("w") as handle:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
