"""Blind benchmark: cases are made, explained by the frozen rule, and only then compared with their sealed labels."""

import hashlib
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from experiments.discrepancy.evidence import gather
from experiments.discrepancy.explain import answer
from experiments.discrepancy.oracle import effect_of, expected_evidence
from experiments.discrepancy.workflow import Findings
from railsim import effects as library
from railsim.errors import InputError
from railsim.files import read_json, write_json
from railsim.scenario import load_scenario

ROW = "a result of the benchmark"


def rule_hash() -> str:
    """SHA-256 over the source of the workflow and of the effects: rows of other rules do not count."""
    folders = [Path(__file__).parent, Path(str(library.__file__)).parent]
    total = hashlib.sha256()
    for path in sorted(path for folder in folders for path in folder.glob("*.py")):
        if path.name not in ("benchmark.py", "benchmark_score.py", "report.py", "pictures.py"):
            total.update(path.name.encode() + b"\0" + path.read_bytes())
    return total.hexdigest()[:16]


def run_benchmark(
    model: str,
    folder: Path,
    count: int,
    seed: int,
    duration: float,
    tell: Callable[[str], None],
    laws: str = "",
    part: tuple[int, int] = (0, 1),
) -> None:
    """All cases that have no result of this rule yet; stop at any time, it goes on from there.

    `laws`: YAML file of effects from outside the library. `part` (i, n): every n-th case from the i-th on, so that
    several processes can share a folder.
    """
    rule = rule_hash()
    for number in range(part[0], count, part[1]):
        row = folder / "results" / f"{number:04d}.json"
        if row.is_file() and read_json(row, ROW).get("rule") == rule:
            continue
        recording = folder / "recordings" / f"{number:04d}"
        if not recording.is_dir():
            make = [model, str(folder), str(seed), str(number), str(duration), *([laws] if laws else [])]
            command = [sys.executable, "-m", "experiments.discrepancy.blind_cases", *make]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                raise InputError(
                    f"case {number} could not be made: {(done.stderr.strip() or 'no reason').splitlines()[-1]}"
                )
        begun = time.monotonic()
        verdict, findings = _solve(model, recording, duration, _withheld(folder, number))
        row.parent.mkdir(parents=True, exist_ok=True)
        seconds = round(time.monotonic() - begun, 1)
        found = {"rule": rule, "case": number, "seed": seed, "seconds": seconds, "verdict": verdict}
        write_json(row, found | {"expected": _expected(folder, number, findings)})
        tell(f"case {number}: {verdict['status']} {verdict['effect'] or ''} in {seconds:.0f} s")


def _withheld(folder: Path, number: int) -> list[str]:
    """Effects that the workflow must do without in this case; all else of the label stays sealed."""
    label = read_json(folder / "sealed" / f"{number:04d}.json", "a label")
    return [label["classes"][0]] if label["kind"] == "withheld" else []


def _expected(folder: Path, number: int, findings: Findings | None) -> list[float]:
    """What each true effect could bring, from the label, now that the verdict stands."""
    label = read_json(folder / "sealed" / f"{number:04d}.json", "a label")
    effects = [effect_of(one) for one in label["effects"]]
    return [round(one, 2) for one in expected_evidence(findings.problem, effects)] if findings and effects else []


def _solve(model: str, recording: Path, duration: float, withheld: list[str]) -> tuple[dict[str, Any], Findings | None]:
    """The verdict, or that the recording was refused."""
    try:
        evidence = gather(recording, load_scenario(model, {"duration": duration}))
        return answer(evidence, withheld=withheld)
    except InputError as error:
        return {"status": "refused", "effect": None, "class": None, "alternatives": [], "reason": str(error)}, None
