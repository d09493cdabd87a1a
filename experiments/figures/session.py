"""Many figures in one go: on all cores, kept as they are finished, with the time that is left."""

import os
import resource
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

from joblib.externals.loky import ProcessPoolExecutor

from experiments.figures import costs
from experiments.figures.interface import FIGURES, publish, try_folder
from experiments.figures.kept import Kept, inputs_digest
from experiments.reporting.logs import tell
from experiments.reporting.size import Size
from experiments.sweep.executors import THREADS, begin_worker
from experiments.sweep.run import Interrupted
from railsim.errors import InputError

LOOK = 60.0  # s between two lines where no figure ends

Say = Callable[[str], None]


def publish_all(names: Sequence[str], folder: Path, size: Size, jobs: int, say: Say = tell) -> dict[str, Any]:
    """Publish figures, those that are finished in the folder not again; the dearest ones first.

    Parameters
    ----------
    names : of the figures. folder : of pictures and tables. jobs : processes. say : is told how far it is.

    Returns
    -------
    What `publish` gave, by name in the order of `names`.

    Raises
    ------
    InputError : as a figure raises it, the folder cannot be written, or a process is lost. Interrupted : Ctrl-C. What
    is finished is kept.
    """
    try_folder(folder)
    kept = Kept(folder, size, inputs_digest())
    results = {name: result for name in names if (result := kept.result(name))}
    left = [name for name in names if name not in results]
    countdown = Countdown(left, costs.known(size), jobs)
    say(f"{len(names)} figures, {len(results)} finished before; {countdown.beforehand()}")
    order = sorted(left, key=countdown.cost, reverse=True)
    perform = _here if min(jobs, len(left)) == 1 else _on_processes
    try:
        perform(order, folder, size, jobs, _Ended(kept, size, results, countdown, say))
    except KeyboardInterrupt:
        raise Interrupted("interrupted; what is finished is kept: the same command goes on") from None
    return {name: results[name] for name in names}


class Countdown:
    """Time that is left, by what figures cost and how fast they were in this session.

    Parameters
    ----------
    left : names of the figures to be made. known : processor time by name, s. jobs : processes.
    clock : seconds, for tests.
    """

    def __init__(
        self, left: Sequence[str], known: Mapping[str, float], jobs: int, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._left = {name: known.get(name) for name in left}
        self._jobs, self._clock = jobs, clock
        self._began: dict[str, float] = {}
        self._due = self._took = 0.0

    def cost(self, name: str) -> float:
        """Processor time, s; infinite where nobody knows, so that such a figure begins early."""
        seconds = self._left[name]
        return float("inf") if seconds is None else seconds

    def beforehand(self) -> str:
        """What all will take, in words."""
        return f"about {_spoken(self.seconds())} on {self._jobs} processes{self._unknown()}"

    def begin(self, name: str) -> None:
        """A figure begins."""
        self._began[name] = self._clock()

    def end(self, name: str) -> float:
        """A figure has ended; returns how long it took, s."""
        took = self._clock() - self._began.pop(name)
        seconds = self._left.pop(name)
        if seconds is not None:
            self._due, self._took = self._due + seconds, self._took + took
        return took

    def seconds(self) -> float:
        """Time that is left, s: the work shared by the processes, or the longest figure where that takes longer.

        Figures without a known cost are left out.
        """
        slower = self._took / self._due if self._due else 1.0
        rest = [max(0.0, slower * cost - self._gone(name)) for name, cost in self._left.items() if cost is not None]
        return max(sum(rest) / self._jobs, max(rest, default=0.0))

    def status(self) -> str:
        """What is going on, in words."""
        running = ", ".join(f"{name} ({self._gone(name):.0f} s)" for name in self._began)
        now = f"; now {running}" if running else ""
        return f"{len(self._left)} left, about {_spoken(self.seconds())}{self._unknown()}{now}"

    def _gone(self, name: str) -> float:
        return self._clock() - self._began[name] if name in self._began else 0.0

    def _unknown(self) -> str:
        count = sum(cost is None for cost in self._left.values())
        return f" and {count} whose time is not known" if count else ""


class _Ended:
    """Takes in each figure as it ends."""

    def __init__(self, kept: Kept, size: Size, results: dict[str, Any], countdown: Countdown, say: Say) -> None:
        self._kept, self._size, self._results, self._say = kept, size, results, say
        self.countdown = countdown

    def take(self, name: str, result: dict[str, Any], seconds: float) -> None:
        """Keep its result and what it cost."""
        self._kept.keep(name, result)
        self._results[name] = result
        costs.learn(self._size, name, seconds)
        self._say(f"{name}: {self.countdown.end(name):.0f} s; {self.countdown.status()}")

    def wait(self) -> None:
        """Nothing has ended for a while."""
        self._say(self.countdown.status())


def _here(order: Sequence[str], folder: Path, size: Size, jobs: int, ended: _Ended) -> None:
    del jobs
    for name in order:
        ended.countdown.begin(name)
        ended.take(name, *made(name, folder, size))


def _on_processes(order: Sequence[str], folder: Path, size: Size, jobs: int, ended: _Ended) -> None:
    """As many figures at a time as there are processes, so that what runs is known; idle ones cost nothing."""
    waiting, running = list(reversed(order)), dict[Future[Any], str]()
    pool: Any = ProcessPoolExecutor(max_workers=jobs, initializer=begin_worker, initargs=(os.getpid(),), env=THREADS)
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                name = waiting.pop()
                running[pool.submit(made, name, folder, size)] = name
                ended.countdown.begin(name)
            done = wait(list(running), LOOK, FIRST_COMPLETED).done
            for future in done:
                ended.take(running.pop(future), *future.result())
            if not done:
                ended.wait()
    except BrokenProcessPool:
        cure = "what is finished is kept: call it again, with --jobs 1 where memory is short"
        raise InputError(f"a process of the figures was killed or ran out of memory; {cure}") from None
    finally:
        pool.shutdown(wait=True, kill_workers=bool(running))


def made(name: str, folder: Path, size: Size) -> tuple[dict[str, Any], float]:
    """A figure's result, and its processor time in seconds with that of processes it started."""
    before = _processor()
    result = publish(FIGURES.pick(name)(), folder, size)
    return result, _processor() - before


def _processor() -> float:
    used = [resource.getrusage(whose) for whose in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def _spoken(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120.0 else f"{seconds / 60.0:.0f} min"
