"""How every kernel of the project is compiled, and where the machine code is kept."""

import gc
import hashlib
import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import config, event

from railsim.imports import imported_files
from railsim.scratch import user_cache, writable_or_temporary

F = TypeVar("F", bound=Callable[..., Any])

_KERNELS = b"from railsim.compiled import"
_imported = cache(imported_files)
KEPT = 30 * 86400.0  # s; machine code of other versions of the source is removed after that

# Contraction and reassociation are allowed; NaN and infinity keep their meaning, so that a run that diverges is seen.
_njit: Any = numba.njit
_OPTIONS: dict[str, Any] = {
    "cache": True,
    "nogil": True,
    "fastmath": {"contract", "reassoc", "nsz"},
    "error_model": "numpy",
    "no_cfunc_wrapper": True,  # nobody calls one of them from C
}


class _Uncollected(event.Listener):
    """While a kernel is compiled nobody looks for garbage: nearly all that it makes stays."""

    def __init__(self) -> None:
        self._inside, self._wanted = 0, False

    def on_start(self, event: Any) -> None:
        if not self._inside:
            self._wanted = gc.isenabled()
            gc.disable()
        self._inside += 1

    def on_end(self, event: Any) -> None:
        self._inside -= 1
        if not self._inside and self._wanted:
            gc.enable()


event.register("numba:compile", _Uncollected())


def kernel(function: F) -> F:
    """Compiled, cached on disk; works on the arrays that it is given and makes none.

    Division by zero gives infinity as in NumPy.
    """
    return _compiled(function, _nrt=False)


def inlined(function: F) -> F:
    """A kernel that is copied into its callers: for small functions whose call would cost more than what they do."""
    return _compiled(function, forceinline=True, _nrt=False)


def allocating(function: F) -> F:
    """A kernel that may make arrays."""
    return _compiled(function)


def as_written(function: F) -> F:
    """Compiled without reassociation: a record in one piece and sample by sample give the same numbers."""
    with _kept_by_source(function):
        return cast(F, _njit(cache=True, nogil=True)(function))


def _compiled(function: F, **options: Any) -> F:
    with _kept_by_source(function):
        return cast(F, _njit(**options, **_OPTIONS)(function))


@contextmanager
def _kept_by_source(function: Callable[..., Any]) -> Iterator[None]:
    """Keep machine code in a folder named after the source that it is made of.

    Numba notices a change in a kernel's own file only, and would go on calling the old code of kernels in other files.
    """
    before = config.CACHE_DIR  # pyright: ignore[reportAttributeAccessIssue]
    own = kernel_folder() / source_digest(Path(function.__code__.co_filename))
    own.mkdir(parents=True, exist_ok=True)
    with suppress(OSError):
        os.utime(own)
    config.CACHE_DIR = str(own)  # pyright: ignore[reportAttributeAccessIssue]
    try:
        yield
    finally:
        config.CACHE_DIR = before  # pyright: ignore[reportAttributeAccessIssue]


@cache
def kernel_folder() -> Path:
    """Folder of all machine code; what nobody has used for long is removed from it.

    Where it cannot be written, a temporary one for this process.
    """
    given = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    place = writable_or_temporary(Path(given or user_cache()), "compiled kernels", "NUMBA_CACHE_DIR")
    folder = place / "railsim-kernels"
    with suppress(OSError):
        for other in folder.iterdir():
            if time.time() - other.stat().st_mtime > KEPT:
                shutil.rmtree(other)
    return folder


@cache
def source_digest(file: Path) -> str:
    """SHA-256 of Numba's version and of `sources`."""
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(sources(file), key=lambda path: path.as_posix()):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def sources(file: Path) -> set[Path]:
    """A file of kernels, those whose kernels it imports (by packages too), and every file of ours that these import.

    The latter hold constants and the names of arguments' fields; what they import is not followed.
    """
    files, ahead = {file}, [file]
    while ahead:
        imported = _imported(ahead.pop())
        ahead += [path for path in imported - files if path.name == "__init__.py" or _KERNELS in path.read_bytes()]
        files |= imported
    return files
