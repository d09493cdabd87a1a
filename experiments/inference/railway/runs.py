"""Many runs of the model at once, kept in memory; a run that fails is None."""

from collections.abc import Sequence

import numpy as np

from railsim.dynamics.chunks import rows_of
from railsim.dynamics.integrate import RUNGE_KUTTA
from railsim.engines.interface import Diverged, Run
from railsim.errors import InputError
from railsim.lanes.buffers import Buffers
from railsim.lanes.fleet import Job, Piece, advance, kept_channels, prepare
from railsim.truth import HeldTruth

FEW = 3  # runs of one structure up to which one after another takes less time than side by side


def run_all(runs: Sequence[Run], about: dict[str, object], channels: Sequence[str] | None) -> list[HeldTruth | None]:
    """Truths in the order of the runs, with at least these channels (None = all)."""
    found: list[HeldTruth | None] = [None] * len(runs)
    groups: dict[tuple[bytes, float, int], list[Job]] = {}
    for number, run in enumerate(runs):
        try:
            job = prepare(number, run)
        except InputError:
            continue
        groups.setdefault(job.group, []).append(job)
    buffers = Buffers()
    for group in groups.values():
        if len(group) <= FEW or group[0].refused:
            for job in group:
                found[job.number] = _alone(job, about, channels)
            continue
        for result in advance(group, buffers=buffers, channels=channels):
            job, rows = (result.job, result.rows) if isinstance(result, Piece) else result
            if not isinstance(rows, Diverged):
                found[job.number] = HeldTruth(rows.T.copy(), job.run.rate, kept_channels(job, channels), about)
    return found


def _alone(job: Job, about: dict[str, object], channels: Sequence[str] | None) -> HeldTruth | None:
    names = kept_channels(job, channels)
    places = [job.names.index(name) for name in names]
    try:
        rows = np.concatenate([rows[:, places] for rows in rows_of(job.run, job.plant, RUNGE_KUTTA, job.run.substeps)])
    except Diverged:
        return None
    return HeldTruth(rows.T.copy(), job.run.rate, names, about)
