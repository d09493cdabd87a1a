"""Rows of a frozen rule are valued anew without touching verdicts, once, and only rows of that rule."""

from pathlib import Path

import pytest

from experiments.discrepancy import benchmark
from experiments.discrepancy.benchmark_score import read_rows
from railsim.files import read_json, write_json


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Three answered cases: an effect and a null of rule "old", an effect of another rule."""
    damper = {"kind": "weak_yaw_damper", "factor": 0.3}
    for number, (rule, effects) in enumerate([("old", [damper]), ("old", []), ("other", [damper])]):
        label = {
            "kind": "effect" if effects else "null",
            "effects": effects,
            "classes": ["weak_yaw_damper"] * len(effects),
        }
        row = {"rule": rule, "case": number, "expected": [5.0] * len(effects), "verdict": {"status": "none"}}
        for part, content in (("sealed", label), ("results", row)):
            (tmp_path / part).mkdir(exist_ok=True)
            write_json(tmp_path / part / f"{number:04d}.json", content)
    for name in ("nominal_of", "gather", "prepare"):
        monkeypatch.setattr(benchmark, name, lambda *given: None)
    monkeypatch.setattr(benchmark, "expected_evidence", lambda problem, effects: [50.0 for _ in effects])
    return tmp_path


def test_rows_are_valued_anew_once(folder: Path):
    said: list[str] = []
    for _ in range(2):
        benchmark.renew_expected("model", folder, 1, 24.0, "old", said.append)
    assert len(said) == 1
    row = read_json(folder / "results" / "0000.json", "a row")
    assert (row["expected"], row["expected_at_first"], row["verdict"]) == ([50.0], [5.0], {"status": "none"})
    assert read_json(folder / "results" / "0002.json", "a row")["expected"] == [5.0]
    assert [row["case"] for row, _ in read_rows(folder, "old")] == [0, 1]
    assert read_rows(folder) == []
