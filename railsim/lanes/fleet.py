"""Runs on their way through a set of lanes: each lane takes the next run as soon as its own one ends."""

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from railsim.dynamics.channels import channel_names
from railsim.dynamics.equilibrium import initial_state, state_size
from railsim.dynamics.guard import DERAILED, check_rows
from railsim.dynamics.integrate import RUNGE_KUTTA
from railsim.dynamics.plant import Plant, build_plant, check_reach
from railsim.dynamics.stability import check_start
from railsim.engines.interface import Diverged, Run
from railsim.errors import InputError
from railsim.lanes.buffers import Buffers
from railsim.lanes.machine import LANES, aligned, machine_for
from railsim.lanes.spread import spread
from railsim.lanes.structure import refused, structure_of
from railsim.lanes.threads import in_threads

BLOCK = 64  # rows between two looks at the lanes
SHIFT = "lateral_shift [m]"


@dataclass(frozen=True, eq=False)
class Job:
    """A run that is ready to begin. `number` is the caller's."""

    number: int
    run: Run
    plant: Plant
    state: np.ndarray

    @cached_property
    def names(self) -> list[str]:
        """Channels of a row of truth."""
        return channel_names(self.run.model)

    @cached_property
    def group(self) -> tuple[bytes, float, int]:
        """Runs of one group may share a set of lanes."""
        return structure_of(self.plant), self.run.rate, self.run.substeps

    @property
    def refused(self) -> str | None:
        """Why the run cannot go in a lane, or None."""
        return refused(self.plant)


def prepare(number: int, run: Run) -> Job:
    """A run with its arrays and its first state.

    Raises
    ------
    InputError : the run does not fit together, or has no state to begin with.
    """
    plant = build_plant(run.model, run.track, run.speed)
    check_reach(plant, run.model)
    state = initial_state(plant, run)
    plant.core.implicit[:] = RUNGE_KUTTA.implicit(run.step)
    check_start(plant, run, state, run.step)
    return Job(number, run, plant, state)


def kept_channels(job: Job, channels: Sequence[str] | None) -> list[str]:
    """Names of the columns of a job's rows: all, or those asked for, time and distance, and what tells whether the
    wheels are on their rails.

    Raises
    ------
    InputError : the job has no such channel.
    """
    if channels is None:
        return job.names
    if missing := set(channels) - set(job.names):
        raise InputError(f"channels: the run has no '{min(missing)}'; its truth's columns are the names to choose from")
    wanted = {*channels, *job.names[:2]}
    return [name for name in job.names if name in wanted or name.endswith(SHIFT)]


class Piece(NamedTuple):
    """Rows of a run that are done.

    job : whose. first : number of the first row. rows : (rows, channels). last : whether the run ends with them.
    """

    job: Job
    first: int
    rows: np.ndarray
    last: bool


class _Slot:
    """A lane with a run in it, and the piece that it fills."""

    def __init__(self, job: Job, longest: int, channels: int, buffers: Buffers) -> None:
        self.job, self.done, self._longest, self._channels, self._buffers = job, 0, longest, channels, buffers
        self.renew()

    def renew(self) -> None:
        """Begin the next piece."""
        self.first = self.done
        self.rows = self._buffers.take((min(self.job.run.rows - self.done, self._longest), self._channels))
        self.address = self.rows.ctypes.data

    @property
    def lacking(self) -> int:
        """Rows that the piece still lacks."""
        return self.first + len(self.rows) - self.done

    def piece(self) -> Piece:
        """What is done."""
        return Piece(self.job, self.first, self.rows, self.done == self.job.run.rows)


Result = Piece | tuple[Job, Diverged]


def advance(
    jobs: Iterable[Job],
    longest: int | None = None,
    buffers: Buffers | None = None,
    threads: int = 1,
    width: int = LANES,
    channels: Sequence[str] | None = None,
) -> Iterator[Result]:
    """Advance runs of one group, and give their pieces as they are done: whole runs, or at most `longest` rows, a
    multiple of `BLOCK`.

    A run that diverges ends with its error; the other lanes do not notice. The rows stand in memory of `buffers`. Each
    of several threads has a set of lanes of its own, `width` wide. Rows hold
    all channels, or `kept_channels` of some.
    """
    waiting = deque(jobs)
    if not waiting:
        return
    longest, buffers = longest or max(job.run.rows for job in waiting), buffers or Buffers()
    first = -(-len(waiting) // threads)
    fleets = [_Fleet(waiting, longest, buffers, first, width, channels) for _ in range(min(threads, len(waiting)))]
    yield from in_threads([fleet.advance for fleet in fleets], threads)


class _Fleet:
    """A set of lanes, and the runs that still wait for one; at first it takes at most `first` of them."""

    def __init__(
        self,
        waiting: deque[Job],
        longest: int,
        buffers: Buffers,
        first: int,
        width: int,
        channels: Sequence[str] | None,
    ) -> None:
        self._waiting, self._longest, self._buffers = waiting, longest, buffers
        one = self._one = waiting[0]
        self._machine = machine_for(one.plant, state_size(one.plant), len(one.names), width)
        self._lanes = self._machine.lanes()
        count = self._machine.layout.lanes
        self._out = aligned(BLOCK * self._machine.channels * count).reshape(BLOCK, -1)
        self._names = kept_channels(one, channels)
        self._kept = np.array([one.names.index(name) for name in self._names])
        self._watched = np.array([name.endswith(SHIFT) for name in self._names])
        self._slots: list[_Slot | None] = [None] * count
        for lane in range(count):
            self._fill(lane, self._next() if lane < first else None)

    def _next(self) -> Job | None:
        try:
            return self._waiting.popleft()
        except IndexError:
            return None

    def _fill(self, lane: int, job: Job | None) -> None:
        """Put a run into a lane; where there is none, one that nobody looks at keeps its numbers sound."""
        self._slots[lane] = None if job is None else _Slot(job, self._longest, len(self._names), self._buffers)
        kept = job or self._one
        self._lanes.fill(lane, kept.plant, kept.state)

    def advance(self) -> Iterator[Result]:
        """Until no run is left."""
        run = self._one.run
        while any(self._slots):
            self._lanes.march(BLOCK, run.substeps, run.rate, self._out)
            for lane, bad in enumerate(self._spread()):
                slot = self._slots[lane]
                if slot is None or (slot.lacking and not bad):
                    continue
                error = _error(slot, self._names) if bad else None
                piece = slot.piece()
                yield piece if error is None else (slot.job, error)
                if piece.last or error is not None:
                    self._fill(lane, self._next())
                else:
                    slot.renew()

    def _spread(self) -> np.ndarray:
        """Write the block into the pieces; whether a lane has rows that are not sound."""
        count = len(self._slots)
        places, bad = np.zeros((count, 3), dtype=np.int64), np.zeros(count, dtype=np.bool_)
        for place, slot in zip(places, self._slots, strict=True):
            if slot is not None:
                taken = min(BLOCK, slot.lacking)
                place[:] = slot.address, slot.done - slot.first, taken
                slot.done += taken
        spread(self._out, self._kept, places, self._watched, DERAILED, bad)
        return bad


def _error(slot: _Slot, names: list[str]) -> Diverged | None:
    """What is wrong with the rows of a lane, as one run says it."""
    rows = slot.rows[: slot.done - slot.first]
    try:
        check_rows(rows, len(rows), names, slot.job.run)
    except Diverged as error:
        return error
    return None
