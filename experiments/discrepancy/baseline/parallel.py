"""A few threads: the compiled kernels release the interpreter's lock."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

A = TypeVar("A")
B = TypeVar("B")
MOST = 2


def in_parallel(function: Callable[[A], B], items: Iterable[A]) -> list[B]:
    """`function` of every item, in order."""
    with ThreadPoolExecutor(min(MOST, len(os.sched_getaffinity(0)))) as pool:
        return list(pool.map(function, items))
