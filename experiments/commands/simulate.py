"""`railsim simulate`: make a recording with its truth from a scenario.

examples:
  railsim simulate default --out recording
  railsim simulate curve_s1002 --engine compiled --seed 2 --out recording
"""

import argparse
from typing import Any

from experiments.commands._scenario import add_scenario, scenario_of
from experiments.reporting.outcome import Outcome


def configure(parser: argparse.ArgumentParser) -> None:
    """Scenario and folder."""
    add_scenario(parser)
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of the recording")


def execute(given: argparse.Namespace) -> Outcome:
    """Write the recording."""
    from railsim.files import write_folder_atomically
    from railsim.simulation import check_measured, measure, simulate

    scenario = scenario_of(given)
    check_measured(scenario)
    with write_folder_atomically(given.out) as aside:  # says before the simulation that the place cannot be written
        truth = simulate(scenario, given.engine, progress=True)
        measured = measure(truth, scenario, folder=aside).measurements
    result: dict[str, Any] = {"recording": str(given.out), "engine": given.engine, "seed": scenario.seed}
    result |= {"duration": truth.duration, "channels": measured.channels}
    text = f"{given.out}: {truth.duration:g} s, {len(measured)} measured channels, truth of engine {given.engine}"
    return Outcome(result, text)
