"""Figures and parts of figures that are finished in a folder, for as long as nothing that they depend on changes."""

import hashlib
import json
import shutil
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from experiments.reporting.size import Size
from railsim.distribution import CODE, ROOT
from railsim.files import json_text, new_file, replace_file
from railsim.plugins import plugin_folders
from railsim.recording import software_versions

FOLDER = ".figures"
_PLACES = (*CODE, "scenarios", "track_data")


@dataclass(frozen=True)
class Kept:
    """What is finished in the folder of the pictures: figures in `.figures/SIZE/NAME.json`, and of a figure that is
    not, its parts in `.figures/SIZE/NAME/PART.parquet`.

    Parameters
    ----------
    folder : of the pictures and tables. size : of the figures. inputs : digest of what they are made from.
    """

    folder: Path
    size: Size
    inputs: str

    def result(self, name: str) -> dict[str, Any] | None:
        """What `publish` gave; None where it is not kept, was made from something else, or a file is not as it was."""
        with suppress(OSError, ValueError, TypeError, KeyError):
            found = json.loads(self._path(name).read_text(encoding="utf-8"))
            files: dict[str, str] = found["files"]
            if found["inputs"] == self.inputs and all(_digest(self.folder / at) == due for at, due in files.items()):
                return {"files": [str(self.folder / at) for at in files], "claims": found["claims"]}
        return None

    def keep(self, name: str, result: dict[str, Any]) -> None:
        """Keep what `publish` gave for figure `name`, whose files are written."""
        files = {Path(path).relative_to(self.folder).as_posix(): _digest(Path(path)) for path in result["files"]}
        values = {"inputs": self.inputs, "files": files, "claims": result["claims"]}
        replace_file(self._path(name), json_text(values).encode())
        shutil.rmtree(self._path(name).with_suffix(""), ignore_errors=True)

    def part(self, name: str, part: str) -> tuple[pd.DataFrame, float] | None:
        """A part's table and its processor time, s; None as for a figure."""
        with suppress(OSError, ValueError, TypeError, KeyError):
            table = pd.read_parquet(self._part_path(name, part))
            about, table.attrs = table.attrs, {}
            return (table, float(about["seconds"])) if about["inputs"] == self.inputs else None
        return None

    def keep_part(self, name: str, part: str, table: pd.DataFrame, seconds: float) -> None:
        """Keep the table of a part, and what it took."""
        table = table.copy(deep=False)
        table.attrs = {"inputs": self.inputs, "seconds": seconds}
        with new_file(self._part_path(name, part)) as aside:
            table.to_parquet(aside)

    def _path(self, name: str) -> Path:
        return self.folder / FOLDER / self.size.value / f"{name}.json"

    def _part_path(self, name: str, part: str) -> Path:
        return self._path(name).with_suffix("") / f"{part}.parquet"


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
