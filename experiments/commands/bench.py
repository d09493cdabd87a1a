"""`railsim bench`: speed of the engines and estimators."""

import argparse

from experiments.reporting.outcome import Outcome
from experiments.reporting.text import table


def configure(parser: argparse.ArgumentParser) -> None:
    """Size."""
    parser.add_argument("--fast", action="store_true", help="a short run, once: to see that it works, not to be quoted")


def execute(given: argparse.Namespace) -> Outcome:
    """Measure, and list."""
    from experiments.benchmarks.speed import bench_rows

    rows = bench_rows(given.fast)
    lines = [[row["name"], row["value"], row["unit"], row["against"] or "", row["ratio"]] for row in rows]
    return Outcome({"rows": rows}, table(["what", "value", "unit", "against", "ratio"], lines, decimals=1))
