"""Blind benchmark: cases are made, explained by the frozen rule, and only then compared with their sealed labels."""

import hashlib
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.discrepancy.baseline.evidence import gather
from experiments.discrepancy.blind import oracle
from experiments.discrepancy.blind.benchmark_rows import keep, kept
from experiments.discrepancy.blind.blind_plan import nominal_of, setting_of
from experiments.discrepancy.blind.oracle import effect_of, evidence_over_named, expected_evidence, true_gap
from experiments.discrepancy.progress import Progress, silent
from experiments.discrepancy.result.answer import answer
from experiments.discrepancy.rule import rule_hash
from experiments.discrepancy.workflow import Findings, prepare
from railsim.errors import InputError
from railsim.files import json_text, read_json, replace_file
from railsim.scenario import Scenario

ROW = "a result of the benchmark"
OUTSIDE = ("withheld", "foreign")  # kinds of cases whose effect the workflow's library does not hold


@dataclass(frozen=True)
class Cases:
    """Which cases: all that follows from these is the same on every machine.

    Attributes
    ----------
    model : nominal scenario. duration : s, of each recording. laws : YAML file of effects from outside the library.
    """

    model: str
    seed: int
    duration: float
    laws: str = ""

    def nominal(self, number: int) -> Scenario:
        """The nominal scenario of a case."""
        return nominal_of(self.model, setting_of(self.seed, number), self.duration)


def run_benchmark(
    cases: Cases,
    folder: Path,
    numbers: Sequence[int],
    progress: Progress,
    rows: Path | None = None,
) -> None:
    """Those of the numbers that have no result of this rule yet; stop at any time, it goes on from there.

    `rows`: folder of what was answered elsewhere, to which it is added. Several processes can share folders if they
    have different numbers.

    Raises
    ------
    InputError : a case cannot be made.
    """
    rule = rule_hash()
    elsewhere = {one["case"] for one, _ in kept(rows, rule, cases.seed, cases.duration)} if rows else set()

    def label(number: int) -> dict[str, Any]:
        return read_json(folder / "sealed" / f"{number:04d}.json", "a label")

    for number in numbers:
        row = folder / "results" / f"{number:04d}.json"
        if number in elsewhere:
            continue
        if row.is_file() and read_json(row, ROW).get("rule") == rule:
            continue
        recording = folder / "recordings" / f"{number:04d}"
        if not recording.is_dir():
            _make(cases, folder, number)
        begun, worked = time.monotonic(), time.process_time()
        verdict, findings = _solve(cases.nominal(number), recording, label(number))
        spent = {"seconds": round(time.monotonic() - begun, 1), "cpu": round(time.process_time() - worked, 1)}
        found = {
            "rule": rule,
            "case": number,
            "seed": cases.seed,
            "duration": cases.duration,
            **spent,
            "memory": _peak(),
            "verdict": verdict,
        }
        row.parent.mkdir(parents=True, exist_ok=True)
        found |= _known_after(label(number), findings)
        _write(row, found)
        if rows:
            keep(rows, found, label(number))
        progress(f"case {number}: {verdict['status']} {verdict['effect'] or ''} in {spent['seconds']:.0f} s")


def _make(cases: Cases, folder: Path, number: int) -> None:
    """A case, in a process of its own."""
    given = [cases.model, str(folder), str(cases.seed), str(number), str(cases.duration)]
    command = [sys.executable, "-m", "experiments.discrepancy.blind.blind_cases", *given]
    done = subprocess.run(
        [*command, *([cases.laws] if cases.laws else [])], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise InputError(f"case {number} could not be made: {(done.stderr.strip() or 'no reason').splitlines()[-1]}")


def renew_expected(cases: Cases, folder: Path, rule: str, progress: Progress) -> None:
    """What the true effects of answered cases could bring, by the oracle as it is now; verdicts stay untouched.

    Rows say by which oracle they were valued; the first value is kept beside the new one.
    """
    now = hashlib.sha256(Path(str(oracle.__file__)).read_bytes()).hexdigest()[:16]
    for path in sorted((folder / "results").glob("*.json")):
        row = read_json(path, ROW)
        label = read_json(folder / "sealed" / path.name, "a label")
        if row.get("rule") != rule or row.get("oracle") == now or not label["effects"] or not row.get("expected"):
            continue
        problem = prepare(gather(folder / "recordings" / path.stem, cases.nominal(row["case"])), silent)
        effects = [effect_of(one) for one in label["effects"]]
        first = row.get("expected_at_first", row["expected"])
        found = expected_evidence(problem, effects, label["law"], label.get("specimen", {}))
        expected = [round(one, 2) for one in found]
        _write(path, row | {"expected": expected, "expected_at_first": first, "oracle": now})
        progress(f"case {row['case']}: expected {first} -> {expected}")


def _write(path: Path, row: dict[str, Any]) -> None:
    """Whole or not at all."""
    replace_file(path, json_text(row).encode())


def _known_after(label: dict[str, Any], findings: Findings | None) -> dict[str, Any]:
    """What each true effect could bring, and the gap of the true model, from the label, now that the verdict stands."""
    effects = [effect_of(one) for one in label["effects"]]
    if findings is None or not effects:
        return {"expected": [], "true_gap": None}
    truth = (effects, label["law"], label["specimen"])
    expected = [round(one, 2) for one in expected_evidence(findings.problem, *truth)]
    known: dict[str, Any] = {"expected": expected, "true_gap": None}
    with suppress(InputError):
        known["true_gap"] = true_gap(findings, *truth)
    if label["kind"] in OUTSIDE and findings.decision.status == "named":
        with suppress(InputError):
            known["over_named"] = evidence_over_named(findings.problem, findings.final, *truth)
    return known


def _solve(nominal: Scenario, recording: Path, label: dict[str, Any]) -> tuple[dict[str, Any], Findings | None]:
    """The verdict, or that the recording was refused; of the label only the withheld effect is used."""
    withheld = label["classes"][:1] if label["kind"] == "withheld" else []
    try:
        return answer(gather(recording, nominal), withheld=withheld)
    except (InputError, np.linalg.LinAlgError) as error:
        return {"status": "refused", "effect": None, "class": None, "alternatives": [], "reason": str(error)}, None


def _peak() -> float:
    """Most memory that this process has held so far [MiB]."""
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0, 1)
