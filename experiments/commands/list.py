"""`railsim list`: what there is, with a line on each."""

import argparse
import shutil
import sys
from collections.abc import Callable

import estimators
from estimators.interface import Estimator
from experiments import figures
from experiments.commands.interface import Outcome, table
from experiments.figures.interface import Figure
from experiments.sweep.settings import shipped_studies
from railsim import sensors, vehicles
from railsim.effects.interface import Effect
from railsim.registry import discover
from railsim.scenario import effect_kinds, load_scenario, shipped_scenarios
from railsim.sensors.interface import Sensor
from railsim.track.files import read_track, shipped_tracks
from railsim.vehicles.interface import Vehicle


def execute(given: argparse.Namespace) -> Outcome:
    """Names and descriptions of one kind, or of all."""
    chosen = [given.kind] if given.kind else list(LISTERS)
    found = {kind: LISTERS[kind]() for kind in chosen}
    result = {kind: [{"name": name, "description": text} for name, text in one.items()] for kind, one in found.items()}
    parts = [_text(kind, one, bool(given.kind)) for kind, one in found.items()]
    return Outcome(result, "\n\n".join(parts))


def _text(kind: str, found: dict[str, str], alone: bool) -> str:
    if not found:
        return f"There are no {kind} in this version."
    rows = [[name, text] for name, text in found.items()]
    columns = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    return table([kind if not alone else "name", "description"], rows, columns=columns)


def _first_line(thing: object) -> str:
    return (thing.__doc__ or "").strip().splitlines()[0] if thing.__doc__ else ""


def _effects() -> dict[str, str]:
    """Each effect's parameters with their bounds, what it looks like, and its class where that holds others too."""
    return {name: f"{_parameters(kind)}: {kind.signature}{_class(kind)}" for name, kind in effect_kinds().items()}


def _parameters(kind: type[Effect]) -> str:
    """Parameters that a fit may vary, e.g. "factor 0 to 1"."""
    found = {name: one for name, one in kind.parameters().items() if name not in kind.held()}
    return ", ".join(f"{name} {one.low:g} to {one.high:g}{_unit(one.unit)}" for name, one in found.items())


def _class(kind: type[Effect]) -> str:
    return f" (class {kind.family})" if kind.family else ""


def _unit(unit: str) -> str:
    return "" if unit.startswith("-") else f" {unit}"


def _track_description(name: str) -> str:
    return next(iter(read_track(name).comments), "").rstrip(",")


LISTERS: dict[str, Callable[[], dict[str, str]]] = {
    "scenarios": lambda: {name: load_scenario(name).description for name in shipped_scenarios()},
    "estimators": lambda: {name: _first_line(kind) for name, kind in discover(estimators, Estimator).items()},
    "effects": _effects,
    "sensors": lambda: {name: _first_line(kind) for name, kind in discover(sensors, Sensor).items()},
    "vehicles": lambda: {name: _first_line(kind) for name, kind in discover(vehicles, Vehicle).items()},
    "tracks": lambda: {name: _track_description(name) for name in shipped_tracks()},
    "figures": lambda: {name: _first_line(kind) for name, kind in discover(figures, Figure).items()},
    "studies": shipped_studies,
}
"""By kind: what there is, as name and description."""
