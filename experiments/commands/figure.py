"""`railsim figure`: draw figures of the paper and of this project, and check their claims.

examples:
  railsim figure fig02 --out figures
  railsim figure all --out figures --fast
"""

import argparse
import os
from pathlib import Path
from typing import Any

from experiments.reporting.outcome import Outcome
from experiments.reporting.text import table
from railsim.errors import InputError


def configure(parser: argparse.ArgumentParser) -> None:
    """Figure, folder and size."""
    parser.add_argument("name", metavar="NAME|all", help="see 'railsim list figures'")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of the pictures and tables")
    parser.add_argument("--fast", action="store_true", help="shorter runs, the compiled engine")
    cores = len(os.sched_getaffinity(0))
    text = f"processes, where all figures are drawn, or one in parts (default: {cores})"
    parser.add_argument("--jobs", type=int, default=cores, metavar="N", help=text)


def execute(given: argparse.Namespace) -> Outcome:
    """Write NAME.png, NAME.svg and NAME.csv of each figure that is asked for; exit code 1 where a claim is not held.

    Of all figures, those that are finished in the folder are not made again; of one that was stopped, its parts.
    """
    from experiments.figures.interface import FIGURES
    from experiments.figures.parted import parts_of
    from experiments.figures.session import publish_all, publish_one
    from experiments.reporting.claims import Claim
    from experiments.reporting.size import Size

    if given.jobs < 1:
        raise InputError(f"--jobs {given.jobs}: give a number from 1")
    chosen = FIGURES.classes().values() if given.name == "all" else [FIGURES.resolve(given.name)]
    asked = {figure.name: figure for figure in (kind() for kind in chosen)}
    size = Size.FAST if given.fast else Size.FULL
    results: dict[str, Any]
    if given.name == "all" or any(parts_of(figure, size) for figure in asked.values()):
        results = publish_all(list(asked), Path(given.out), size, given.jobs, again=given.name != "all")
    else:
        results = {name: publish_one(figure, Path(given.out), size) for name, figure in asked.items()}
    claims = [(name, Claim(**claim)) for name, result in results.items() for claim in result["claims"]]
    rows = [[name, c.claim, c.value, c.target, c.outcome, c.interval] for name, c in claims]
    files = [path for result in results.values() for path in result["files"]]
    text = table(["figure", "claim", "value", "target", "", "95 % interval"], rows) if rows else "No claims."
    notes = [f"{name}: {note}" for name, figure in asked.items() for note in figure.notes()]
    held = all(claim.held is not False for _, claim in claims)
    return Outcome({"figures": results}, "\n".join([text, "", *notes, *files]), held)
