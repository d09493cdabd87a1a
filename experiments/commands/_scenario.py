"""Arguments that choose a scenario, and the scenario that they choose."""

import argparse
from typing import TYPE_CHECKING

from experiments.reporting.logs import tell

if TYPE_CHECKING:
    from railsim.scenario import Scenario


def add_scenario(parser: argparse.ArgumentParser) -> None:
    """Name or path, engine, seed and changed keys."""
    parser.add_argument("scenario", metavar="SCENARIO", help="name of a shipped scenario, or path of a YAML file")
    parser.add_argument(
        "--engine", default="exudyn", metavar="NAME", help="exudyn (the reference, default), compiled or verlet"
    )
    parser.add_argument(
        "--seed", type=int, metavar="N", help="seed of the sensors' random errors (default: the scenario's)"
    )
    parser.add_argument(
        "--set", action="extend", nargs="+", default=[], metavar="KEY=VALUE", help="e.g. vehicle.body_mass=18000"
    )


def scenario_of(given: argparse.Namespace) -> "Scenario":
    """The scenario that the arguments ask for; what the file of its vehicle leaves open is told on stderr."""
    from railsim.scenario import load_scenario

    seed = [] if given.seed is None else [f"seed={given.seed}"]
    scenario = load_scenario(given.scenario, [*given.set, *seed])
    for text in scenario.vehicle.assumptions():
        tell(f"assumed: {text}")
    return scenario
