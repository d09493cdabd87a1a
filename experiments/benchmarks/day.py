"""A day of data, from the file to the report: time and memory of each command, of its whole tree of processes."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.benchmarks.day_data import write_day
from railsim.errors import InputError
from railsim.progress import counted, counting

ESTIMATORS = ("speed_refined", "alignment_vertical", "cross_level", "dipped_joints")
LOOK = 0.05  # s between two looks at the memory
GIB = 2.0**30


@dataclass(frozen=True)
class Cost:
    """Of one command: wall-clock and processor time, s; largest resident memory of its tree of processes, bytes."""

    seconds: float
    processor: float
    memory: float


def day_rows(hours: float, ending: str = ".parquet", folder: Path | None = None) -> list[dict[str, Any]]:
    """Rows of the benchmark: name, value, unit; time and memory of each step, and of the whole.

    Parameters
    ----------
    hours : length of the record.
    ending : of the file that is imported, .parquet or .csv.
    folder : where data and results stay; None: nothing stays.
    """
    with tempfile.TemporaryDirectory(prefix="railsim-day-") as made:
        place = Path(made) if folder is None else folder
        place.mkdir(parents=True, exist_ok=True)
        data = place / f"day{ending}"
        if not data.is_file():
            with counting(None, f"writing {data.name}", "s", by_clock=True):
                write_day(data, 3600.0 * hours)
        costs = {name: measured(words) for name, words in counted(steps(place, data).items(), "measuring", "commands")}
    rows = []
    for name, cost in costs.items():
        rows += [_row(f"{name}, {hours:g} h", cost.seconds, "s"), _row(f"{name}, memory", cost.memory / GIB, "GiB")]
    rows.append(_row(f"day of data, {hours:g} h, all", sum(one.seconds for one in costs.values()), "s"))
    rows.append(_row("processor time of it", sum(one.processor for one in costs.values()), "s"))
    rows.append(_row("most memory of it", max(one.memory for one in costs.values()) / GIB, "GiB"))
    return rows


def steps(place: Path, data: Path) -> dict[str, list[str]]:
    """Arguments of each command, by its name."""
    recording = str(place / "recording")
    found = {"import": ["import", str(data), "--map", str(place / "map.yaml"), "--out", recording]}
    found["inspect"] = ["inspect", recording]
    for name in ESTIMATORS:
        found[f"estimate {name}"] = ["estimate", name, recording, "--out", str(place / name)]
    tracks = [str(place / name) for name in ESTIMATORS if name in ("alignment_vertical", "cross_level")]
    return found | {"condition": ["condition", *tracks, "--line-speed", "120", "--out", str(place / "condition")]}


def measured(arguments: Sequence[str]) -> Cost:
    """Cost of a command of railsim.

    Raises
    ------
    InputError : it fails for another reason than that something was found.
    """
    began = time.perf_counter()
    before = os.times()
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen([sys.executable, "-m", "railsim", *arguments], stdout=said, stderr=said)
        most = 0.0
        while process.poll() is None:
            most = max(most, tree_memory(process.pid))
            time.sleep(LOOK)
        said.seek(0)
        text = said.read().decode(errors="replace").strip()
    after = os.times()
    if process.returncode not in (0, 1):
        raise InputError(
            f"'railsim {' '.join(arguments)}' failed: {text.splitlines()[-1] if text else 'without a word'}"
        )
    worked = after.children_user + after.children_system - before.children_user - before.children_system
    return Cost(time.perf_counter() - began, worked, most)


def tree_memory(process: int) -> float:
    """Resident memory of a process and of all below it, bytes; pages that they share count once for each."""
    try:
        pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
        children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    except (OSError, IndexError):
        return 0.0  # it has ended meanwhile
    return pages * os.sysconf("SC_PAGE_SIZE") + sum(tree_memory(int(child)) for child in children)


def _row(name: str, value: float, unit: str) -> dict[str, Any]:
    return {"name": name, "value": value, "unit": unit, "against": None, "ratio": None}
