"""The benchmark of vehicles: cases that repeat, truth that stays hidden, rows that are judged."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.discrepancy.core.counting import dealt, read_rows
from experiments.discrepancy.core.model import Library, System
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.search import healthy_fit, places
from experiments.discrepancy.core.verdict import Verdict, decide
from experiments.discrepancy.railway import benchmark
from experiments.discrepancy.railway.answer import Answer, answer
from experiments.discrepancy.railway.benchmark import KINDS, NAME, case_of, run_benchmark, score
from experiments.discrepancy.railway.cases import VERTICAL
from experiments.discrepancy.railway.settings import Setting, settings
from experiments.discrepancy.recording.evidence import Evidence
from railsim.speed import Profile


def test_the_twelve_settings_can_be_told():
    assert len(settings()) == 12
    told = {name: one.nominal for name, one in settings().items()}
    assert len(told["whole vehicle, laden"].model.wheelsets) == 4 and len(told["home"].model.wheelsets) == 2
    assert isinstance(told["stop and go"].speed, Profile) and min(told["stop and go"].speed.speed) == 0.0
    assert {one.rate for one in told["floor box at 128 Hz"].sensors if one.kind != "gnss"} == {128}


def test_kinds_and_settings_are_dealt_evenly():
    names = tuple(settings())
    cases = [dealt(index, KINDS, names) for index in range(120)]
    assert {name: sum(setting == name for _, setting in cases) for name in names} == dict.fromkeys(names, 10)
    assert all(sum(one == ("null", name) for one in cases) == 5 for name in names)


def healthy_alone(system: System, library: Library, policy: Policy, limit: float, say: object) -> Verdict:
    """A search that looks for nothing."""
    assert limit > 0.0 and callable(say)
    return decide([healthy_fit(system, policy)], library, places(system.levels, library), policy)


def test_a_case_repeats_is_answered_once_and_judged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    two = Setting("yaw_dampers", {"duration": 12, "sensors": list(VERTICAL[:2])}, stated=False)
    monkeypatch.setattr(benchmark, "settings", lambda: {"two channels": two})
    withheld = KINDS.index("withheld")
    first, again = case_of(3, withheld), case_of(3, withheld)
    assert first.effects == again.effects and len(first.effects) == 1
    assert all(np.array_equal(first.recorded[name], again.recorded[name]) for name in first.recorded)
    assert "effects" not in first.recorded.about and "track" not in first.recorded.about
    asked: list[Sequence[str]] = []

    def few(evidence: Evidence, kinds: Sequence[str], **given: Any) -> Answer:
        asked.append(kinds)
        assert not evidence.track_errors_stated
        return answer(evidence, ("sensor_gain",), **given)

    monkeypatch.setattr(benchmark, "answer", few)
    monkeypatch.setattr(f"{answer.__module__}.infer", healthy_alone)
    said: list[str] = []
    for _ in range(2):
        run_benchmark(tmp_path, 3, [0, withheld], said.append, 100.0)
    assert len(said) == 2 and len(asked) == 2
    assert first.effects[0].settings()["kind"] in asked[0] and first.effects[0].settings()["kind"] not in asked[1]
    null, hidden = read_rows(tmp_path, NAME, 3)
    assert null["judged"] == hidden["judged"] == "undecided" and null["families"] == [] != hidden["families"]
    titles = {title: (hits, cases) for title, hits, cases, *_ in score([null, hidden])}
    assert titles["no answer, or undecided"] == (2, 2) and titles["healthy vehicles that are accused"] == (0, 1)
