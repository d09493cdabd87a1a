"""`railsim list`: what there is."""

import argparse
import shutil
import sys
from collections.abc import Callable
from types import ModuleType
from typing import TYPE_CHECKING

from experiments.reporting.outcome import Outcome
from experiments.reporting.text import table

if TYPE_CHECKING:
    from railsim.effects.interface import Effect


def configure(parser: argparse.ArgumentParser) -> None:
    """Kind."""
    parser.add_argument("kind", choices=LISTERS, nargs="?", help="all kinds where none is named")


def execute(given: argparse.Namespace) -> Outcome:
    """Names and descriptions of one kind, or of all."""
    chosen = [given.kind] if given.kind else list(LISTERS)
    listed = {kind: LISTERS[kind]() for kind in chosen}
    result = {
        kind: [{"name": name, "description": text} for name, text in descriptions.items()]
        for kind, descriptions in listed.items()
    }
    return Outcome(result, "\n\n".join(_text(kind, listed[kind], bool(given.kind)) for kind in chosen))


def _text(kind: str, descriptions: dict[str, str], alone: bool) -> str:
    if not descriptions:
        return f"There are no {kind} in this version."
    columns = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    return table(["name" if alone else kind, "description"], list(descriptions.items()), columns=columns)


def _scenarios() -> dict[str, str]:
    from railsim.scenario import load_scenario, shipped_scenarios

    return {name: load_scenario(name).description for name in shipped_scenarios()}


def _estimators() -> dict[str, str]:
    import estimators
    from estimators.interface import Estimator

    return _first_lines(estimators, Estimator)


def _effects() -> dict[str, str]:
    """Each effect's parameters with their bounds, what it looks like, and its class where that holds others too."""
    from railsim.scenario import effect_kinds

    return {name: f"{_parameters(kind)}: {kind.signature}{_class(kind)}" for name, kind in effect_kinds().items()}


def _parameters(kind: "type[Effect]") -> str:
    """Parameters that a fit may vary, e.g. "factor 0 to 1"."""
    varied = {name: bounds for name, bounds in kind.parameters().items() if name not in kind.held()}
    return ", ".join(f"{name} {b.low:g} to {b.high:g}{_unit(b.unit)}" for name, b in varied.items())


def _class(kind: "type[Effect]") -> str:
    return f" (class {kind.family})" if kind.family else ""


def _unit(unit: str) -> str:
    return "" if unit.startswith("-") else f" {unit}"


def _sensors() -> dict[str, str]:
    from railsim import sensors
    from railsim.sensors.interface import Sensor

    return _first_lines(sensors, Sensor)


def _vehicles() -> dict[str, str]:
    from railsim import vehicles
    from railsim.vehicles.interface import Vehicle

    return _first_lines(vehicles, Vehicle)


def _tracks() -> dict[str, str]:
    from railsim.track.files import read_track, shipped_tracks

    return {name: next(iter(read_track(name).comments), "").rstrip(",") for name in shipped_tracks()}


def _figures() -> dict[str, str]:
    from experiments import figures
    from experiments.figures.interface import Figure

    return _first_lines(figures, Figure)


def _studies() -> dict[str, str]:
    from experiments.sweep.settings import shipped_studies

    return shipped_studies()


def _first_lines(package: ModuleType, base: type) -> dict[str, str]:
    """First line of each plug-in's docstring, by its name."""
    from railsim.registry import discover

    return {name: (kind.__doc__ or "").strip().partition("\n")[0] for name, kind in discover(package, base).items()}


LISTERS: dict[str, Callable[[], dict[str, str]]] = {
    "scenarios": _scenarios,
    "estimators": _estimators,
    "effects": _effects,
    "sensors": _sensors,
    "vehicles": _vehicles,
    "tracks": _tracks,
    "figures": _figures,
    "studies": _studies,
}
"""By kind: what there is, as name and description. Each imports only its own kind."""
