"""Rows of a frozen rule are valued anew without touching verdicts, once, and only rows of that rule."""

from pathlib import Path

import pytest

from experiments.discrepancy.blind import benchmark
from experiments.discrepancy.blind.benchmark_rows import keep, kept
from experiments.discrepancy.blind.benchmark_score import read_rows
from railsim.errors import InputError
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
            "law": "polach",
        }
        row = {"rule": rule, "case": number, "expected": [5.0] * len(effects), "verdict": {"status": "none"}}
        for part, content in (("sealed", label), ("results", row)):
            (tmp_path / part).mkdir(exist_ok=True)
            write_json(tmp_path / part / f"{number:04d}.json", content)
    for name in ("nominal_of", "gather", "prepare"):
        monkeypatch.setattr(benchmark, name, lambda *given: None)
    monkeypatch.setattr(benchmark, "expected_evidence", lambda problem, effects, law, specimen: [50.0 for _ in effects])
    return tmp_path


def test_rows_are_valued_anew_once(folder: Path):
    said: list[str] = []
    for _ in range(2):
        benchmark.renew_expected(benchmark.Cases("model", 1, 24.0), folder, "old", said.append)
    assert len(said) == 1
    row = read_json(folder / "results" / "0000.json", "a row")
    assert (row["expected"], row["expected_at_first"], row["verdict"]) == ([50.0], [5.0], {"status": "none"})
    assert read_json(folder / "results" / "0002.json", "a row")["expected"] == [5.0]
    assert [row["case"] for row, _ in read_rows(folder, "old")] == [0, 1]
    assert read_rows(folder) == []


def test_rows_outlive_their_folder(folder: Path, tmp_path: Path):
    store = tmp_path / "rows"
    for row, label in read_rows(folder, "old"):
        keep(store, row | {"seed": 7, "duration": 24.0, "more": 1}, label)
    there = kept(store, "old", 7, 24.0)
    assert [row["case"] for row, _ in there] == [0, 1]
    others = [kept(store, "old", 8, 24.0), kept(store, "old", 7, 60.0), kept(store, "other", 7, 24.0)]
    assert others == [[], [], []] and kept(tmp_path / "none", "old", 7, 24.0) == []
    assert read_rows(tmp_path / "elsewhere", "old", there) == there
    assert [row["case"] for row, _ in read_rows(folder, "old", there)] == [0, 1]
    (path,) = store.iterdir()
    path.write_text("no row\n")
    with pytest.raises(InputError, match="line 1"):
        kept(store, "old", 7, 24.0)
    with pytest.raises(InputError, match="give a folder"):
        kept(path, "old", 7, 24.0)


def test_what_was_answered_elsewhere_is_not_asked_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    store, label = tmp_path / "rows", {"kind": "null", "effects": [], "classes": []}
    rule = {"rule": benchmark.rule_hash(), "seed": 7, "duration": 24.0, "verdict": {"status": "none"}}
    keep(store, rule | {"case": 0}, label)
    for part in ("sealed", "recordings/0001"):
        (tmp_path / part).mkdir(parents=True)
    write_json(tmp_path / "sealed" / "0001.json", label)
    monkeypatch.setattr(benchmark, "_solve", lambda *given: ({"status": "none", "effect": None}, None))
    cases = benchmark.Cases("yaw_dampers", 7, 24.0)
    benchmark.run_benchmark(cases, tmp_path, range(2), lambda text: None, store)
    assert [row["case"] for row, _ in kept(store, benchmark.rule_hash(), 7, 24.0)] == [0, 1]
    assert not (tmp_path / "results" / "0000.json").exists()
