"""`railsim check`: check a plug-in against the rules of its kind and say what falls short.

examples:
  railsim check weak_yaw_damper
  railsim check my_plugins/estimators/my_filter.py
"""

import argparse
from typing import Any

from experiments.reporting.outcome import Outcome
from experiments.reporting.text import table


def configure(parser: argparse.ArgumentParser) -> None:
    """Name or file."""
    parser.add_argument("plugin", metavar="NAME|FILE", help="see 'railsim list'; or the path of a file with one")


def execute(given: argparse.Namespace) -> Outcome:
    """A row a check; exit code 1 where something falls short."""
    from experiments.conformance.plugins import subjects
    from railsim.progress import counted

    checks: list[dict[str, Any]] = [
        {"kind": one.kind, "name": one.name, "check": result.check, "ok": result.ok, "message": result.message}
        for one in counted(list(subjects(given.plugin)), "checking", "plug-ins")
        for result in one.results()
    ]
    short = [row for row in checks if not row["ok"]]
    rows = [[f"{row['kind']}/{row['name']}", row["check"], "ok" if row["ok"] else "FALLS SHORT"] for row in checks]
    notes = [f"{row['kind']}/{row['name']}: {row['check']}: {row['message']}" for row in short]
    conclusion = notes or ["Nothing falls short."]
    return Outcome({"checks": checks}, "\n".join([table(["plug-in", "check", ""], rows), "", *conclusion]), not short)
