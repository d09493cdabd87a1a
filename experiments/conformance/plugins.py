"""Which checks belong to a plug-in, found by its name or by its file."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from estimators.interface import ESTIMATORS
from experiments.conformance import effects, estimators, figures, scenarios, scorers, sensors, tracks, vehicles
from experiments.conformance.interface import Check, Result, run_checks
from experiments.figures.interface import FIGURES
from experiments.scoring.interface import SCORERS
from railsim.effects.interface import EFFECTS
from railsim.errors import InputError, nearest
from railsim.registry import Files, Kind
from railsim.scenario import SCENARIOS
from railsim.sensors.interface import SENSORS
from railsim.settings import load_yaml
from railsim.track.files import TRACKS
from railsim.vehicles.interface import PARAMETER_SETS, VEHICLES
from railsim.vehicles.lookup import build_vehicle


@dataclass(frozen=True)
class Subject:
    """A plug-in and its checks."""

    kind: str
    name: str
    plugin: Any
    checks: Sequence[Check[Any]]

    def results(self) -> list[Result]:
        """Outcome of each check."""
        return run_checks(self.plugin, self.checks)


@dataclass(frozen=True)
class Classes:
    """A kind that is code: its checks, and what these are given for a class."""

    kind: Kind[Any]
    checks: Sequence[Check[Any]]
    given: Callable[[Any], Any] = lambda plugin: plugin

    def subject(self, name: str, plugin: Any) -> Subject:
        """A class with its checks."""
        return Subject(self.kind.name, name, self.given(plugin), self.checks)


@dataclass(frozen=True)
class Data:
    """A kind that is data: its checks, what these are given for a name or path, and a key that only such files have."""

    files: Files
    checks: Sequence[Check[Any]]
    given: Callable[[str], Any] = str
    key: str = ""

    def subject(self, name: str, source: str) -> Subject:
        """A file with its checks."""
        return Subject(self.files.name, name, self.given(source), self.checks)


CLASSES = (
    Classes(ESTIMATORS, estimators.CHECKS),
    Classes(EFFECTS, effects.CHECKS),
    Classes(SENSORS, sensors.CHECKS),
    Classes(VEHICLES, vehicles.CHECKS, lambda plugin: plugin.build({})),
    Classes(FIGURES, figures.CHECKS),
    Classes(SCORERS, scorers.CHECKS),
)
DATA = (
    Data(SCENARIOS, scenarios.CHECKS, key="track"),
    Data(TRACKS, tracks.CHECKS),
    Data(PARAMETER_SETS, vehicles.CHECKS, build_vehicle, key="base"),
)


def subjects(name: str) -> list[Subject]:
    """Every plug-in of that name, or the one in that file.

    Raises
    ------
    InputError : there is none, or it cannot be read or imported.
    """
    suffix = Path(name).suffix
    if suffix == ".py":
        return [_in_file(Path(name))]
    if suffix:
        return [_data(name, suffix)]
    named = list(_named(name))
    if not named:
        hint = nearest(name, {one.name for one in everything()})
        raise InputError(f"no plug-in '{name}'; {hint}'railsim list' shows all; or give the path of a file")
    return named


def everything() -> list[Subject]:
    """All plug-ins of all kinds."""
    classes = [kind.subject(name, plugin) for kind in CLASSES for name, plugin in kind.kind.classes().items()]
    return classes + [kind.subject(name, name) for kind in DATA for name in kind.files.paths()]


def _named(name: str) -> Iterator[Subject]:
    for kind in CLASSES:
        if found := kind.kind.find(name):
            yield kind.subject(name, found)
    for kind in DATA:
        if name in kind.files.paths():
            yield kind.subject(name, name)


def _in_file(file: Path) -> Subject:
    for kind in CLASSES:
        if kind.kind.has(file):
            return kind.subject(file.stem, kind.kind.in_file(file))
    bases = ", ".join(f"{kind.kind.base.__module__}.{kind.kind.base.__name__}" for kind in CLASSES)
    raise InputError(f"'{file}' defines no plug-in: a public subclass of one of {bases}")


def _data(name: str, suffix: str) -> Subject:
    for kind in DATA:
        if kind.files.suffix == suffix and (not kind.key or kind.key in _keys(name)):
            return kind.subject(Path(name).stem, name)
    keys = " or ".join(f"'{kind.key}' ({kind.files.word})" for kind in DATA if kind.key)
    raise InputError(f"'{name}' is no plug-in: give a .py file, a track as .csv, or a .yaml file with the key {keys}")


def _keys(name: str) -> set[str]:
    values = load_yaml(SCENARIOS.read(name)[1], f"'{name}'")
    return set(values) if isinstance(values, dict) else set()
