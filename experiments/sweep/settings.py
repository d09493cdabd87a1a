"""SWEEP.yaml: what a sweep is asked to do, checked before anything is simulated."""

import fnmatch
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from estimators.interface import ESTIMATORS, Estimator
from experiments.sweep.design import Design, read_design
from experiments.sweep.selection import Selection, read_selection
from railsim.errors import InputError
from railsim.registry import Files
from railsim.settings import load_yaml
from railsim.simulation import engine_names

KEYS = ("description", "scenario", "engine", "set", "design", "estimators", "seeds", "sensors", "report")
FIXED = ("point", "run", "sensors", "estimator", "seed", "recording", "score", "unit", "value", "status", "message")
"""Columns of the table that are not design values."""
STUDIES = Files("studies", "experiments/studies", ".yaml", "sweep")
EVERYTHING = "all"


@dataclass(frozen=True)
class SensorSet:
    """A subset of the scenario's channels: patterns for `sensor.quantity` without unit, a class of cost, and the points
    at which it stands.
    """

    name: str
    patterns: tuple[str, ...]
    cost: float | None = None
    at: Selection = Selection()

    def has(self, channel: str) -> bool:
        """Whether a channel of that full name belongs to the set."""
        bare = channel.rpartition(" [")[0]
        return any(fnmatch.fnmatchcase(bare, pattern) for pattern in self.patterns)


@dataclass(frozen=True)
class Variant:
    """An estimator with some settings under a label of its own."""

    label: str
    name: str
    settings: dict[str, Any]

    def build(self, changes: Mapping[str, Any]) -> Estimator:
        """The estimator; `changes` go over its settings."""
        kind = ESTIMATORS.pick(self.name)
        return kind.build({**self.settings, **changes}, f"estimators.{self.label}")


@dataclass(frozen=True)
class Panel:
    """A quantity for which sets of sensors are compared: its score `"score [unit]"` and the points that count."""

    title: str
    score: str
    at: Selection = Selection()


@dataclass(frozen=True)
class Sweep:
    """A sweep as it was asked for.

    Attributes
    ----------
    name, description : of the sweep. source : the scenario's name or path. engine : that makes the truth.
    fixed : values by dotted key, the same for all points.
    explicit : whether the estimators were named one by one.
    responses : scores `"score [unit]"` that the report draws; empty leaves the choice to it.
    panels : what sets of sensors are compared by; empty leaves the choice to the report.
    """

    name: str
    description: str
    source: str
    engine: str
    fixed: dict[str, Any]
    design: Design
    variants: tuple[Variant, ...]
    explicit: bool
    seeds: tuple[int, ...]
    sets: tuple[SensorSet, ...]
    responses: tuple[str, ...]
    panels: tuple[Panel, ...] = ()


def studies() -> dict[str, str]:
    """Description of each study by its name."""
    return {name: str(_parse(name, STUDIES.read(name)[1]).get("description", "")) for name in STUDIES.paths()}


def read_sweep(source: str | Path) -> Sweep:
    """Read a sweep from the name of a shipped study or the path of a YAML file.

    Raises
    ------
    InputError : one line that names the dotted key that is wrong.
    """
    path, text = STUDIES.read(source)
    values = _parse(str(source), text)
    unknown = sorted(str(key) for key in values if key not in KEYS)
    if unknown:
        raise InputError(f"{unknown[0]}: unknown key; a sweep knows {', '.join(KEYS)}")
    for key in ("scenario", "design"):
        if key not in values:
            raise InputError(f"{key}: missing; add it")
    engine = str(values.get("engine", "compiled"))
    if engine not in engine_names():
        raise InputError(f"engine: unknown engine '{engine}'; there are: {', '.join(engine_names())}")
    design = read_design(values["design"])
    _check_names(design)
    given = values.get("estimators", EVERYTHING)
    report = values.get("report", {})
    return Sweep(
        name=path.stem,
        description=str(values.get("description", "")),
        source=_scenario_source(values["scenario"], path.parent),
        engine=engine,
        fixed=_fixed(values.get("set", {})),
        design=design,
        variants=_variants(given),
        explicit=given != EVERYTHING,
        seeds=_seeds(values.get("seeds", [1])),
        sets=_sets(values.get("sensors", {}), design),
        responses=_responses(report),
        panels=_panels(report.get("panels", {}), design),
    )


def _parse(source: str, text: str) -> dict[str, Any]:
    values = load_yaml(text, f"'{source}'")
    if not isinstance(values, dict):
        raise InputError(f"'{source}' is not a sweep: it must hold keys and values, for example 'scenario: default'")
    return values


def _scenario_source(given: Any, folder: Path) -> str:
    """A name as it is; a path taken from the sweep's folder, or else from the working folder."""
    if not isinstance(given, str) or not given:
        raise InputError("scenario: give the name of a shipped scenario or the path of a YAML file")
    beside = folder / given
    return str(beside) if Path(given).suffix and beside.is_file() else given


def _fixed(given: Any) -> dict[str, Any]:
    if not isinstance(given, Mapping) or not all(isinstance(key, str) for key in given):
        raise InputError("set: give values by dotted key, for example {duration: 20}")
    if "seed" in given:
        raise InputError("set.seed: noise seeds are given by the sweep's own key 'seeds'; move it there")
    return dict(given)


def _check_names(design: Design) -> None:
    for factor in design.factors:
        if factor.name == "seed":
            raise InputError("design.keys.seed: noise seeds are given by the sweep's own key 'seeds'; move them there")
        if factor.name in FIXED:
            raise InputError(f"design.keys.{factor.name}: the table has a column of that name; choose another name")


def _variants(given: Any) -> tuple[Variant, ...]:
    classes = ESTIMATORS.classes()
    if given == EVERYTHING:
        return tuple(Variant(name, name, {}) for name in classes)
    if not isinstance(given, list) or not given:
        raise InputError("estimators: give 'all' or a list, for example [speed_plain, {name: speed_plain, window: 2}]")
    made = tuple(_variant(one, f"estimators.{number}") for number, one in enumerate(given))
    labels = [variant.label for variant in made]
    twice = [label for label in labels if labels.count(label) > 1]
    if twice:
        raise InputError(f"estimators: '{twice[0]}' appears twice; give one of them another label")
    for variant in made:
        variant.build({})
    return made


def _variant(given: Any, where: str) -> Variant:
    values = {"name": given} if isinstance(given, str) else given
    if not isinstance(values, Mapping) or not isinstance(values.get("name"), str):
        raise InputError(f"{where}: give the name of an estimator, or name, label and settings")
    label = values.get("label", values["name"])
    if not isinstance(label, str) or not label or "." in label:
        raise InputError(f"{where}.label: give a text without dots (got {label!r})")
    return Variant(label, values["name"], {k: v for k, v in values.items() if k not in ("name", "label")})


def _seeds(given: Any) -> tuple[int, ...]:
    if not isinstance(given, list) or not given:
        raise InputError("seeds: give a list of whole numbers from 0, for example [1, 2, 3]")
    for number, seed in enumerate(given):
        if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
            raise InputError(f"seeds.{number}: give a whole number from 0 (got {seed!r})")
        if seed in given[:number]:
            raise InputError(f"seeds.{number}: {seed} appears twice; keep one")
    return tuple(given)


def _sets(given: Any, design: Design) -> tuple[SensorSet, ...]:
    if not isinstance(given, Mapping):
        raise InputError("sensors: give names with patterns of channels, for example {gyro: [bogie.rate_pitch]}")
    if not given:
        return (SensorSet(EVERYTHING, ("*",)),)
    return tuple(_set(str(name), one, design) for name, one in given.items())


def _set(name: str, given: Any, design: Design) -> SensorSet:
    values = {"channels": given} if isinstance(given, list) else given
    if not isinstance(values, Mapping) or not {"channels"} <= set(values) <= {"channels", "cost", "at"}:
        raise InputError(f"sensors.{name}: give a list of channels, or channels, cost and at")
    patterns, cost = values["channels"], values.get("cost")
    if not isinstance(patterns, list) or not patterns or not all(isinstance(one, str) for one in patterns):
        raise InputError(f"sensors.{name}.channels: give a list of patterns, for example [bogie.rate_pitch, 'body.*']")
    if cost is not None and (isinstance(cost, bool) or not isinstance(cost, int | float) or not 0 <= cost < 1e9):
        raise InputError(f"sensors.{name}.cost: give a number from 0 (got {cost!r})")
    at = read_selection(values.get("at"), f"sensors.{name}.at", design)
    return SensorSet(name, tuple(patterns), None if cost is None else float(cost), at)


def _responses(given: Any) -> tuple[str, ...]:
    if not isinstance(given, Mapping) or not set(given) <= {"scores", "panels"}:
        raise InputError("report: knows scores and panels; give for example {scores: ['rms error [km/h]']}")
    scores = given.get("scores", [])
    if not isinstance(scores, list) or not all(isinstance(one, str) for one in scores):
        raise InputError("report.scores: give a list of scores with their units")
    return tuple(scores)


def _panels(given: Any, design: Design) -> tuple[Panel, ...]:
    if not isinstance(given, Mapping):
        raise InputError(
            "report.panels: give names, each with score and at, for example {speed: {score: 'rms error [km/h]'}}"
        )
    made = []
    for title, panel in given.items():
        where = f"report.panels.{title}"
        if (
            not isinstance(panel, Mapping)
            or not {"score"} <= set(panel) <= {"score", "at"}
            or not isinstance(panel["score"], str)
        ):
            raise InputError(f"{where}: give the score with its unit, and optionally the points as at")
        made.append(Panel(str(title), panel["score"], read_selection(panel.get("at"), f"{where}.at", design)))
    return tuple(made)
