"""The folder of a sweep: what was finished, one small file a task, each there whole or not at all."""

import fcntl
import json
import shutil
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.sweep.plan import Plan, program_digest
from experiments.sweep.task import Row, Task
from railsim.errors import InputError
from railsim.files import read_json, replace_file, write_json
from railsim.recording import software_versions

FORMAT, FORMAT_VERSION = "railsim sweep", 1
SETTINGS, TABLE, REPORT, RUNNING = "sweep.json", "table.parquet", "report.html", "running"
FAILURES = "failures.txt"
_TASKS, _LOCK_FILE = "tasks", ".lock"


@dataclass(frozen=True)
class Store:
    """An open folder of results."""

    folder: Path

    @property
    def running(self) -> Path:
        """Folder for truth that is in use; goes at the end."""
        return self.folder / RUNNING

    def facts(self, task: Task) -> dict[str, Any] | None:
        """What `perform` gave for the task, without its rows; None where it is not finished."""
        found = self.finished(task)
        return None if found is None else {name: value for name, value in found.items() if name not in ("rows", "task")}

    def rows(self, task: Task) -> list[Row]:
        """The rows of a finished task, from its file."""
        found = self.finished(task)
        return [] if found is None else found["rows"]

    def finished(self, task: Task) -> dict[str, Any] | None:
        """What `perform` gave for the task; None where it is not finished or its file is damaged."""
        try:
            stored = json.loads(self._path(task).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return stored if isinstance(stored, dict) and stored.get("task") == task.digest() else None

    def keep(self, task: Task, result: dict[str, Any]) -> None:
        """Store what `perform` gave: aside, flushed to the disk, then renamed."""
        text = json.dumps({"task": task.digest(), **result}, ensure_ascii=False, allow_nan=False)
        replace_file(self._path(task), text.encode() + b"\n")

    def _path(self, task: Task) -> Path:
        return self.folder / _TASKS / f"{task.number:06d}.json"


@contextmanager
def open_store(folder: Path, plan: Plan) -> Iterator[Store]:
    """The folder for this plan's results, held against other processes; made where there is none.

    Raises
    ------
    InputError : the folder holds another sweep or something else, is in use, or cannot be written.
    """
    _check(folder, plan)
    try:
        (folder / _TASKS).mkdir(parents=True, exist_ok=True)
        with (folder / _LOCK_FILE).open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InputError(f"another process is writing '{folder}'; wait for it or name another folder") from None
            _check(folder, plan)
            if not (folder / SETTINGS).exists():
                text = json.dumps(_about(plan), indent=2, ensure_ascii=False) + "\n"
                replace_file(folder / SETTINGS, text.encode())
            store = Store(folder)
            shutil.rmtree(store.running, ignore_errors=True)
            store.running.mkdir(exist_ok=True)
            try:
                yield store
            finally:
                shutil.rmtree(store.running, ignore_errors=True)
    except OSError as error:
        reason = error.strerror or str(error)
        text = f"cannot write '{folder}': {reason}; name a folder that can be written (what is finished is kept)"
        raise InputError(text) from None


def read_settings(folder: Path) -> dict[str, Any]:
    """What `sweep.json` states.

    Raises
    ------
    InputError : the folder is not one of a sweep.
    """
    settings = read_json(folder / SETTINGS, "the folder of a sweep")
    if (settings.get("format"), settings.get("format_version")) != (FORMAT, FORMAT_VERSION):
        raise InputError(f"'{folder}' is not the folder of a sweep of format version {FORMAT_VERSION}; name another")
    return settings


def task_facts(folder: Path) -> list[dict[str, Any]]:
    """Times and memory of every finished task, in the order in which they ended."""
    facts = []
    for path in sorted((folder / _TASKS).glob("*.json")):
        with suppress(OSError, ValueError):
            found = json.loads(path.read_text(encoding="utf-8"))
            facts.append({key: value for key, value in found.items() if key not in ("rows", "task")})
    return sorted(facts, key=lambda one: one["ended"])


def write_throughput(folder: Path, throughput: dict[str, Any]) -> None:
    """Keep what was measured of a session's speed beside the table."""
    write_json(folder / "throughput.json", throughput)


def write_tracebacks(folder: Path, results: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Write the tracebacks of plug-ins that failed, one a message; return them by message."""
    tracebacks = {message: text for one in results for message, text in one.get("tracebacks", {}).items()}
    if tracebacks:
        replace_file(
            folder / FAILURES, "\n\n".join(f"{key}\n\n{tracebacks[key]}" for key in sorted(tracebacks)).encode()
        )
    return tracebacks


def _about(plan: Plan) -> dict[str, Any]:
    sweep = plan.sweep
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "name": sweep.name,
        "description": sweep.description,
        "digest": plan.digest(),
        "program": program_digest(),
        "scenario": Path(sweep.source).name,
        "engine": sweep.engine,
        "design": {"kind": sweep.design.kind, "points": plan.points, "base": sweep.design.points},
        "factors": {name: kind for name, (kind, _) in plan.columns.items()},
        "estimators": [variant.label for variant in sweep.variants],
        "seeds": list(sweep.seeds),
        "sensors": {
            one.name: {"channels": list(one.patterns), "cost": one.cost, "at": one.at.plain()} for one in sweep.sets
        },
        "responses": list(sweep.responses),
        "panels": {one.title: {"score": one.score, "at": one.at.plain()} for one in sweep.panels},
        "tasks": len(plan.tasks),
        "software": software_versions(),
        "begun": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    }


def _check(folder: Path, plan: Plan) -> None:
    if folder.is_file():
        raise InputError(f"'{folder}' is a file; name a folder")
    if not folder.is_dir():
        return
    if not (folder / SETTINGS).exists():
        if any(entry.name not in (_LOCK_FILE, _TASKS, RUNNING) for entry in folder.iterdir()):
            raise InputError(f"'{folder}' holds something that is not a sweep; name a new or empty folder")
        return
    stated = read_settings(folder)
    if stated.get("program") != program_digest():
        raise InputError(
            f"'{folder}' was begun by another version of railsim or of its libraries, whose results are not mixed with "
            "this one's; name another folder"
        )
    if stated.get("digest") != plan.digest():
        raise InputError(f"'{folder}' holds the results of another sweep; name another folder or remove this one")
