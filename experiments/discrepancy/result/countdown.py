"""Countdown: progress on stderr with the stage, the time gone and, from the last run on this machine, the time left."""

import json
import re
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from experiments.reporting.logs import tell
from railsim.cache import cache_folder

STAGES = ("registration", "derivatives", "nuisances", "signatures", "fits", "further effects", "last run")
_BEGINS = (
    ("derivatives", re.compile(r"derivatives of|registered")),
    ("nuisances", re.compile(r"fitted nuisances")),
    ("signatures", re.compile(r"\d+ of \d+ cells|signatures of")),
    ("fits", re.compile(r".*: [+-][\d.]+ nats|fitted (?!nuisances)")),
    ("further effects", re.compile(r"something is left|which of \d+ further sensors")),
    ("last run", re.compile(r"last run by")),
)
_COUNTED = re.compile(r"\((\d+) of (\d+)\)$")
FILE = "discrepancy_times.json"


class Countdown:
    """Says each line of the workflow with its stage; stages are known by what is said, and never go back.

    Parameters
    ----------
    duration : s, of the recording; times are kept per second of it. clock, say : for tests.
    """

    def __init__(
        self,
        duration: float = 1.0,
        clock: Callable[[], float] = time.monotonic,
        say: Callable[[str], None] = tell,
        folder: Path | None = None,
    ) -> None:
        self._clock, self._say = clock, say
        self._duration = duration
        self._path = (folder or cache_folder().parent) / FILE
        self._begun = clock()
        self._stage, self._since = 0, self._begun
        self._spent: dict[str, float] = {}
        self._usual = self._read()

    def __call__(self, text: str) -> None:
        """Say a line."""
        number = max((STAGES.index(name) for name, begins in _BEGINS if begins.match(text)), default=0)
        if number > self._stage:
            self._close(number)
        left = self._left(text)
        gone = self._clock() - self._begun
        about = f", about {left:.0f} s left" if left is not None else ""
        self._say(f"{gone:6.1f} s  {self._stage + 1}/{len(STAGES)} {STAGES[self._stage]}{about}: {text}")

    def finish(self) -> None:
        """Keep how long each stage took, for the next run."""
        self._close(self._stage)
        with suppress(OSError):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._path.write_text(json.dumps({n: s / self._duration for n, s in self._spent.items()}))

    def _close(self, following: int) -> None:
        now = self._clock()
        name = STAGES[self._stage]
        self._spent[name] = self._spent.get(name, 0.0) + now - self._since
        self._stage, self._since = following, now

    def _left(self, text: str) -> float | None:
        """Of this stage by its own count where it counts, else by the last run; of later ones by the last run."""
        later = [self._usual.get(name) for name in STAGES[self._stage + 1 :]]
        rest = self._duration * sum(one for one in later if one is not None)
        here = self._clock() - self._since
        counted = _COUNTED.search(text)
        if counted and int(counted[1]) > 1:
            done, count = int(counted[1]) - 1, int(counted[2])
            return here / done * (count - done) + rest
        usual = self._usual.get(STAGES[self._stage])
        return None if usual is None else max(0.0, self._duration * usual - here) + rest

    def _read(self) -> dict[str, float]:
        with suppress(OSError, ValueError):
            found = json.loads(self._path.read_text())
            return {name: float(found[name]) for name in STAGES if isinstance(found.get(name), int | float)}
        return {}
