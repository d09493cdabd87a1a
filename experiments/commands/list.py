"""`railsim list`: list scenarios, estimators, effects and all other plug-ins, with what each is for.

examples:
  railsim list
  railsim list estimators --json
"""

import argparse
import shutil
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from experiments.reporting.kept_lists import keep, kept
from experiments.reporting.outcome import Outcome
from experiments.reporting.text import first_sentence, table

if TYPE_CHECKING:
    from railsim.effects.interface import Effect
    from railsim.registry import Kind


def configure(parser: argparse.ArgumentParser) -> None:
    """Kind."""
    parser.add_argument("kind", choices=tuple(LISTERS), nargs="?", help="all kinds where none is named")


def execute(given: argparse.Namespace) -> Outcome:
    """Names and descriptions of one kind, or of all."""
    chosen = [given.kind] if given.kind else list(LISTERS)
    listed = {kind: _listed(kind) for kind in chosen}
    result = {
        kind: [{"name": name, "description": text} for name, text in descriptions.items()]
        for kind, descriptions in listed.items()
    }
    return Outcome(result, "\n\n".join(_text(kind, listed[kind], bool(given.kind)) for kind in chosen))


def _listed(kind: str) -> dict[str, str]:
    """As it was kept; else looked up, for which every plug-in of the kind is imported."""
    found = kept(kind)
    if found is None:
        found = LISTERS[kind]()
        keep(kind, found)
    return found


def _text(kind: str, descriptions: dict[str, str], alone: bool) -> str:
    if not descriptions:
        return f"There are no {kind} in this version."
    columns = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    return table(["name" if alone else kind, "description"], list(descriptions.items()), columns=columns)


def _scenarios() -> dict[str, str]:
    from railsim.scenario import described_scenarios

    return described_scenarios()


def _estimators() -> dict[str, str]:
    from estimators.interface import ESTIMATORS

    return _summaries(ESTIMATORS)


def _effects() -> dict[str, str]:
    """Each effect's parameters with their bounds, what it looks like, and its class where that holds others too."""
    from railsim.effects.interface import EFFECTS

    return {name: f"{_parameters(kind)}: {kind.signature}{_class(kind)}" for name, kind in EFFECTS.classes().items()}


def _parameters(kind: "type[Effect]") -> str:
    """Parameters that a fit may vary, e.g. "factor 0 to 1"."""
    varied = {name: bounds for name, bounds in kind.parameters().items() if name not in kind.held()}
    return ", ".join(f"{name} {b.low:g} to {b.high:g}{_unit(b.unit)}" for name, b in varied.items())


def _class(kind: "type[Effect]") -> str:
    return f" (class {kind.family})" if kind.family else ""


def _unit(unit: str) -> str:
    return "" if unit.startswith("-") else f" {unit}"


def _sensors() -> dict[str, str]:
    from railsim.sensors.interface import SENSORS

    return _summaries(SENSORS)


def _vehicles() -> dict[str, str]:
    from railsim.vehicles.interface import PARAMETER_SETS, VEHICLES
    from railsim.vehicles.lookup import build_vehicle

    sets = {name: f"Parameters that change '{build_vehicle(name).kind}'." for name in PARAMETER_SETS.paths()}
    return dict(sorted((_summaries(VEHICLES) | sets).items()))


def _tracks() -> dict[str, str]:
    from railsim.track.files import TRACKS, read_track

    return {name: first_sentence("\n".join(read_track(name).comments)) for name in TRACKS.paths()}


def _figures() -> dict[str, str]:
    from experiments.figures.interface import FIGURES

    return {name: figure.summary() for name, figure in FIGURES.classes().items()}


def _scorers() -> dict[str, str]:
    from experiments.scoring.interface import SCORERS

    return _summaries(SCORERS)


def _studies() -> dict[str, str]:
    from experiments.sweep.settings import studies

    return studies()


def _summaries(kind: "Kind[Any]") -> dict[str, str]:
    """First sentence of each plug-in's docstring, by its name."""
    return {name: first_sentence(found.__doc__ or "") for name, found in kind.classes().items()}


LISTERS: dict[str, Callable[[], dict[str, str]]] = {
    "scenarios": _scenarios,
    "estimators": _estimators,
    "effects": _effects,
    "sensors": _sensors,
    "vehicles": _vehicles,
    "tracks": _tracks,
    "figures": _figures,
    "scorers": _scorers,
    "studies": _studies,
}
"""By kind: what there is, as name and description. Each imports only its own kind."""
