"""A slice of the study: cases are computed once, in any order the same, and counted by kind."""

import argparse
from pathlib import Path

import pytest

from experiments.fault_injection import study
from experiments.fault_injection.cases import Study
from experiments.fault_injection.kinds import FAULTS
from experiments.fault_injection.runs import PLACES

OPTIONS = argparse.Namespace(spoilt=2, clean=1, seed=72_000, shift=15.0, every=0, seconds=float("inf"))


def test_four_vehicles_and_six_tracks_and_at_least_sixteen_kinds():
    assert len({place["vehicle"] for place in PLACES.values()}) == 4
    assert len({place["track"] for place in PLACES.values()}) == 6
    assert len(FAULTS) >= 16


def test_a_study_that_is_broken_off_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    table = study.computed(tmp_path, OPTIONS)
    assert list(table["case"]) == [0, 1, 2]
    counts = study.by_kind(table).set_index("kind")
    assert list(counts.index) == ["offset", "offset step", "all"]
    assert counts.loc["all", "detected"] == 2
    assert list(table["alarms"])[2:] == [0]
    assert study.shares(table)[-1].startswith("false alarms: 0 of 1, 0.0 %")

    def never(self: Study, number: int) -> dict[str, object]:
        raise AssertionError(f"case {number} of {self.seed} stood there already")

    monkeypatch.setattr(Study, "spoilt", never)
    monkeypatch.setattr(Study, "clean", never)
    assert study.computed(tmp_path, OPTIONS).equals(table)


def test_clean_and_spoilt_cases_take_turns():
    assert sorted(study.in_turn(2, 3)) == [0, 1, 2, 3, 4]
    assert study.in_turn(2, 3)[:2] == [2, 0]
