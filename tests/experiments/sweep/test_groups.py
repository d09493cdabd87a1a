"""Groups of tasks, the runs that they ask for at once, and the table that is written in parts."""

import math
from collections import deque
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from experiments.sweep import table, truths
from experiments.sweep.executors import GROUP_SECONDS, MOST_IN_GROUP, Groups
from experiments.sweep.plan import make_plan
from experiments.sweep.settings import read_sweep
from experiments.sweep.task import perform, perform_group
from experiments.sweep.truths import Wanted
from railsim.errors import InputError
from railsim.scenario import load_scenario
from railsim.simulation import measure, simulate, simulate_held
from railsim.truth import HeldTruth
from tests.experiments.sweep.conftest import RUNS

SHORT = {"duration": 1.0, "output_rate": 256, "track_measured": False, "sensors": []}


def taken(seconds: float, count: int = 1000, workers: int = 2) -> list[int]:
    groups = Groups(range(count), workers)  # type: ignore[arg-type]
    sizes, seen = [], []
    while groups.left:
        group = groups.take()
        sizes.append(len(group))
        seen += group
        groups.learn({"began": 0.0, "ended": seconds})
    assert seen == list(range(count))
    return sizes


def test_groups_are_as_large_as_the_tasks_are_short():
    assert taken(100.0) == [1] * 1000
    short = taken(0.01)
    assert short[0] == 1
    assert max(short) == MOST_IN_GROUP
    assert short[-4:] == [1, 1, 1, 1], "at the end all workers have something to do"
    middle = taken(GROUP_SECONDS / 3.0)
    assert max(middle) == 3


def test_a_group_gives_what_its_tasks_give_one_by_one(sweep_file: Path, tmp_path: Path):
    tasks = make_plan(read_sweep(str(sweep_file))).tasks
    assert len(tasks) == RUNS
    together = perform_group(tasks[:3], str(tmp_path), False)
    for task, result in zip(tasks[:3], together, strict=True):
        assert result["rows"] == perform(task, str(tmp_path), False)["rows"]


def test_one_run_that_fails_leaves_the_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cache: Path):
    scenario = load_scenario("straight_erri_low", SHORT)
    wanted = [Wanted(scenario, "compiled", f"no{number}", tmp_path) for number in range(3)]
    made = deque([None, InputError("t = 3 s: off the rails"), None])
    real = truths.simulate_held

    def sometimes(*given: Any) -> HeldTruth:
        problem = made.popleft()
        if problem:
            raise problem
        return real(*given)

    monkeypatch.setattr(truths, "simulate_held", sometimes)
    first, second, third = truths.truths(wanted, keep=False)
    assert isinstance(first, HeldTruth)
    assert str(second) == "t = 3 s: off the rails"
    assert isinstance(third, HeldTruth)


def test_a_run_in_memory_is_the_one_on_the_disk(tmp_path: Path):
    """Bytes of the files, every column, and what sensors measure of either."""
    sensors = [{"kind": "gyro", "name": "bogie", "body": "bogie", "rate": 256, "errors": "mems"}]
    place = {"kind": "accelerometer", "name": "bogie", "body": "bogie", "rate": 128, "position": [1.0, 0.2, 0.1]}
    scenario = load_scenario("straight_erri_low", {**SHORT, "sensors": [*sensors, place]})
    held, stored = simulate_held(scenario, "compiled"), simulate(scenario, "compiled", tmp_path / "stored")
    again = held.write(tmp_path / "again")
    for name in ("about.json", "channels.parquet", ".railsim"):
        assert (again.folder / name).read_bytes() == (stored.folder / name).read_bytes()
    assert held.about == stored.about
    for name in stored.columns:
        np.testing.assert_array_equal(held[name], stored[name])
    for seed in (1, 2):
        of_held, of_stored = (measure(one, scenario, seed).measurements for one in (held, stored))
        for name in of_stored.channels:
            np.testing.assert_array_equal(of_held[name], of_stored[name])
    with pytest.raises(InputError, match="has no channel 'bogie.rol"):
        held["bogie.rol [rad]"]


def test_a_table_in_parts_is_the_table_in_one_piece(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Points whose tasks lie apart, a bad point between them, seeds in their own order; parts of seven rows."""
    tasks = [
        SimpleNamespace(number=number, points=[SimpleNamespace(number=one) for one in points])
        for number, points in enumerate([(0, 3, 6), (1, 4, 5)])
    ]
    sweep = SimpleNamespace(
        seeds=(3, 1), sets=[SimpleNamespace(name="a"), SimpleNamespace(name="b")], variants=[SimpleNamespace(label="v")]
    )
    bad = [[2, at, 0, seed, None, None, None, None, "failed", "no"] for at in (0, 1) for seed in (3, 1)]
    plan: Any = SimpleNamespace(
        tasks=tasks, sweep=sweep, bad={2: "no"}, points=7, runs=dict.fromkeys((0, 1, 3, 4, 5, 6), "run"),
        columns={"x": ("number", [float(one) for one in range(7)])}, bad_rows=lambda: bad,
    )  # fmt: skip

    def rows_of(task: Any) -> list[Any]:
        return [
            [point.number, at, 0, seed, "r", score, "m", 10.0 * point.number + at, "ok", ""]
            for point in task.points
            for seed in (1, 3)
            for at in (0, 1)
            for score in ("second", "first")
        ]

    monkeypatch.setattr(table, "_GROUP_ROWS", 7)
    assert table.write_table(plan, rows_of, tmp_path / "parts.parquet") == {"failed": 4, "ok": 48}
    frame = table.read_table(tmp_path / "parts.parquet")
    places = {3: 0, 1: 1}
    expected = sorted([*bad, *rows_of(tasks[0]), *rows_of(tasks[1])], key=lambda row: (*row[:3], places[row[3]]))
    assert frame[["point", "seed", "score"]].astype(object).where(frame.notna(), None).to_numpy().tolist() == [
        [row[0], row[3], row[5]] for row in expected
    ]
    assert np.isnan(frame["value"].to_numpy(float)[frame["point"].to_numpy() == 2]).all()
    assert bool(pd.isna(frame["run"].to_numpy()[frame["point"].to_numpy() == 2]).all())
    whole = pq.read_table(tmp_path / "parts.parquet")
    assert pq.read_metadata(tmp_path / "parts.parquet").num_row_groups == math.ceil(52 / 7)
    pq.write_table(
        whole, tmp_path / "whole.parquet", compression="zstd", compression_level=3, write_statistics=False,
        store_schema=False, row_group_size=7,
    )  # fmt: skip
    assert (tmp_path / "whole.parquet").read_bytes() == (tmp_path / "parts.parquet").read_bytes()


def test_runs_in_lanes_are_asked_for_together_and_score_as_others_do(sweep_file: Path, tmp_path: Path):
    """The same sweep by the engine `lanes`: the same rows, values within rounding."""
    text = sweep_file.read_text(encoding="utf-8")
    other = tmp_path / "lanes.yaml"
    other.write_text(f"engine: lanes\n{text}".replace("engine: compiled\n", ""), encoding="utf-8")
    plain = make_plan(read_sweep(str(sweep_file))).tasks
    lanes = make_plan(read_sweep(str(other))).tasks
    assert [task.run for task in lanes] != [task.run for task in plain], "another engine, another digest"
    for one, beside in zip(plain, perform_group(lanes, str(tmp_path), False), strict=True):
        rows = perform(one, str(tmp_path), False)["rows"]
        for row, given in zip(rows, beside["rows"], strict=True):
            assert [*row[:4], *row[5:7], *row[8:]] == [*given[:4], *given[5:7], *given[8:]]
            assert given[7] == row[7] or given[7] == pytest.approx(row[7], rel=1e-6, abs=1e-9)
