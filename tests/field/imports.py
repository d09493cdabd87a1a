"""Imports for tests: a text and a map in, a recording or the line of the refusal out."""

import copy
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from railsim import Recording
from railsim.errors import InputError
from railsim.field.guard import Guard
from railsim.field.importing import import_file

UP = "body.acceleration_z [m/s2]"
SPEED = "gnss.speed [m/s]"


def mapped(time: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    """A map for one table with one channel: keys of the channel and the table, and of the map under `whole`."""
    channel = {"column": "az", "unit": "m/s2"} | more.pop("channel", {})
    whole = more.pop("whole", {})
    table = {"time": time or {"kind": "seconds", "column": "t"}, "channels": {UP: channel}} | more
    return {"origin": "test", "vehicle": "manchester", "tables": [table]} | whole


def run(folder: Path, data: str | bytes | Path, values: dict[str, Any], guard: Guard | None = None) -> Recording:
    """Import a file, or text that is written to one, into `out`."""
    path = data if isinstance(data, Path) else folder / "data.csv"
    if not isinstance(data, Path):
        path.write_bytes(data if isinstance(data, bytes) else data.encode())
    map_file = folder / "map.yaml"
    map_file.write_text(yaml.safe_dump(values, allow_unicode=True, sort_keys=False), encoding="utf-8")
    import_file(path, map_file, folder / "out", guard)
    return Recording.open(folder / "out")


def refusal(folder: Path, data: str | bytes | Path, values: dict[str, Any], guard: Guard | None = None) -> str:
    """The one line with which an import is refused."""
    with pytest.raises(InputError) as caught:
        run(folder, data, values, guard)
    line = str(caught.value)
    assert "\n" not in line
    return line


def proposed(line: str, start: str) -> dict[str, Any]:
    """The YAML of a quoted line of the map that a message proposes and that begins with `start`."""
    found = re.search(rf"'({re.escape(start)}(?:[^']*))'", line)
    assert found is not None, line
    return yaml.safe_load(found[1])


def followed(values: dict[str, Any], cure: dict[str, Any], table: int = 0) -> dict[str, Any]:
    """The map with the proposed keys in a table."""
    changed = copy.deepcopy(values)
    changed["tables"][table] |= cure
    return changed


def csv(columns: dict[str, Any], separator: str = ",", numbers: str = "%.10g") -> str:
    """A text table of equally long columns."""
    lines = [separator.join(columns)]
    for row in zip(*columns.values(), strict=True):
        lines.append(separator.join(one if isinstance(one, str) else numbers % one for one in row))
    return "\n".join(lines) + "\n"


def rate(recording: Recording, name: str = UP) -> float:
    """Sample rate of a channel, Hz."""
    return recording.measurements.rate(name)


def values(recording: Recording, name: str = UP) -> np.ndarray:
    """Samples of a channel."""
    return recording.measurements[name]


def time(recording: Recording, name: str = UP) -> np.ndarray:
    """Times of a channel, s."""
    return recording.measurements.time(name)


def told(recording: Recording, part: str) -> bool:
    """Whether an assumption or repair of the import says this."""
    about = recording.measurements.about
    return any(part in text for text in [*about["assumptions"], *about["repairs"]])
