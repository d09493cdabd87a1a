"""`railsim run`: simulate, measure, estimate, score and draw a scenario.

examples:
  railsim run default
  railsim run default --engine compiled --set duration=20 vehicle.body_mass=18000
"""

import argparse
from pathlib import Path

from experiments.commands._scenario import add_scenario, scenario_of
from experiments.reporting.outcome import Outcome


def configure(parser: argparse.ArgumentParser) -> None:
    """Scenario and folder."""
    add_scenario(parser)
    parser.add_argument("--out", metavar="DIR", help="folder of results (default: results/SCENARIO)")


def execute(given: argparse.Namespace) -> Outcome:
    """Write the folder of results."""
    from experiments.runs.pipeline import run_pipeline

    scenario = scenario_of(given)
    return run_pipeline(scenario, given.engine, Path(given.out or Path("results") / scenario.name))
