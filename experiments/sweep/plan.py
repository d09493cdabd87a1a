"""The plan of a sweep: its points, each with its scenario built and checked, gathered into tasks by simulated run."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimators.interface import ESTIMATORS
from experiments.scoring.interface import SCORERS
from experiments.sweep.design import column_values
from experiments.sweep.settings import SensorSet, Sweep, Variant
from experiments.sweep.task import FAILED, PointTask, Row, Task, restrict, track_text, why_unfit
from railsim.distribution import ROOT
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.plugins import plugin_folders
from railsim.recording import software_versions
from railsim.registry import source_digest
from railsim.scenario import Scenario, digest_of, load_scenario
from railsim.sensors.interface import SENSORS
from railsim.simulation import about_recording, load_engine, run_digest
from railsim.track.survey import TrackErrors, survey
from railsim.truth import TIME

SETTINGS = "estimators."
_SHAPING = ("railsim", "estimators", "experiments")
_APART = (
    "benchmarks", "bounds", "calibration", "circumstances", "commands", "discrepancy", "fault_injection", "figures",
    "maintenance", "reporting", "runs", "studies", "sweep", "validation",
)  # fmt: skip
Suite = tuple[Measurements, tuple[SensorSet, ...]]
"""A recording without contents, and the sensor sets that stand there."""


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
    sets : places of the sensor sets that stand at each point.
    unserved : by label, why an estimator fits no sensor set at any point.
    """

    sweep: Sweep
    columns: dict[str, tuple[str, list[Any]]]
    tasks: tuple[Task, ...]
    bad: dict[int, str]
    runs: dict[int, str]
    sets: dict[int, tuple[int, ...]]
    unserved: dict[str, str]

    @property
    def points(self) -> int:
        """Number of design points."""
        return len(self.bad) + len(self.runs)

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
            for at in self.sets[number]
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
    seen: dict[str, Suite] = {}
    sets: dict[int, tuple[int, ...]] = {}
    points: dict[str, list[PointTask]] = {}
    bad: dict[int, str] = {}
    runs: dict[int, str] = {}
    tracks: dict[str, tuple[str, str] | None] = {}
    checked: set[str] = set()
    for number, levels in enumerate(rows):
        labels = {factor.name: label for factor, (label, _) in zip(sweep.design.factors, levels, strict=True)}
        sets[number] = tuple(place for place, one in enumerate(sweep.sets) if one.at.has(labels))
        changes = sweep.fixed | {key: value for _, level in levels for key, value in level.items()}
        settings = _estimator_settings(sweep, changes, checked)
        try:
            values = {key: value for key, value in changes.items() if not key.startswith(SETTINGS)}
            scenario = load_scenario(sweep.source, values)
            run = run_digest(scenario, sweep.engine)
            silent = _silent(scenario)
        except InputError as error:
            bad[number] = str(error)
        else:
            runs[number] = run
            if run not in tracks:
                tracks[run] = track_text(scenario)
            kind = [silent.channels, silent.vehicle.get("name"), list(() if silent.track is None else silent.track)]
            seen.setdefault(digest_of([kind, sets[number]]), (silent, tuple(sweep.sets[at] for at in sets[number])))
            points.setdefault(run, []).append(PointTask(number, scenario.values(), settings, sets[number]))
        tick(number + 1, len(rows))
    if not runs:
        raise InputError(f"no point of the design can be simulated; the first says: {bad[0]}")
    unserved = _check_fit(sweep, list(seen.values()))
    plugins = tuple(map(str, plugin_folders()))
    tasks = tuple(
        Task(number, run, sweep.engine, tuple(of_run), sweep.variants, sweep.sets, sweep.seeds, tracks[run], plugins)
        for number, (run, of_run) in enumerate(points.items())
    )
    names = [factor.name for factor in sweep.design.factors]
    columns = {name: column_values([levels[place][0] for levels in rows]) for place, name in enumerate(names)}
    return Plan(sweep, columns, tasks, bad, runs, sets, unserved)


def program_digest() -> str:
    """SHA-256 over the program, its plug-ins and the versions of its libraries: results of different ones are not
    mixed; plug-ins that shape the run itself count to the run.
    """
    total = hashlib.sha256(digest_of(software_versions()).encode())
    for package in _SHAPING:
        for path in sorted((ROOT / package).rglob("*.py")):
            inner = path.relative_to(ROOT / package)
            if package != "experiments" or inner.parts[0] not in _APART or inner.name in ("task.py", "truths.py"):
                total.update(f"{package}/{inner.as_posix()}\0".encode() + path.read_bytes())
    plugins = [cls for kind in (ESTIMATORS, SENSORS, SCORERS) for cls in kind.classes().values()]
    total.update(source_digest(plugins).encode())
    return total.hexdigest()


def _estimator_settings(sweep: Sweep, changes: dict[str, Any], checked: set[str]) -> dict[str, dict[str, Any]]:
    """Settings that a point changes, by label; each combination is tried once."""
    settings: dict[str, dict[str, Any]] = {}
    for key, value in changes.items():
        if key.startswith(SETTINGS):
            label, _, field = key.removeprefix(SETTINGS).partition(".")
            if label not in [variant.label for variant in sweep.variants] or not field:
                known = ", ".join(variant.label for variant in sweep.variants)
                where = f"set.{key}" if key in sweep.fixed else f"design.keys.{key}"
                raise InputError(f"{where}: write estimators.LABEL.SETTING; labels are: {known}")
            settings.setdefault(label, {})[field] = value
    for variant in sweep.variants:
        given = digest_of([variant.label, settings.get(variant.label, {})])
        if given not in checked:
            variant.build(settings.get(variant.label, {}))
            checked.add(given)
    return settings


def _check_fit(sweep: Sweep, seen: list[Suite]) -> dict[str, str]:
    """Why estimators fit no sensor set of any suite; raises where one of them was named, or a pattern fits nothing."""
    for wanted in sweep.sets:
        suites = [measured for measured, sets in seen if wanted in sets]
        for pattern in wanted.patterns if suites else ():
            if not any(SensorSet(wanted.name, (pattern,)).has(name) for one in suites for name in one):
                known = ", ".join(name.rpartition(" [")[0] for name in suites[0])
                raise InputError(f"sensors.{wanted.name}: no channel fits '{pattern}'; the scenario has {known}")
    unserved: dict[str, str] = {}
    for variant in sweep.variants:
        reasons = [_unfit(variant, *suite) for suite in seen]
        if all(reasons):
            unserved[variant.label] = reasons[0]
    for label in unserved if sweep.explicit else ():
        raise InputError(f"estimators.{label}: {unserved[label]}; it fits no point of the sweep")
    return unserved


def _unfit(variant: Variant, measured: Measurements, sets: tuple[SensorSet, ...]) -> str:
    """Why an estimator fits none of the sensor sets; nothing where it fits one."""
    estimator = variant.build({})
    reason = ""
    for wanted in sets:
        try:
            part = restrict(measured, wanted)
        except InputError:
            continue
        if estimator.fits(part):
            return ""
        reason = reason or why_unfit(estimator, part)
    return reason or "no sensor set has a channel"


def _silent(scenario: Scenario) -> Measurements:
    """A recording of the scenario's sensors with two lost samples, and the track's columns where it is measured."""
    tables: dict[float, dict[str, np.ndarray]] = {}
    for sensor in scenario.sensors:
        table = tables.setdefault(sensor.rate, {TIME: np.arange(2) / sensor.rate})
        table.update({name: np.full(2, np.nan) for name in sensor.channels()})
    track = survey(scenario.geometry, TrackErrors(), np.random.default_rng(0)) if scenario.track_measured else None
    return Measurements(about_recording(scenario), tables, track)
