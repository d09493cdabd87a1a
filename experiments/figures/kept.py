"""Figures that are finished in a folder: what each had to say, for as long as nothing that it depends on changes."""

import hashlib
import json
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from experiments.reporting.size import Size
from railsim.distribution import CODE, ROOT
from railsim.files import json_text, replace_file
from railsim.plugins import plugin_folders
from railsim.recording import software_versions

FOLDER = ".figures"
_PLACES = (*CODE, "scenarios", "track_data")


class Kept:
    """What is finished in the folder of the pictures, in `.figures/SIZE/NAME.json`.

    Parameters
    ----------
    folder : of the pictures and tables. size : of the figures. inputs : digest of what they are made from.
    """

    def __init__(self, folder: Path, size: Size, inputs: str) -> None:
        self._folder, self._size, self._inputs = folder, size, inputs

    def result(self, name: str) -> dict[str, Any] | None:
        """What `publish` gave; None where it is not kept, was made from something else, or a file is not as it was."""
        with suppress(OSError, ValueError, TypeError, KeyError):
            found = json.loads(self._path(name).read_text(encoding="utf-8"))
            files: dict[str, str] = found["files"]
            if found["inputs"] == self._inputs and all(_digest(self._folder / at) == due for at, due in files.items()):
                return {"files": [str(self._folder / at) for at in files], "claims": found["claims"]}
        return None

    def keep(self, name: str, result: dict[str, Any]) -> None:
        """Keep what `publish` gave for figure `name`, whose files are written."""
        files = {Path(path).relative_to(self._folder).as_posix(): _digest(Path(path)) for path in result["files"]}
        values = {"inputs": self._inputs, "files": files, "claims": result["claims"]}
        replace_file(self._path(name), json_text(values).encode())

    def _path(self, name: str) -> Path:
        return self._folder / FOLDER / self._size.value / f"{name}.json"


def inputs_digest() -> str:
    """SHA-256 over the program, its data, plug-in folders and the versions of its libraries."""
    total = hashlib.sha256(json.dumps(software_versions(), sort_keys=True).encode())
    for root in [*(ROOT / place for place in _PLACES), *plugin_folders()]:
        for path in _files(root):
            total.update(f"{root.name}/{path.relative_to(root).as_posix()}\0{_digest(path)}\n".encode())
    return total.hexdigest()


def _files(root: Path) -> Iterator[Path]:
    """Files below but those that Python and its compilers make."""
    yield from (path for path in sorted(root.rglob("*")) if path.is_file() and "__pycache__" not in path.parts)


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
