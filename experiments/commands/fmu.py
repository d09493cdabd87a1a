"""`railsim fmu`: write a scenario's vehicle and sensors as an FMI 3.0 co-simulation unit.

examples:
  railsim fmu default --out default.fmu
  railsim fmu curve_s1002 --out curve.fmu --set duration=20
"""

import argparse
from pathlib import Path

from experiments.commands._scenario import add_scenario, scenario_of
from experiments.reporting.outcome import Outcome
from railsim.errors import InputError


def configure(parser: argparse.ArgumentParser) -> None:
    """Scenario and file."""
    add_scenario(parser)
    parser.set_defaults(engine="compiled")
    parser.add_argument("--out", metavar="FILE.fmu", required=True, help="the unit")
    parser.add_argument("--overwrite", action="store_true", help="replace a unit that is there already")


def execute(given: argparse.Namespace) -> Outcome:
    """Write the unit, and say what stands in it.

    Raises
    ------
    InputError : an engine that the unit does not have; or as `railsim.fmu.export_unit`.
    """
    from railsim.fmu import ENGINE, export_unit

    if given.engine != ENGINE:
        raise InputError(f"--engine {given.engine}: the unit runs by '{ENGINE}'; leave --engine out")
    units = export_unit(scenario_of(given), Path(given.out), given.overwrite)
    measured = [name for name in units if not name.startswith("truth.")]
    lines = [
        f"{given.out}: FMI 3.0 co-simulation, {len(measured)} measured and {len(units) - len(measured)} true channels",
        "It needs Python with railsim where it runs: docs/fmu.md",
    ]
    return Outcome({"unit": given.out, "outputs": units}, "\n".join(lines))
