"""Reads binary files in a process of its own, with limits on time and memory: damage can neither hang nor crash us."""

import json
import os
import selectors
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self

import numpy as np

from railsim.errors import InputError
from railsim.field.readers.interface import Wanted
from railsim.field.tables import Column, Table
from railsim.parquet import MEMORY, MEMORY_A_BYTE
from railsim.scratch import scratch_folder

SECONDS = (
    30.0  # s of its own, to start and to read a small file: at work or asleep, not waiting for a processor or disk
)
PATIENCE = 20.0  # times as long by the clock, after which it is ended whatever it waits for
_LOOK = 0.1  # s from one look at the process to the next
BYTES_A_SECOND = 2e6  # slowest reading that is waited for
_LONGEST_LINE = 200_000_000
_ALLOCATORS = {"ARROW_DEFAULT_MEMORY_POOL": "system", "MALLOC_ARENA_MAX": "1"}
"""Others reserve gigabytes of addresses that they do not use, which count against the limit."""


class Guard:
    """A reading process, started when it is first needed and ended by `close` or at the end of a `with`.

    Parameters
    ----------
    seconds : s that a small file may take, see `Answer`.
    memory : bytes that a small file may take.
    """

    def __init__(self, seconds: float = SECONDS, memory: int = MEMORY) -> None:
        self._seconds = seconds
        self._memory = memory
        self._process: subprocess.Popen[bytes] | None = None
        self._left = ExitStack()

    def __enter__(self) -> Self:
        """The guard itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process."""
        self.close()

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._process is not None and self._process.poll() is None

    def close(self) -> None:
        """End the process and remove what its libraries left."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None
        self._left.close()

    def read(self, kind: str, path: Path, wanted: list[Wanted]) -> list[Table]:
        """Columns of a file.

        Raises
        ------
        InputError : what the reader says; the file is damaged, takes too long or too much memory.
        """
        size = path.stat().st_size
        request = {
            "format": kind,
            "path": str(path.resolve()),
            "memory": int(self._memory + MEMORY_A_BYTE * size),
            "wanted": [{"group": w.group, "columns": w.columns, "clock": w.clock} for w in wanted],
        }
        process = self._started()
        answer = Answer(process, self._seconds + size / BYTES_A_SECOND)
        try:
            assert process.stdin is not None
            process.stdin.write(json.dumps(request).encode() + b"\n")
            process.stdin.flush()
            head = json.loads(answer.line())
            if "tables" in head:
                return [_unpack(table, answer) for table in head["tables"]]
        except TimeoutError:
            self.close()
            raise InputError(
                f"'{path}': no end of reading after {self._seconds + size / BYTES_A_SECOND:.0f} s; "
                f"the {kind} file is damaged, copy it again"
            ) from None
        except (OSError, EOFError, ValueError):
            self.close()
            raise InputError(f"'{path}' is damaged: it stops the {kind} reader; copy it again") from None
        if "error" in head:
            raise InputError(f"'{path}': {head['error']}")
        reason = " ".join(str(head.get("damaged")).split())[:120]
        raise InputError(f"'{path}' is not a whole {kind} file ({reason}); copy it again")

    def _started(self) -> subprocess.Popen[bytes]:
        if not self.alive:
            self.close()
            folder = str(self._left.enter_context(scratch_folder("railsim-reading")))
            root = str(Path(__file__).parents[2])
            paths = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
            settings = {**os.environ, "PYTHONPATH": paths, "TMPDIR": folder, "HOME": folder}
            settings |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", **_ALLOCATORS}
            self._process = subprocess.Popen(
                [sys.executable, "-m", "railsim.field.worker"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                cwd=folder,
                env=settings,
            )
        assert self._process is not None
        return self._process


class Answer:
    """Bytes from the process for as long as it has time left.

    Its time is what it spends on a processor and what it sleeps through with nothing to do. Other load on the machine
    makes neither longer: a process that waits for a processor or for the disk does not sleep.
    """

    def __init__(self, process: subprocess.Popen[bytes], seconds: float) -> None:
        assert process.stdout is not None
        self._handle = process.stdout.fileno()
        self._tasks = Path(f"/proc/{process.pid}/task")
        self._held = bytearray()
        self._left = seconds
        self._deadline = time.monotonic() + PATIENCE * seconds
        self._worked, _ = _threads(self._tasks)

    def line(self) -> bytes:
        while (end := self._held.find(b"\n")) < 0:
            if len(self._held) > _LONGEST_LINE:
                raise ValueError("line too long")
            self._more(1 << 16)
        line = bytes(self._held[:end])
        del self._held[: end + 1]
        return line

    def numbers(self, count: int) -> np.ndarray:
        chunks, due = [bytes(self._held[: 8 * count])], 8 * count
        del self._held[: 8 * count]
        due -= len(chunks[0])
        while due > 0:
            chunks.append(self._read(min(due, 1 << 20)))
            due -= len(chunks[-1])
        return np.frombuffer(bytearray(b"".join(chunks)), dtype=np.float64)

    def _more(self, most: int) -> None:
        self._held += self._read(most)

    def _read(self, most: int) -> bytes:
        with selectors.DefaultSelector() as selector:
            selector.register(self._handle, selectors.EVENT_READ)
            began = time.monotonic()
            while not selector.select(_LOOK):
                now = time.monotonic()
                self._spend(now - began)
                if self._left < 0.0 or now > self._deadline:
                    raise TimeoutError
                began = now
        data = os.read(self._handle, most)
        if not data:
            raise EOFError
        return data

    def _spend(self, passed: float) -> None:
        """Take what the process has worked or slept during the last `passed` seconds from its time."""
        worked, asleep = _threads(self._tasks)
        self._left -= max(0.0, worked - self._worked) + (min(passed, 2 * _LOOK) if asleep else 0.0)
        self._worked = worked


def _threads(tasks: Path) -> tuple[float, bool]:
    """Processor time (s) of a process's threads, and whether all of them sleep, by proc(5)."""
    worked, asleep = 0, True
    for file in tasks.glob("*/stat"):
        try:
            words = file.read_text().rpartition(")")[2].split()
        except OSError:  # it has just ended
            continue
        worked += int(words[11]) + int(words[12])
        asleep &= words[0] == "S"
    return worked / os.sysconf("SC_CLK_TCK"), asleep


def _unpack(head: dict[str, Any], answer: Answer) -> Table:
    columns = {}
    for column in head["columns"]:
        values = column["texts"] if "texts" in column else answer.numbers(int(column["count"]))
        columns[column["name"]] = Column(
            column["name"], values, column["unit"], bool(column["instants"]), duration=bool(column["duration"])
        )
    clock = None if head["clock"] is None else answer.numbers(int(head["clock"]))
    told = tuple(str(one)[:200] for one in head["told"])
    cut_short, local = bool(head["cut_short"]), bool(head["local"])
    return Table(columns, clock, head["start"], cut_short=cut_short, local=local, told=told)
