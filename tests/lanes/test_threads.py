"""Iterators in threads: all that they give comes, an error comes too, and whoever stops early is not kept waiting."""

import threading
from collections.abc import Iterator
from functools import partial

import pytest

from railsim.lanes.threads import WAITING, in_threads


def count(first: int, many: int) -> Iterator[int]:
    yield from range(first, first + many)


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_all_that_the_tasks_give_comes_once(threads: int) -> None:
    tasks = [partial(count, 100 * number, 3 * WAITING) for number in range(4)]
    assert sorted(in_threads(tasks, threads)) == sorted(one for task in tasks for one in task())
    assert list(in_threads([], threads)) == []


def test_tasks_go_on_at_the_same_time() -> None:
    meet = threading.Barrier(2, timeout=20.0)

    def wait() -> Iterator[int]:
        yield meet.wait()

    assert sorted(in_threads([wait, wait], 2)) == [0, 1]


def test_an_error_comes_after_what_the_others_give() -> None:
    def fail() -> Iterator[int]:
        yield 1
        raise ValueError("a wheel fell off")

    found = []
    with pytest.raises(ValueError, match="a wheel fell off"):
        for one in in_threads([fail, partial(count, 10, 3)], 2):
            found.append(one)
    assert sorted(found) == [1, 10, 11, 12]


def test_whoever_stops_early_leaves_no_thread() -> None:
    before = threading.active_count()
    results = in_threads([partial(count, 0, 100 * WAITING), partial(count, 0, 100 * WAITING)], 2)
    assert next(results) == 0
    results.close()  # type: ignore[attr-defined]
    assert threading.active_count() == before
