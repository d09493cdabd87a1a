"""Tasks side by side: what they ask for at a time is run together, for many runs in lanes cost little more than one.

Every task has a thread of its own. A task that asks for runs waits until all others ask as well, or are done.
"""

import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

from experiments.discrepancy.railway.runs import give_back
from railsim.engines.interface import Run
from railsim.truth import HeldTruth

T = TypeVar("T")
Visit = Callable[[int, HeldTruth | None], None]


@dataclass(eq=False)
class _Request:
    """Runs that a task waits for."""

    task: int
    runs: Sequence[Run]
    visit: Visit
    done: bool = False
    error: BaseException | None = None


class Together:
    """A place where tasks ask for runs; `run_all` gives places and truths of runs as they are done, or None.

    most : tasks at a time; each holds slopes and covariances of its own.
    """

    def __init__(self, run_all: Callable[[Sequence[Run]], Iterator[tuple[int, HeldTruth | None]]], most: int) -> None:
        self._run_all, self._most = run_all, most
        self._turn, self._own = threading.Condition(), threading.local()
        self._waiting: list[_Request] = []
        self._alive = 0

    def ask(self, runs: Sequence[Run], visit: Visit) -> None:
        """`visit` is told each run's place and truth, None where it failed; a truth leaves its memory to the next."""
        task = getattr(self._own, "task", None)
        request = _Request(-1 if task is None else task, runs, visit)
        if task is None:
            self._serve([request])
        else:
            with self._turn:
                self._waiting.append(request)
                self._serve_if_all_wait()
                self._turn.wait_for(lambda: request.done)
        if request.error is not None:
            raise request.error

    def all_of(self, tasks: Sequence[Callable[[], T]]) -> list[T]:
        """Results of tasks, in their order.

        Raises
        ------
        Exception : what the first task that failed raised.
        """
        if len(tasks) < 2 or hasattr(self._own, "task"):
            return [task() for task in tasks]
        found: dict[int, T] = {}
        errors: dict[int, BaseException] = {}
        left = list(enumerate(tasks))[::-1]
        threads = [threading.Thread(target=self._work, args=(left, found, errors), daemon=True)
                   for _ in range(min(self._most, len(tasks)))]  # fmt: skip
        self._alive = len(threads)
        for one in threads:
            one.start()
        for one in threads:
            one.join()
        give_back()
        if errors:
            raise errors[min(errors)]
        return [found[number] for number in range(len(tasks))]

    def _work(
        self, left: list[tuple[int, Callable[[], T]]], found: dict[int, T], errors: dict[int, BaseException]
    ) -> None:
        while True:
            with self._turn:
                if not left or errors:
                    self._alive -= 1
                    self._serve_if_all_wait()
                    return
                number, task = left.pop()
            self._own.task = number
            try:
                found[number] = task()
            except BaseException as error:  # noqa: BLE001
                errors[number] = error

    def _serve_if_all_wait(self) -> None:
        if self._waiting and len(self._waiting) == self._alive:
            waiting = sorted(self._waiting, key=lambda one: one.task)
            self._waiting.clear()
            self._serve(waiting)
            self._turn.notify_all()

    def _serve(self, requests: Sequence[_Request]) -> None:
        owners = [(one, place) for one in requests for place in range(len(one.runs))]
        try:
            for number, truth in self._run_all([run for one in requests for run in one.runs]):
                one, place = owners[number]
                one.visit(place, truth)
        except BaseException as error:  # noqa: BLE001
            for one in requests:
                one.error = error
        for one in requests:
            one.done = True
