"""The plan of a sweep: its points, each with its scenario built and checked, gathered into tasks by simulated run."""

import hashlib
import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.sweep.design import column_values
from experiments.sweep.settings import Sweep, Variant
from experiments.sweep.task import FAILED, PointTask, Row, Task, restrict, track_text, why_unfit
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.recording import software_versions
from railsim.scenario import Scenario, digest_of, load_scenario
from railsim.simulation import about_recording, load_engine, run_digest
from railsim.truth import TIME

ESTIMATORS = "estimators."
_SHAPING = ("railsim", "estimators", "experiments")
_APART = ("commands", "figures", "sweep", "studies")


@dataclass(frozen=True)
class Plan:
    """What a sweep will do.

    Attributes
    ----------
    sweep : as it was asked for.
    columns : design values by factor, one a point: ("number" or "text", values).
    tasks : in the order of their first points.
    bad : for points that cannot be simulated, why not.
    runs : digest of the simulated run by point; none for bad ones.
    """

    sweep: Sweep
    columns: dict[str, tuple[str, list[Any]]]
    tasks: tuple[Task, ...]
    bad: dict[int, str]
    runs: dict[int, str]

    @property
    def points(self) -> int:
        """Number of design points."""
        return len(self.bad) + len(self.runs)

    @property
    def runs_of_estimators(self) -> int:
        """Rows at least: points times sensor sets, variants and seeds."""
        sweep = self.sweep
        return self.points * len(sweep.sets) * len(sweep.variants) * len(sweep.seeds)

    def digest(self) -> str:
        """SHA-256 over all that shapes the table."""
        columns = {name: list(column) for name, column in self.columns.items()}
        return digest_of([columns, [task.digest() for task in self.tasks], sorted(self.bad.items())])

    def bad_rows(self) -> list[Row]:
        """Rows of the points that cannot be simulated."""
        sweep = self.sweep
        return [
            [number, at, which, seed, None, None, None, None, FAILED, message]
            for number, message in self.bad.items()
            for at in range(len(sweep.sets))
            for which in range(len(sweep.variants))
            for seed in sweep.seeds
        ]


def make_plan(sweep: Sweep, tick: Callable[[int, int], None] = lambda done, total: None) -> Plan:
    """Build every point's scenario; nothing is simulated.

    Parameters
    ----------
    sweep : what is asked for.
    tick : told after each point how many of how many are built.

    Raises
    ------
    InputError : the engine is missing; all points are bad; an estimator's setting is wrong; an estimator that was
        named fits no point.
    """
    load_engine(sweep.engine)
    rows = sweep.design.rows()
    seen: dict[str, Measurements] = {}
    points: dict[str, list[PointTask]] = {}
    bad: dict[int, str] = {}
    runs: dict[int, str] = {}
    tracks: dict[str, tuple[str, str] | None] = {}
    checked: set[str] = set()
    for number, levels in enumerate(rows):
        changes = {key: value for _, level in levels for key, value in level.items()}
        settings = _estimator_settings(sweep, changes, checked)
        try:
            values = sweep.fixed | {key: value for key, value in changes.items() if not key.startswith(ESTIMATORS)}
            scenario = load_scenario(sweep.source, values)
            run = run_digest(scenario, sweep.engine)
            silent = _silent(scenario)
        except InputError as error:
            bad[number] = str(error)
        else:
            runs[number] = run
            if run not in tracks:
                tracks[run] = track_text(scenario)
            seen.setdefault(digest_of(silent.channels), silent)
            points.setdefault(run, []).append(PointTask(number, scenario.values(), settings))
        tick(number + 1, len(rows))
    if not runs:
        raise InputError(f"no point of the design can be simulated; the first says: {bad[0]}")
    _check_fit(sweep, seen)
    tasks = tuple(
        Task(number, run, sweep.engine, tuple(of_run), sweep.variants, sweep.sets, sweep.seeds, tracks[run])
        for number, (run, of_run) in enumerate(points.items())
    )
    names = [factor.name for factor in sweep.design.factors]
    columns = {name: column_values([levels[place][0] for levels in rows]) for place, name in enumerate(names)}
    return Plan(sweep, columns, tasks, bad, runs)


def program_digest() -> str:
    """SHA-256 over the program and the versions of its libraries: results of different ones are not mixed."""
    total = hashlib.sha256(digest_of(software_versions()).encode())
    for package in _SHAPING:
        spec = importlib.util.find_spec(package)
        for root in (spec.submodule_search_locations or []) if spec else []:
            for path in sorted(Path(root).rglob("*.py")):
                inner = path.relative_to(root)
                if package != "experiments" or inner.parts[0] not in _APART or inner.name == "task.py":
                    total.update(f"{package}/{inner.as_posix()}\0".encode() + path.read_bytes())
    return total.hexdigest()


def _estimator_settings(sweep: Sweep, changes: dict[str, Any], checked: set[str]) -> dict[str, dict[str, Any]]:
    """Settings that a point changes, by label; each combination is tried once."""
    found: dict[str, dict[str, Any]] = {}
    for key, value in changes.items():
        if key.startswith(ESTIMATORS):
            label, _, field = key.removeprefix(ESTIMATORS).partition(".")
            if label not in [variant.label for variant in sweep.variants] or not field:
                known = ", ".join(variant.label for variant in sweep.variants)
                raise InputError(f"design.keys.{key}: write estimators.LABEL.SETTING; labels are: {known}")
            found.setdefault(label, {})[field] = value
    for variant in sweep.variants:
        given = digest_of([variant.label, found.get(variant.label, {})])
        if given not in checked:
            variant.build(found.get(variant.label, {}))
            checked.add(given)
    return found


def _check_fit(sweep: Sweep, seen: dict[str, Measurements]) -> None:
    """Raise where a named estimator fits no sensor set of any suite of sensors, or a pattern no channel of any."""
    for wanted in sweep.sets:
        for pattern in wanted.patterns:
            if not any(type(wanted)(wanted.name, (pattern,)).has(name) for one in seen.values() for name in one):
                known = ", ".join(name.rpartition(" [")[0] for name in next(iter(seen.values())))
                raise InputError(f"sensors.{wanted.name}: no channel fits '{pattern}'; the scenario has {known}")
    for variant in sweep.variants if sweep.explicit else ():
        reasons = [_unfit(variant, measured, sweep) for measured in seen.values()]
        if all(reasons):
            raise InputError(f"estimators.{variant.label}: {reasons[0]}; it fits no point of the sweep")


def _unfit(variant: Variant, measured: Measurements, sweep: Sweep) -> str:
    """Why an estimator fits none of the sensor sets; nothing where it fits one."""
    estimator = variant.build({})
    reason = ""
    for wanted in sweep.sets:
        try:
            part = restrict(measured, wanted)
        except InputError:
            continue
        if estimator.fits(part):
            return ""
        reason = reason or why_unfit(estimator, part)
    return reason or "no sensor set has a channel"


def _silent(scenario: Scenario) -> Measurements:
    """A recording of the scenario's sensors with two lost samples."""
    tables: dict[float, dict[str, np.ndarray]] = {}
    for sensor in scenario.sensors:
        table = tables.setdefault(sensor.rate, {TIME: np.arange(2) / sensor.rate})
        table.update({name: np.full(2, np.nan) for name in sensor.channels()})
    return Measurements(about_recording(scenario), tables)
