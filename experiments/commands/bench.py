"""`railsim bench`: speed of the engines and estimators."""

import argparse

from experiments.benchmarks.speed import bench_rows
from experiments.commands.interface import Outcome, table


def execute(given: argparse.Namespace) -> Outcome:
    """Measure, and list."""
    rows = bench_rows(given.fast)
    lines = [[row["name"], row["value"], row["unit"], row["against"] or "", row["ratio"]] for row in rows]
    return Outcome({"rows": rows}, table(["what", "value", "unit", "against", "ratio"], lines, decimals=1))
