"""simulate_many: many scenarios become truth at once, and stay in memory."""

from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from itertools import islice

import numpy as np

from railsim.dynamics.chunks import rows_of
from railsim.dynamics.integrate import RUNGE_KUTTA
from railsim.engines.interface import Diverged
from railsim.errors import InputError
from railsim.lanes.buffers import Buffers
from railsim.lanes.fleet import Job, Piece, advance, kept_channels, prepare
from railsim.lanes.machine import LANES
from railsim.room import BYTES, check_memory
from railsim.scenario import Scenario
from railsim.simulation import about_run, build_run, check_on_track
from railsim.truth import HeldTruth, Truth

ENGINE = "lanes"
BATCH = 64  # scenarios that are made ready at a time; those of one structure then share lanes


def simulate_many(
    scenarios: Iterable[Scenario], *, channels: Sequence[str] | None = None, threads: int = 1
) -> Iterator[tuple[int, Truth | InputError]]:
    """Run many scenarios by the engine `lanes`, and give each one's truth as soon as it is done.

    Runs that differ in numbers, track, speed or duration, and share bodies, elements and contacts, advance together. A
    run's truth does not depend on what runs beside.

    Parameters
    ----------
    scenarios : what to run; they are taken `BATCH` at a time.
    channels : those that are wanted of the truth (it has a few more); None keeps all. Few cost less time and memory.
    threads : sets of lanes that advance at once.

    Returns
    -------
    Pairs of the scenario's number, counted from 0, and its truth in memory, in the order in which they end; or the
    `InputError` (`Diverged`) that ended it. Memory is used again once nobody holds the truth any more.

    Raises
    ------
    InputError : a channel that a run has not; runs side by side do not fit into memory.
    """
    numbered, buffers = enumerate(scenarios), _buffers()
    while batch := dict(islice(numbered, BATCH)):
        jobs: list[Job] = []
        for number, scenario in batch.items():
            try:
                scenario.check()
                jobs.append(prepare(number, build_run(scenario)))
            except InputError as error:
                yield number, error
        for job in jobs:
            if job.refused:
                yield job.number, _truth(batch[job.number], job, _alone(job, channels), channels)
        groups: dict[tuple[bytes, float, int], list[Job]] = {}
        for job in sorted((job for job in jobs if not job.refused), key=lambda job: -job.run.rows):
            groups.setdefault(job.group, []).append(job)
        for group in groups.values():
            _check_memory(group[: LANES * threads], channels)
            for result in advance(group, buffers=buffers, threads=threads, channels=channels):
                job, rows = (result.job, result.rows) if isinstance(result, Piece) else result
                yield job.number, _truth(batch[job.number], job, rows, channels)


@cache
def _buffers() -> Buffers:
    """Memory of this process."""
    return Buffers()


def _check_memory(beside: Sequence[Job], channels: Sequence[str] | None) -> None:
    """Raise `InputError` where the rows of runs that advance at once do not fit into memory."""
    needed = sum(float(BYTES) * job.run.rows * len(kept_channels(job, channels)) for job in beside)
    check_memory(needed, f"a set of {len(beside)} runs side by side", "shorten duration, or ask for fewer channels")


def _alone(job: Job, channels: Sequence[str] | None) -> np.ndarray | Diverged:
    """Rows of a run that no lane can take."""
    places = [job.names.index(name) for name in kept_channels(job, channels)]
    try:
        chunks = rows_of(job.run, job.plant, RUNGE_KUTTA, job.run.substeps)
        return np.concatenate([rows[:, places] for rows in chunks])
    except Diverged as error:
        return error


def _truth(
    scenario: Scenario, job: Job, rows: np.ndarray | Diverged, channels: Sequence[str] | None
) -> Truth | InputError:
    if isinstance(rows, Diverged):
        return rows
    try:
        check_on_track(rows, scenario)
    except InputError as error:
        return error
    return HeldTruth(rows.T, job.run.rate, kept_channels(job, channels), about_run(scenario, job.run, ENGINE))
