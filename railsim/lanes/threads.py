"""Iterators that are run in threads of their own, for compiled kernels release the interpreter's lock."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from queue import Queue
from threading import Event
from typing import TypeVar

T = TypeVar("T")

WAITING = 16  # results that wait to be taken, at most


def in_threads(tasks: Sequence[Callable[[], Iterable[T]]], threads: int) -> Iterator[T]:
    """What the tasks' iterators give, as it comes; so many of them go on at once, the first ones first.

    Raises
    ------
    Exception : what a task raised, once the others have ended.
    """
    if min(threads, len(tasks)) < 2:
        for task in tasks:
            yield from task()
        return
    left, stopped, done = deque(tasks), Event(), Queue[list[T] | None](WAITING)

    def work() -> None:
        try:
            while left and not stopped.is_set():
                for one in _next(left)():
                    done.put([one])
                    if stopped.is_set():
                        return
        finally:
            done.put(None)

    working = min(threads, len(tasks))
    with ThreadPoolExecutor(working) as pool:
        futures = [pool.submit(work) for _ in range(working)]
        try:
            while working:
                found = done.get()
                if found is None:
                    working -= 1
                else:
                    yield found.pop()
        finally:
            stopped.set()
            while working:
                working -= done.get() is None
    for future in futures:
        future.result()


def _next(left: "deque[Callable[[], Iterable[T]]]") -> Callable[[], Iterable[T]]:
    """The next task, or one that gives nothing where another thread took the last."""
    try:
        return left.popleft()
    except IndexError:
        return tuple
