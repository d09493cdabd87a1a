"""`railsim bench`: measure the speed of engines and estimators.

examples:
  railsim bench --fast
  railsim bench --day 1 --format parquet
  railsim bench --lanes lanes.png
"""

import argparse
from pathlib import Path

from experiments.reporting.outcome import Outcome
from experiments.reporting.text import table
from railsim.errors import InputError
from railsim.files import new_file


def configure(parser: argparse.ArgumentParser) -> None:
    """Size, or a long record in place of the engines."""
    parser.add_argument("--fast", action="store_true", help="a short run, once: to see that it works, not to be quoted")
    parser.add_argument(
        "--day", type=float, metavar="HOURS", help="measure a record of so many hours, from file to report"
    )
    parser.add_argument("--format", choices=("parquet", "csv"), default="parquet", help="with --day: of the file")
    parser.add_argument("--lanes", metavar="FILE", help="only runs in lanes, by number of lanes: a picture (PNG)")
    parser.add_argument("--keep", metavar="DIR", help="with --day: folder of the data and of all results")


def execute(given: argparse.Namespace) -> Outcome:
    """Measure, and list."""
    from experiments.benchmarks.day import day_rows
    from experiments.benchmarks.speed import bench_rows

    if given.day is not None and not 0.0 < given.day <= 100.0:
        raise InputError(f"--day {given.day:g}: give hours, above 0 and up to 100")
    if given.lanes is not None:
        return _lanes(Path(given.lanes), given.fast)
    if given.day is None:
        rows = bench_rows(given.fast)
    else:
        rows = day_rows(given.day, f".{given.format}", Path(given.keep) if given.keep else None)
    lines = [[row["name"], row["value"], row["unit"], row["against"] or "", row["ratio"]] for row in rows]
    return Outcome(
        {"rows": rows},
        table(["what", "value", "unit", "against", "ratio"], lines, decimals=1 if given.day is None else 2),
    )


def _lanes(path: Path, fast: bool) -> Outcome:
    from experiments.benchmarks.lanes import draw_widths, width_rows

    with new_file(path) as aside:
        rows = width_rows(fast)
        draw_widths(rows).savefig(aside, dpi=130, format="png")
    heads = list(rows[0])
    return Outcome({"rows": rows, "files": [str(path)]}, table(heads, [list(row.values()) for row in rows], decimals=0))
