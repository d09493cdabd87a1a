"""How every kernel of the project is compiled, and where the machine code is kept."""

import hashlib
import os
import re
import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import config

F = TypeVar("F", bound=Callable[..., Any])

PACKAGES = ("railsim", "estimators")
_IMPORTED = re.compile(rb"^from ((?:railsim|estimators)[.\w]*) import", re.MULTILINE)
KEPT = 30 * 86400.0  # s; machine code of other versions of the source is removed after that

# Contraction and reassociation are allowed; NaN and infinity keep their meaning, so that a run that diverges is seen.
_njit: Any = numba.njit
_OPTIONS: dict[str, Any] = {
    "cache": True,
    "nogil": True,
    "fastmath": {"contract", "reassoc", "nsz"},
    "error_model": "numpy",
}


def kernel(function: F) -> F:
    """Compiled, cached on disk; works on the arrays that it is given and makes none.

    Division by zero gives infinity as in NumPy.
    """
    return cast(F, _njit(_nrt=False, **_OPTIONS)(function))


def inlined(function: F) -> F:
    """A kernel that is copied into its callers: for small functions whose call would cost more than what they do."""
    return cast(F, _njit(forceinline=True, _nrt=False, **_OPTIONS)(function))


def allocating(function: F) -> F:
    """A kernel that may make arrays."""
    return cast(F, _njit(**_OPTIONS)(function))


def _keep_by_source() -> None:
    """Keep machine code in a folder named after the source of all kernels.

    Numba notices a change in a kernel's own file only, and would go on calling the old code of kernels in other files.
    """
    given = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    folder = Path(given) / "railsim-kernels"
    try:
        own = folder / _source_digest()
        own.mkdir(parents=True, exist_ok=True)
        os.utime(own)
    except OSError:
        return  # no place for it: Numba's own choice, beside the source
    config.CACHE_DIR = str(own)  # pyright: ignore[reportAttributeAccessIssue]
    for other in folder.iterdir():
        with suppress(OSError):
            if time.time() - other.stat().st_mtime > KEPT:
                shutil.rmtree(other)


def _source_digest() -> str:
    """SHA-256 over every file that defines kernels and every file of ours that such a file imports (constants)."""
    roots = [
        Path(root) for name in PACKAGES if (spec := find_spec(name)) for root in spec.submodule_search_locations or []
    ]
    texts = {path: path.read_bytes() for root in roots for path in root.rglob("*.py")}
    wanted = {path for path, text in texts.items() if b"railsim.compiled" in text}
    modules = {module.decode() for path in wanted for module in _IMPORTED.findall(texts[path])}
    wanted |= {root.parent.joinpath(*module.split(".")).with_suffix(".py") for root in roots for module in modules}
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(wanted & set(texts), key=lambda path: path.as_posix()):
        digest.update(path.name.encode() + b"\0" + texts[path])
    return digest.hexdigest()[:16]


_keep_by_source()
