"""`railsim discrepancy-benchmark`: hidden effects, blind, and how often the workflow is right."""

import argparse
import sys
from pathlib import Path
from typing import Any

from experiments.commands.interface import Outcome, table
from experiments.discrepancy.blind.benchmark import Cases, renew_expected, run_benchmark
from experiments.discrepancy.blind.benchmark_rows import kept
from experiments.discrepancy.blind.benchmark_score import page, read_rows, score
from experiments.discrepancy.rule import rule_hash
from railsim.errors import InputError
from railsim.files import replace_file

PAGE = "RESULTS.md"


def _part(text: str) -> tuple[int, int]:
    numbers = text.split("/")
    if len(numbers) == 2 and all(one.isdigit() for one in numbers) and int(numbers[0]) < int(numbers[1]):
        return int(numbers[0]), int(numbers[1])
    raise InputError(f"--part {text}: give I/N with I from 0 to N - 1, for example 0/2")


def execute(given: argparse.Namespace) -> Outcome:
    """Go on with the cases, then score all that are answered."""
    if given.cases < 1 or given.duration < 20.0:
        raise InputError("--cases: give a number from 1; --duration: at least 20 s")
    folder = Path(given.out)
    rule = given.score or rule_hash()
    cases = Cases(given.model, given.seed, given.duration, given.laws)
    store = Path(given.rows) if given.rows else None
    if given.score:
        renew_expected(cases, folder, rule, _say)
    else:
        first, step = _part(given.part)
        folder.mkdir(parents=True, exist_ok=True)
        run_benchmark(cases, folder, range(first, given.cases, step), _say, store)
    rows = read_rows(folder, rule, kept(store, rule, given.seed, given.duration) if store else ())
    if given.score and not rows:
        places = " or ".join(f"'{one}'" for one in (folder / "results", store) if one)
        asked = f"seed {given.seed} and {given.duration:g} s"
        raise InputError(f'--score {rule}: no row of that rule with {asked} in {places}; take the "rule" of a row')
    found = score(rows)
    folder.mkdir(parents=True, exist_ok=True)
    replace_file(folder / PAGE, page(rows, rule).encode())
    return Outcome(found | {"rule": rule}, f"rule {rule}\n" + _text(found))


def _say(text: str) -> None:
    print(text, file=sys.stderr)


def _text(found: dict[str, Any]) -> str:
    parts = []
    for head, rows in [("metric", found["metrics"]), ("right name by class", found["classes"])]:
        parts.append(table([head, "value", "from", "to", "cases"], [_row(name, one) for name, one in rows.items()]))
    for setting, rows in found["settings"].items():
        parts.append(table([setting, "value", "from", "to", "cases"], [_row(name, one) for name, one in rows.items()]))
    figures = [[*_row(name, one), one["least"], one["most"]] for name, one in found["figures"].items()]
    parts.append(table(["median of", "value", "from", "to", "cases", "least", "most"], figures))
    return "\n\n".join(parts)


def _row(name: str, one: dict[str, Any]) -> list[Any]:
    return [name, one["value"], one["low"], one["high"], one["cases"]]
