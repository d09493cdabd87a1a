"""A task: one simulated run with all that is made of it. It runs wherever the package is installed."""

import hashlib
import os
import shutil
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from estimators.interface import Estimator
from experiments.reporting.failures import PluginError, plugin_code
from experiments.runs.estimation import estimated
from experiments.scoring.score import score_rows, scores_and_problems, unscored
from experiments.sweep.settings import SensorSet, Variant
from experiments.sweep.truths import Wanted, truths
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.plugins import more_plugins
from railsim.scenario import Scenario, digest_of
from railsim.scratch import scratch_folder
from railsim.simulation import measure, run_digest
from railsim.track.files import TRACKS, read_track
from railsim.truth import TIME, HeldTruth, Truth

OK, FAILED, UNFIT = "ok", "failed", "does not fit"
Row = list[Any]
"""point, place of the sensor set, place of the variant, seed, recording, score, unit, value, status, message."""


@dataclass(frozen=True)
class PointTask:
    """A design point: the scenario as plain values, the settings that it changes by label of estimator, and the places
    of the sensor sets that stand there.
    """

    number: int
    scenario: dict[str, Any]
    changes: dict[str, dict[str, Any]]
    sets: tuple[int, ...]


@dataclass(frozen=True)
class Task:
    """All points that share one simulated run.

    Attributes
    ----------
    number : place in the sweep. run : digest of the simulated run. track : name and text of a track that is not
    found by its name, so that a worker need not have the file. plugins : folders of plug-ins, which it must have.
    """

    number: int
    run: str
    engine: str
    points: tuple[PointTask, ...]
    variants: tuple[Variant, ...]
    sets: tuple[SensorSet, ...]
    seeds: tuple[int, ...]
    track: tuple[str, str] | None = None
    plugins: tuple[str, ...] = ()

    def digest(self) -> str:
        """SHA-256 over everything that shapes the result."""
        points = [[point.number, point.scenario, point.changes, point.sets] for point in self.points]
        variants = [[one.label, one.name, one.settings] for one in self.variants]
        sets = [[one.name, one.patterns, one.cost] for one in self.sets]
        return digest_of([self.run, self.engine, points, variants, sets, self.seeds, self.track])


class VersionError(RuntimeError):
    """A worker's program or libraries are not those of the process that planned the sweep."""


def perform(task: Task, scratch: str | None, keep_truth: bool) -> dict[str, Any]:
    """Do one task: see `perform_group`."""
    return perform_group([task], scratch, keep_truth)[0]


def perform_group(tasks: Sequence[Task], scratch: str | None, keep_truth: bool) -> list[dict[str, Any]]:
    """Simulate, measure, estimate, score, with the tasks' plug-ins; what fails becomes a row.

    The runs of a group are asked for at once; what is made of each does not depend on the others.

    Returns
    -------
    By task "rows" (see `Row`), and facts that are not part of the table: times, processor time, memory, tracebacks by
    message of plug-ins that failed.

    Raises
    ------
    VersionError : this process would not make the run that was planned.
    InputError, OSError, MemoryError : of this machine (a full disk, for example), which ends the sweep.
    """
    with more_plugins(tasks[0].plugins), scratch_folder("railsim-sweep", scratch) as aside:
        return list(_results(tasks, aside, keep_truth))


def _results(tasks: Sequence[Task], aside: Path, keep_truth: bool) -> Iterator[dict[str, Any]]:
    began, used = time.time(), time.process_time()
    scenarios, wanted = [], []
    for task in tasks:
        place = aside / str(task.number)
        place.mkdir()
        scenarios.append([(point, _scenario(task, point, place)) for point in task.points])
        first = scenarios[-1][0][1]
        if run_digest(first, task.engine) != task.run:
            raise VersionError("a worker has another version of railsim, numba, numpy or scipy; install the same")
        wanted.append(Wanted(first, task.engine, task.run, place))
    for task, points, truth, run in zip(tasks, scenarios, truths(wanted, keep_truth), wanted, strict=True):
        simulated, tracebacks = 0.0, {}
        if isinstance(truth, Truth):
            maker = _Maker(task, truth)
            rows, tracebacks, simulated = maker.rows(points), maker.tracebacks, truth.duration
        else:
            rows = failed_rows(task, _failure(truth, tracebacks))
        for row in rows:
            row[-1] = row[-1].replace(f"{run.aside}/", "")  # a line must not depend on where it was written
        shutil.rmtree(run.aside, ignore_errors=True)
        facts: dict[str, Any] = {"tracebacks": tracebacks} if tracebacks else {}
        facts |= {"simulated": simulated, "began": began, "ended": time.time(), "cpu": time.process_time() - used}
        yield {"rows": rows, **facts, "worker": _worker(), "rss": resident_bytes()}
        began, used = time.time(), time.process_time()


def failed_rows(task: Task, message: str) -> list[Row]:
    """The rows of a task whose run could not be simulated."""
    return [
        [point.number, at, which, seed, None, None, None, None, FAILED, message]
        for point in task.points
        for at in point.sets
        for which in range(len(task.variants))
        for seed in task.seeds
    ]


def restrict(measured: Measurements, wanted: SensorSet) -> Measurements:
    """The recording as a vehicle with these sensors only would have made it; raises `InputError` where none is left."""
    names = [name for name in measured.channels if wanted.has(name)]
    if len(names) == len(measured.channels):
        return measured
    tables: dict[float, dict[str, np.ndarray]] = {}
    for name in names:
        table = tables.setdefault(measured.rate(name), {TIME: measured.time(name)})
        table[name] = measured[name]
    sheets = [
        {**sheet, "channels": [name for name in sheet["channels"] if name in names]}
        for sheet in measured.about["sensors"]
    ]
    about = {**measured.about, "sensors": [sheet for sheet in sheets if sheet["channels"]]}
    return Measurements(about, tables, measured.track)


def recording_digest(measured: Measurements) -> str:
    """SHA-256 over every sample of every channel and the track as measured."""
    total = hashlib.sha256()
    for name in measured.channels:
        total.update(f"{name}\0{measured.rate(name)!r}\0".encode())
        total.update(np.ascontiguousarray(measured[name], "<f8").tobytes())
    if measured.track is not None:
        for name, column in measured.track.items():
            total.update(f"track {name}\0".encode() + np.ascontiguousarray(column, "<f8").tobytes())
    return total.hexdigest()


def resident_bytes() -> int:
    """Memory of this process that is in use [bytes]; 0 where the system does not tell."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return 0


class _InMemory(Truth):
    """A truth that keeps the columns it has read: every seed reads the same."""

    def __init__(self, truth: Truth) -> None:
        super().__init__(truth.folder, truth.rate, len(truth), truth.columns, truth.about)
        self._kept: dict[str, np.ndarray] = {}

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._kept:
            column = super().__getitem__(name)
            column.setflags(write=False)
            self._kept[name] = column
        return self._kept[name]


class _Maker:
    """Makes the rows of a task from its truth; equal recordings and equal estimates are made once."""

    def __init__(self, task: Task, truth: Truth) -> None:
        self._task = task
        self._truth = truth if isinstance(truth, HeldTruth) else _InMemory(truth)
        self._scores: dict[str, Any] = {}
        self.tracebacks: dict[str, str] = {}

    def rows(self, points: list[tuple[PointTask, Scenario]]) -> list[Row]:
        """In the order of points, sensor sets, variants, seeds, scores."""
        by_case: dict[tuple[int, int, int, int], list[Row]] = {}
        for point, scenario in points:
            for seed in self._task.seeds:
                for (at, which), rows in self._of_recording(point, scenario, seed):
                    by_case[point.number, at, which, seed] = rows
        places = {seed: place for place, seed in enumerate(self._task.seeds)}
        ordered = sorted(by_case, key=lambda key: (*key[:3], places[key[3]]))
        return [[*key, *row] for key in ordered for row in by_case[key]]

    def _of_recording(
        self, point: PointTask, scenario: Scenario, seed: int
    ) -> Iterator[tuple[tuple[int, int], list[Row]]]:
        count = len(self._task.variants)
        try:
            with plugin_code("the measurement"):
                whole = measure(self._truth, scenario, seed).measurements
        except (InputError, PluginError) as error:
            for at in point.sets:
                yield from (((at, which), [self._failed(None, error)]) for which in range(count))
            return
        for at in point.sets:
            try:
                measured = restrict(whole, self._task.sets[at])
            except InputError as error:
                yield from (((at, which), [self._failed(None, error, UNFIT)]) for which in range(count))
                continue
            digest = recording_digest(measured)
            for which, variant in enumerate(self._task.variants):
                yield (at, which), self._of_variant(measured, digest, variant, point.changes.get(variant.label, {}))

    def _of_variant(self, measured: Measurements, digest: str, variant: Variant, changes: dict[str, Any]) -> list[Row]:
        estimator = variant.build(changes)
        key = digest_of([digest, measured.about["sensors"], estimator.name, estimator.model_dump(mode="json")])
        if key not in self._scores:
            self._scores[key] = self._estimated(estimator, measured, digest)
        return self._scores[key]

    def _estimated(self, estimator: Estimator, measured: Measurements, digest: str) -> list[Row]:
        try:
            with plugin_code(estimator.name, estimator):
                fits = estimator.fits(measured)
            if not fits:
                return [[digest, None, None, None, UNFIT, why_unfit(estimator, measured)]]
            estimate = estimated(estimator, measured)
        except (InputError, PluginError) as error:
            return [self._failed(digest, error)]
        scores, problems = scores_and_problems(estimate, self._truth)
        failed = [self._failed(digest, problem) for problem in problems.values()]
        if not scores:
            return failed or [[digest, None, None, None, OK, unscored(estimate)]]
        return [
            [digest, row["score"], row["unit"], float(row["value"]) if np.isfinite(row["value"]) else None, OK, ""]
            for row in score_rows(estimator.name, scores)
        ] + failed

    def _failed(self, digest: str | None, error: InputError | PluginError, status: str = FAILED) -> Row:
        return [digest, None, None, None, status, _failure(error, self.tracebacks)]


def why_unfit(estimator: Estimator, measured: Measurements) -> str:
    """The line in which an estimator names what it lacks."""
    try:
        estimator.need(measured)
    except InputError as error:
        return _message(error)
    return f"{estimator.name} does not fit these channels"


def _scenario(task: Task, point: PointTask, aside: Path) -> Scenario:
    values = point.scenario
    if task.track is not None:
        name, text = task.track
        path = aside / name
        if not path.exists():
            path.write_text(text, encoding="utf-8", newline="\n")
        values = {**values, "track": str(path)}
    return Scenario.build(values)


def track_text(scenario: Scenario) -> tuple[str, str] | None:
    """Name and text of the scenario's track file; None for one that is found by its name."""
    if scenario.track in TRACKS.paths():
        return None
    read_track(scenario.track)
    path = Path(scenario.track)
    return path.name, path.read_text(encoding="utf-8-sig")


def _failure(error: InputError | PluginError, tracebacks: dict[str, str]) -> str:
    """The line of a failure; the traceback of a plug-in's goes to `tracebacks`.

    What speaks of this machine (a full disk), not of the run, is raised again.
    """
    if isinstance(error.__context__, OSError) and not isinstance(error, PluginError):
        raise error
    message = _message(error)
    if isinstance(error, PluginError):
        tracebacks.setdefault(message, error.details)
    return message


def _message(error: Exception) -> str:
    return " ".join(str(error).split())


def _worker() -> str:
    return f"{os.uname().nodename}:{os.getpid()}"
