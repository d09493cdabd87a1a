"""The process in which binary files are read: asked on stdin, answers on stdout, one request after the other.

A request is a line of JSON (`format`, `path`, `wanted`, `memory`). An answer is a line of JSON and then the numbers of
all columns, float64. Nothing is pickled, so that a file which takes over a reader's library has only numbers to send.
"""

import importlib
import json
import os
import resource
import struct
import sys
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from railsim.errors import InputError
from railsim.field.readers.interface import Wanted
from railsim.field.tables import Table

DAMAGE = (
    ArithmeticError, AssertionError, AttributeError, BufferError, EOFError, ImportError, LookupError, MemoryError,
    NameError, OSError, RuntimeError, TypeError, ValueError, struct.error, zlib.error,
)  # fmt: skip
"""What libraries raise on a damaged file; whatever else they do ends this process, which `guard` notices."""


_CHANGES = ("os.remove", "os.rename", "os.mkdir", "os.rmdir", "os.link", "os.symlink", "os.chmod", "os.truncate")
_FORBIDDEN = ("os.system", "os.exec", "os.fork", "os.posix_spawn", "subprocess.Popen", "socket.connect", "socket.bind")


def main() -> None:
    """Answer until stdin ends."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints must not stand among the answers
    sys.addaudithook(_keep_inside(os.getcwd()))
    for line in sys.stdin:
        head, arrays = answer(json.loads(line))
        _send(answers, head, arrays)


def answer(request: dict[str, Any]) -> tuple[dict[str, Any], list[np.ndarray]]:
    """(header, numbers) of one request; a file that cannot be read gives {"error": line} or {"damaged": line}."""
    _limit(int(request["memory"]))
    wanted = [Wanted(one["group"], tuple(one["columns"]), one["clock"]) for one in request["wanted"]]
    try:
        reader = importlib.import_module(f"railsim.field.readers.{request['format']}")
        return _pack(reader.read(Path(request["path"]), wanted))
    except InputError as error:
        return {"error": str(error)}, []
    except DAMAGE as error:
        return {"damaged": f"{type(error).__name__}: {error}"}, []


def _keep_inside(folder: str) -> Callable[[str, tuple[Any, ...]], None]:
    """A hook that lets Python code write in `folder` only, whatever a file makes a library do."""

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            path, mode, flags = arguments
            writes = (
                bool(flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)) if mode is None else bool(set(mode) & set("wax+"))
            )
            changed = [path] if writes and isinstance(path, str | bytes | os.PathLike) else []
        else:
            changed = [one for one in arguments[:2] if isinstance(one, str | bytes)] if event in _CHANGES else []
        if event in _FORBIDDEN or any(not os.path.abspath(os.fsdecode(one)).startswith(folder) for one in changed):
            raise PermissionError(f"{event} is not allowed while a file is read")

    return hook


def _limit(memory: int) -> None:
    """Let this process have `memory` bytes more than it has now, and write no larger file."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (memory, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + memory, hard))


def _pack(tables: list[Table]) -> tuple[dict[str, Any], list[np.ndarray]]:
    arrays: list[np.ndarray] = []
    heads = []
    for table in tables:
        columns = []
        for column in table.columns.values():
            head: dict[str, Any] = {"name": column.name, "unit": column.unit, "instants": column.instants}
            head["duration"] = column.duration
            if isinstance(column.values, list):
                head["texts"] = column.values
            else:
                head["count"] = column.values.size
                arrays.append(column.values)
            columns.append(head)
        clock = None if table.clock is None else table.clock.size
        if table.clock is not None:
            arrays.append(table.clock)
        heads.append(
            {
                "columns": columns,
                "clock": clock,
                "start": table.start,
                "cut_short": table.cut_short,
                "local": table.local,
                "told": table.told,
            }
        )
    return {"tables": heads}, arrays


def _send(answers: BinaryIO, head: dict[str, Any], arrays: list[np.ndarray]) -> None:
    answers.write(json.dumps(head).encode() + b"\n")
    for array in arrays:
        answers.write(np.ascontiguousarray(array, dtype=np.float64).tobytes())
    answers.flush()


if __name__ == "__main__":
    main()
