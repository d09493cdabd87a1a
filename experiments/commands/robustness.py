"""`railsim robustness`: test railsim itself with damaged files, stops, flipped bits and full disks; resumes.

examples:
  railsim robustness --out robustness --share 0.01
"""

import argparse
from pathlib import Path

from experiments.reporting.outcome import Outcome
from railsim.errors import InputError


def configure(parser: argparse.ArgumentParser) -> None:
    """Kinds of fault, folder and size."""
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of the results; a run that stopped goes on")
    parser.add_argument("--only", metavar="KIND", action="append", default=[], help="kind of fault; default: all")
    parser.add_argument("--share", type=float, default=1.0, metavar="X", help="share of the cases, 0 to 1 (default: 1)")
    parser.add_argument("--slice", metavar="I/N", help="only every N-th case from the I-th on")
    parser.add_argument("--fast", action="store_true", help="one case in a hundred")


def execute(given: argparse.Namespace) -> Outcome:
    """Make the cases that are missing and write the table of all; exit code 1 where one is not as it should be."""
    from experiments.fault_injection.robustness.run import PAGE, page, perform
    from experiments.fault_injection.robustness.study import KINDS
    from railsim.files import replace_file
    from railsim.registry import pick

    for kind in given.only:
        pick(dict.fromkeys(KINDS), kind, "kind of fault")
    share = 0.01 if given.fast else given.share
    if not 0.0 < share <= 1.0:
        raise InputError(f"--share {share:g}: give a number above 0, at most 1")
    folder = Path(given.out)
    results = perform(folder, given.only or list(KINDS), share, given.slice)
    text = page(results)
    replace_file(folder / PAGE, text.encode())
    wrong = [f"{kind}, {one.target}: {', '.join(one.faults)}" for kind, one in results if one.faults]
    facts = {"table": str(folder / PAGE), "cases": len(results), "wrong": wrong}
    return Outcome(facts, f"{text}\n{folder / PAGE}: written", held=not wrong)
