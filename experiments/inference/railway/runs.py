"""Many runs of the model at once, kept in memory; a run that fails is None."""

import ctypes
import os
from collections.abc import Iterator, Sequence

import numpy as np

from railsim.dynamics.chunks import rows_of
from railsim.dynamics.integrate import RUNGE_KUTTA
from railsim.engines.interface import Diverged, Run
from railsim.errors import InputError
from railsim.lanes.buffers import Buffers
from railsim.lanes.fleet import Job, Piece, advance, kept_channels, prepare
from railsim.truth import HeldTruth

THREADS = min(2, os.cpu_count() or 1)
AT_ONCE = 32  # runs of one structure whose rows are in memory
FEW = 3  # runs of one structure up to which one after another takes less time than side by side


def run_all(
    runs: Sequence[Run], about: dict[str, object], channels: Sequence[str] | None
) -> Iterator[tuple[int, HeldTruth | None]]:
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
    buffers = Buffers()
    for group in groups.values():
        if len(group) <= FEW or group[0].refused:
            yield from ((job.number, _alone(job, about, channels)) for job in group)
            continue
        for first in range(0, len(group), AT_ONCE):
            yield from _together(group[first : first + AT_ONCE], about, channels, buffers)


def _together(
    group: Sequence[Job], about: dict[str, object], channels: Sequence[str] | None, buffers: Buffers
) -> Iterator[tuple[int, HeldTruth | None]]:
    """Runs of one structure side by side."""
    for result in advance(group, buffers=buffers, threads=THREADS, channels=channels):
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


def give_back() -> None:
    """Return free memory to the system, where the C library can: arrays of some megabytes leave holes that it keeps."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
