"""One call of a command in a process of its own, and whether it ended as it owes its user."""

import os
import resource
import signal
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from experiments.sweep.task import resident_bytes

LONGEST = 30.0  # s of a processor
PATIENCE = 4.0  # times as long by the clock, as other work may hold the processors
MOST_MEMORY = 2 * 1024**3  # bytes
LONGEST_LINE = 1600  # characters of a message
UNFORESEEN = 3
_LOOK = 0.005  # s between two looks whether it has ended


@dataclass(frozen=True)
class Attempt:
    """What is done to a command.

    Attributes
    ----------
    work : the call; what it returns is the exit code.
    said : file that takes what it prints.
    stop : (s, signal) after which it is stopped; None lets it end.
    largest : bytes beyond which no file can be written, as on a full disk; None is no limit.
    environment : variables for this call. user : number of the user that it runs as; None is the same.
    longest : s of a processor that it may take.
    """

    work: Callable[[], int]
    said: Path
    stop: tuple[float, signal.Signals] | None = None
    largest: int | None = None
    environment: Mapping[str, str] = field(default_factory=dict)
    user: int | None = None
    longest: float = LONGEST


@dataclass(frozen=True)
class Ending:
    """How a call ended: exit code (negative: the signal), s by the clock and of a processor, bytes beyond those of the
    process that made it, what it printed.
    """

    code: int
    seconds: float
    processor: float
    memory: int
    text: str
    longest: float = LONGEST

    @property
    def faults(self) -> tuple[str, ...]:
        """What it owes its user and did not keep; empty where all is well."""
        lines = [line for line in self.text.splitlines() if line.startswith("railsim: ")]
        checks = {
            "traceback": "Traceback (most recent call last)" in self.text,
            "unforeseen error": self.code == UNFORESEEN,
            "ended by a signal": self.code < 0 and -self.code not in (signal.SIGKILL, signal.SIGTERM),
            "hang": self.processor > self.longest or self.seconds > PATIENCE * self.longest,
            "memory": self.memory > MOST_MEMORY,
            "no reason given": self.code == 2 and not lines,
            "long line": any(len(line) > LONGEST_LINE for line in lines),
            "control characters": any(not letter.isprintable() for line in lines for letter in line if letter != "\t"),
        }
        return tuple(name for name, wrong in checks.items() if wrong)


def ended(attempt: Attempt) -> Ending:
    """Make the call in a fork of this process, which has all modules loaded, and wait for its end."""
    sys.stdout.flush()
    sys.stderr.flush()
    began, before = time.monotonic(), resident_bytes()
    child = os.fork()
    if not child:
        _perform(attempt)
    status, usage = _waited(child, attempt, began)
    seconds = time.monotonic() - began
    text = attempt.said.read_text(encoding="utf-8", errors="replace") if attempt.said.exists() else ""
    processor = usage.ru_utime + usage.ru_stime
    code = os.waitstatus_to_exitcode(status)
    memory = max(0, usage.ru_maxrss * 1024 - before)
    return Ending(code, seconds, processor, memory, text, attempt.longest)


def _waited(child: int, attempt: Attempt, began: float) -> tuple[int, resource.struct_rusage]:
    stop = attempt.stop
    while True:
        done, status, usage = os.wait4(child, os.WNOHANG)
        if done:
            return status, usage
        past = time.monotonic() - began
        if stop is not None and past > stop[0]:
            with suppress(ProcessLookupError):
                os.kill(child, stop[1])
            stop = None
        if past > 1.1 * PATIENCE * attempt.longest:
            os.kill(child, signal.SIGKILL)
        time.sleep(_LOOK)


def _perform(attempt: Attempt) -> None:
    """The child's part; never returns."""
    code = 1
    try:
        os.setpgid(0, 0)
        out = os.open(attempt.said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
        os.dup2(out, 1)
        os.dup2(out, 2)
        sys.stdout, sys.stderr = (os.fdopen(number, "w", buffering=1) for number in (1, 2))
        os.environ |= attempt.environment
        if attempt.largest is not None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (attempt.largest, attempt.largest))
        if attempt.user is not None:
            os.setuid(attempt.user)
        code = attempt.work()
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else 1
    except BaseException:  # noqa: BLE001 - whatever it is stands in the report
        traceback.print_exc()
    finally:
        with suppress(OSError, ValueError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code & 0xFF)
