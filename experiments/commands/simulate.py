"""`railsim simulate`: a scenario becomes a recording with its truth."""

import argparse
from typing import Any

from experiments.commands.interface import Outcome
from railsim.files import write_folder_atomically
from railsim.scenario import Scenario, load_scenario
from railsim.simulation import measure, simulate


def execute(given: argparse.Namespace) -> Outcome:
    """Write the recording."""
    scenario = scenario_of(given)
    with write_folder_atomically(given.out) as aside:  # says before the simulation that the place cannot be written
        truth = simulate(scenario, given.engine, progress=True)
        measured = measure(truth, scenario, folder=aside).measurements
    result: dict[str, Any] = {"recording": str(given.out), "engine": given.engine, "seed": scenario.seed}
    result |= {"duration": truth.duration, "channels": measured.channels}
    text = f"{given.out}: {truth.duration:g} s, {len(measured)} measured channels, truth of engine {given.engine}"
    return Outcome(result, text)


def scenario_of(given: argparse.Namespace) -> Scenario:
    """The scenario that the arguments ask for."""
    seed = [] if given.seed is None else [f"seed={given.seed}"]
    return load_scenario(given.scenario, [*given.set, *seed])
