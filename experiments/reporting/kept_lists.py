"""Lists that were made before, kept in the user's cache folder for as long as no file of the program changes."""

import hashlib
import json
import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from railsim.distribution import CODE, ROOT
from railsim.plugins import any_outside
from railsim.scratch import user_cache

Descriptions = dict[str, str]
_PLACES = (*CODE, "scenarios", "track_data")
_STALE = 10  # versions of the program whose lists are kept


def kept(kind: str) -> Descriptions | None:
    """Names and descriptions of a kind as they were listed; None where they must be looked up.

    Plug-ins from outside the program may change without a trace here: where there are any, nothing is kept.
    """
    path = _path(kind)
    if path is None:
        return None
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) else None


def keep(kind: str, descriptions: Descriptions) -> None:
    """Keep a list; where the folder cannot be written, the next call looks it up again."""
    path = _path(kind)
    if path is None:
        return
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        aside = path.with_suffix(f".{os.getpid()}")
        aside.write_text(json.dumps(descriptions, ensure_ascii=False), encoding="utf-8")
        aside.replace(path)
        others = sorted(path.parent.glob(f"{kind}-*.json"), key=lambda one: one.stat().st_mtime)
        for other in others[:-_STALE]:
            other.unlink(missing_ok=True)


def _path(kind: str) -> Path | None:
    if any_outside():
        return None
    return user_cache() / "railsim" / "lists" / f"{kind}-{_state()}.json"


def _state() -> str:
    """Digest of place, size and time of every file of the program, and of the interpreter's version."""
    total = hashlib.sha256(f"{sys.version}\0{ROOT}".encode())
    for place in _PLACES:
        for line in sorted(_files(str(ROOT / place))):
            total.update(line.encode())
    return total.hexdigest()[:16]


def _files(folder: str) -> Iterator[str]:
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.is_dir():
                if entry.name != "__pycache__":
                    yield from _files(entry.path)
            else:
                facts = entry.stat()
                yield f"{entry.path}\0{facts.st_size}\0{facts.st_mtime_ns}\n"
