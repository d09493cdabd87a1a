"""`railsim inspect`: check a recording, scenario or track and say what is wrong with it.

examples:
  railsim inspect recording
  railsim inspect recording --repair cleaned
  railsim inspect default
"""

import argparse
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.reporting.outcome import Outcome
from experiments.reporting.text import table
from railsim.errors import InputError

if TYPE_CHECKING:
    from experiments.maintenance.inspection import Report


def configure(parser: argparse.ArgumentParser) -> None:
    """What to inspect, and what to do with a recording."""
    parser.add_argument("what", metavar="RECORDING|SCENARIO|TRACK", help="a name or a path")
    parser.add_argument("--repair", metavar="DIR", help="folder of a cleaned copy of the recording, with a log")
    parser.add_argument(
        "--prune", action="store_true", help="say what a recording would be reduced to: events and features"
    )
    parser.add_argument(
        "--after", type=float, default=90.0, metavar="DAYS", help="keep raw data for so long (default: 90)"
    )
    parser.add_argument("--yes", action="store_true", help="with --prune: do it")


def execute(given: argparse.Namespace) -> Outcome:
    """Inspect whatever the name or path stands for; exit code 1 where something is suspicious."""
    from experiments.maintenance.inspection import INSPECTORS, kinds_of
    from experiments.maintenance.retention import prune

    kinds = kinds_of(given.what)
    if (given.repair or given.prune) and kinds != ["recording"]:
        raise InputError(f"'{given.what}' is a {kinds[0]}; --repair and --prune are for recordings")
    if given.prune:
        return prune(Path(given.what), given.after, given.yes)
    if given.repair:
        return _repair(given.what, given.repair)
    reports = [INSPECTORS[kind](given.what) for kind in kinds]
    held = not any(report.problems for report in reports)
    return Outcome({"inspected": [r.stated() for r in reports]}, "\n\n".join(map(_text, reports)), held)


def _repair(what: str, folder: str) -> Outcome:
    """Write a cleaned copy; exit code 0, because what was wrong is mended."""
    from experiments.maintenance.inspection import repair
    from railsim.quality.interface import texts

    inspection = repair(what, folder)
    lines = [f"{folder}: cleaned copy of {what}", *(f"  {line}" for line in texts(inspection.faults))]
    result = {"repaired": str(folder), "findings": [finding.stated() for finding in inspection.findings]}
    return Outcome(result, "\n".join(lines if inspection.faults else [*lines, "  nothing had to be changed"]))


def _text(report: "Report") -> str:
    from experiments.maintenance.readiness import readiness_text

    width = max(len(name) for name in report.facts)
    lines = [
        f"{report.kind} {report.name}",
        *(f"  {name.ljust(width)}  {_fact(value)}" for name, value in report.facts.items()),
    ]
    if report.rows:
        lines += ["", table(report.header, report.rows, decimals=5)]
    lines += ["", *(f"note: {text}" for text in report.notes), *(f"suspicious: {text}" for text in report.problems)]
    unchecked = any(finding["kind"] == "too short" for finding in report.findings)
    lines += [] if report.problems or unchecked else ["nothing suspicious"]
    if report.estimators:
        columns = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
        lines += ["", readiness_text(report.estimators, columns)]
    return "\n".join(lines)


def _fact(value: Any) -> str:
    """A fact for people."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
