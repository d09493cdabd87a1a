"""`railsim new`: write a commented start of a scenario, vehicle, estimator or effect of your own.

examples:
  railsim new estimator my_filter
  railsim new effect soft_primary --in my_plugins
  railsim new scenario slow_curve
"""

import argparse
import keyword
from pathlib import Path

from experiments.reporting.outcome import Outcome
from railsim.errors import InputError
from railsim.files import replace_file

KINDS = {"scenario": ".yaml", "vehicle": ".py", "estimator": ".py", "effect": ".py"}
"""What can be started, and how its file ends."""
TRY = {
    "scenario": "railsim run {name} --plugins {folder}",
    "vehicle": "railsim run default --plugins {folder} --set vehicle={name}",
    "estimator": "railsim run default --plugins {folder}",
    "effect": "railsim run default --plugins {folder} --set 'effects=[{name}]'",
}


def configure(parser: argparse.ArgumentParser) -> None:
    """Kind, name and folder."""
    parser.add_argument("kind", choices=tuple(KINDS), help="what to start")
    parser.add_argument("name", metavar="NAME", help="name of the plug-in and its file: letters, digits and '_'")
    parser.add_argument(
        "--in", dest="folder", metavar="DIR", default="my_plugins", help="folder of plug-ins (default: my_plugins)"
    )


def execute(given: argparse.Namespace) -> Outcome:
    """Write the file, and say how to try it.

    Raises
    ------
    InputError : the name cannot be a module's, is taken, or the file is there already.
    """
    kind, name = given.kind, given.name
    _check_name(kind, name)
    path = Path(given.folder) / f"{kind}s" / f"{name}{KINDS[kind]}"
    if path.exists():
        raise InputError(f"'{path}' is there already; choose another name, or remove it")
    replace_file(path, start(kind, name).encode())
    tries = [f"railsim check {name} --plugins {given.folder}", TRY[kind].format(name=name, folder=given.folder)]
    lines = [f"{path}: a start that works; edit it, then", *(f"  {line}" for line in tries)]
    return Outcome({"written": str(path), "try": tries}, "\n".join(lines))


def start(kind: str, name: str) -> str:
    """Text of the file; `kind` is one of `KINDS`."""
    text = (Path(__file__).parent / "starts" / f"{kind}.txt").read_text(encoding="utf-8")
    return text.replace("@NAME@", name).replace("@CLASS@", "".join(part.title() for part in name.split("_")))


def _check_name(kind: str, name: str) -> None:
    if not name.isidentifier() or not name.isascii() or keyword.iskeyword(name) or name.startswith(("_", "test")):
        raise InputError(f"'{name}' cannot be the name of a file of Python; use letters, digits and '_', as my_{kind}")
    if name in _taken(kind):
        raise InputError(f"{kind} '{name}' ships with railsim; choose another name")


def _taken(kind: str) -> set[str]:
    from estimators.interface import ESTIMATORS
    from railsim.effects.interface import EFFECTS
    from railsim.scenario import SCENARIOS
    from railsim.vehicles.interface import PARAMETER_SETS, VEHICLES

    if kind == "scenario":
        return set(SCENARIOS.shipped())
    if kind == "vehicle":
        return {*VEHICLES.classes(), *PARAMETER_SETS.shipped()}
    return set((ESTIMATORS if kind == "estimator" else EFFECTS).classes())
