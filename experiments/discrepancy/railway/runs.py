"""Many runs of the model at once, kept in memory; a run that fails is None."""

import ctypes
import os
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from railsim.dynamics.chunks import rows_of
from railsim.dynamics.integrate import RUNGE_KUTTA
from railsim.engines.interface import Diverged, Run
from railsim.errors import InputError
from railsim.lanes.buffers import Buffers
from railsim.lanes.fleet import Job, Piece, advance, kept_channels, prepare
from railsim.lanes.machine import LANES
from railsim.lanes.threads import in_threads
from railsim.truth import HeldTruth

THREADS = min(2, os.cpu_count() or 1)
REMEMBERED = 8  # of what the last runs told
FEW = 3  # runs of one structure up to which one after another takes less time than side by side

one_thread_each = threadpool_limits.wrap(limits=1, user_api="blas")
"""Decorates what makes runs in threads: linear algebra in threads of its own would wait for these in a loop."""

K = TypeVar("K")
T = TypeVar("T")

Done = tuple[int, HeldTruth | None]
"""A run's place, and its truth; None where it failed."""


def run_all(runs: Sequence[Run], about: dict[str, object], channels: Sequence[str] | None) -> Iterator[Done]:
    """Places of the runs and their truths as they are done, with at least these channels (None = all); a truth that is
    not kept leaves its memory to the next.
    """
    groups: dict[tuple[bytes, float, int], list[Job]] = {}
    for number, run in enumerate(runs):
        try:
            job = prepare(number, run)
        except InputError:
            yield number, None
            continue
        groups.setdefault(job.group, []).append(job)
    sets: list[list[Job]] = []
    for group in groups.values():
        size = 1 if len(group) <= FEW or group[0].refused else LANES
        sets += [group[first : first + size] for first in range(0, len(group), size)]
    buffers = Buffers()
    sets.sort(key=lambda one: -sum(job.run.rows * job.run.substeps for job in one))
    yield from in_threads([partial(_truths, one, about, channels, buffers) for one in sets], THREADS)


def _truths(
    jobs: Sequence[Job], about: dict[str, object], channels: Sequence[str] | None, buffers: Buffers
) -> Iterator[Done]:
    """Of one run, or of a set of lanes."""
    if len(jobs) == 1:
        yield jobs[0].number, _alone(jobs[0], about, channels)
        return
    for result in advance(jobs, buffers=buffers, channels=channels):
        job, rows = (result.job, result.rows) if isinstance(result, Piece) else result
        if isinstance(rows, Diverged):
            yield job.number, None
        else:
            yield job.number, HeldTruth(rows.T.copy(), job.run.rate, kept_channels(job, channels), about)


def _alone(job: Job, about: dict[str, object], channels: Sequence[str] | None) -> HeldTruth | None:
    names = kept_channels(job, channels)
    places = [job.names.index(name) for name in names]
    try:
        rows = np.concatenate([rows[:, places] for rows in rows_of(job.run, job.plant, RUNGE_KUTTA, job.run.substeps)])
    except Diverged:
        return None
    return HeldTruth(rows.T.copy(), job.run.rate, names, about)


def remembered(last: dict[K, T], key: K, make: Callable[[], T]) -> T:
    """What was made for a key; `last` holds the last few."""
    if key in last:
        return last[key]
    found = make()
    for old in list(last)[: len(last) + 1 - REMEMBERED]:
        last.pop(old, None)
    last[key] = found
    return found


def give_back() -> None:
    """Return free memory to the system, where the C library can: arrays of some megabytes leave holes that it keeps."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
