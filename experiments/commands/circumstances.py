"""`railsim circumstances`: judge estimators on laden, slippery, worn and other unusual runs; resumes by itself.

examples:
  railsim circumstances cross_level --out circumstances
  railsim circumstances cross_level --out circumstances --fast
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.reporting.outcome import Outcome
from experiments.reporting.text import table
from railsim.errors import InputError

if TYPE_CHECKING:
    from experiments.circumstances.run import Done, Matrix
    from experiments.circumstances.verdicts import Cell


def configure(parser: argparse.ArgumentParser) -> None:
    """Estimators, circumstances, folders and size."""
    parser.add_argument(
        "estimators", metavar="ESTIMATOR", nargs="*", help="see 'railsim list estimators'; default: all"
    )
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of the results; a run that stopped goes on")
    parser.add_argument(
        "--only", metavar="NAME", action="extend", nargs="+", default=[], help="circumstances, or groups of them"
    )
    parser.add_argument("--file", metavar="FILE", help="YAML file with circumstances in place of the shipped ones")
    parser.add_argument("--recordings", metavar="DIR", help="recordings there are used and kept (default: in --out)")
    parser.add_argument("--against", metavar="DIR", help="results of another run, to put beside these")
    parser.add_argument("--fast", action="store_true", help="shorter runs")
    parser.add_argument("--slice", metavar="I/N", help="only every N-th circumstance from the I-th on")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="processes (default: 1)")


def execute(given: argparse.Namespace) -> Outcome:
    """Make the cells that are missing; write cells.csv, matrix.md and matrix.png from all that are there.

    Exit code 1 where a claim is not held, an estimator failed or a circumstance could not be run.
    """
    from experiments.circumstances.cells import all_kept
    from experiments.circumstances.circumstance import chosen, read_circumstances
    from experiments.circumstances.run import RECORDINGS, Matrix, run_matrix
    from experiments.reporting.slices import sliced
    from railsim.registry import pick

    if given.jobs < 1:
        raise InputError(f"--jobs {given.jobs}: give a number from 1")
    every = read_circumstances(given.file)
    wanted = chosen(every, given.only)
    names = list(sliced(list(wanted), given.slice))
    known = _estimators()
    for name in given.estimators:
        pick(dict.fromkeys(known), name, "estimator")
    asked = tuple(dict.fromkeys(given.estimators or known))
    before = all_kept(Path(given.against)) if given.against else []
    out = Path(given.out)
    recordings = Path(given.recordings) if given.recordings else out / RECORDINGS
    matrix = Matrix(wanted, asked, out, recordings, given.fast)
    done = run_matrix(matrix, names, given.jobs)
    complete = not given.only and not given.file and not given.fast and set(asked) == set(known)
    return _outcome(matrix, done, before, complete and not any(map(matrix.left, wanted)))


def _estimators() -> list[str]:
    from estimators.interface import ESTIMATORS

    return list(ESTIMATORS.classes())


def _outcome(matrix: "Matrix", done: "Done", before: "list[Cell]", whole: bool) -> Outcome:
    from dataclasses import asdict

    from experiments.circumstances import report
    from experiments.circumstances.verdicts import FAILED
    from experiments.circumstances.write import write_results

    cells = matrix.cells()
    made = report.claims(cells, whole, before)
    beside = report.compared(cells, before) if before else None
    files = write_results(matrix, cells, made, beside)
    number = report.counts(cells)
    failed = sorted({cell.says for cell in cells if cell.verdict == FAILED})
    result: dict[str, Any] = {"cells": len(report.counting(cells)), "performed": done.estimates, "counts": number}
    result |= {"claims": [asdict(claim) for claim in made], "failed": failed, "not_run": done.problems}
    result |= {"files": [str(path) for path in files]}
    if beside is not None:
        result["against"] = beside.astype(object).where(beside.notna(), None).to_dict("records")
    lines = [
        f"{result['cells']} cells of {len(matrix.circumstances)} circumstances ({done.estimates} estimates made now)",
        table(["cells", *number["health"]], [[name, *one.values()] for name, one in number.items()]),
        "",
        table(["claim", "value", "target", ""], [[c.claim, c.value, c.target, c.outcome] for c in made]),
    ]
    if beside is not None:
        lines += ["", table(list(map(str, beside.columns)), beside.to_numpy().tolist())]
    lines += ["", *(f"NOT RUN: {problem}" for problem in done.problems.values())]
    lines += [*(f"FAILED: {line}" for line in failed), *map(str, files)]
    return Outcome(
        result, "\n".join(lines), not failed and not done.problems and all(claim.held is not False for claim in made)
    )
