"""`railsim reproduce`: numbers are made anew, kept, and held against stored ones."""

import json
import math
from pathlib import Path

import pytest

from experiments.cli import build_parser
from experiments.reproduction import run
from experiments.reproduction.numbers import differences, numbers_in, read_stored, write_stored
from experiments.reproduction.run import words_of
from experiments.reproduction.slices import Slice, slices
from railsim.errors import InputError
from tests.experiments.conftest import ROOT, Command

ONE = Slice(name="one", page="README.md", command="figure fig02 --out {out}", hours=0.1, tolerance=0.01, small=1e-6)


@pytest.mark.parametrize("one", slices().values(), ids=list(slices()))
def test_every_slice_names_a_page_and_a_command_that_is_understood(one: Slice, tmp_path: Path):
    assert (ROOT / one.page).is_file()
    for fast in {False, one.fast is not None}:
        assert build_parser().parse_args(words_of(one, fast, tmp_path)).execute
    sizes = {size for name, size in read_stored() if name == one.name}
    assert sizes == ({"full", "fast"} if one.fast else {"full"}), "no stored numbers"


def test_stored_numbers_belong_to_slices():
    assert {name for name, _ in read_stored()} <= set(slices())


def test_fast_slices_give_the_stored_numbers(railsim_here: Command, tmp_path: Path):
    done = railsim_here("reproduce", "--fast", "--out", "reproduced", "--json")
    assert done.returncode == 0, done.stdout + done.stderr
    rows = json.loads(done.stdout)["numbers"]
    assert len(rows) >= len([one for one in slices().values() if one.fast])
    kept = sorted((tmp_path / "reproduced").glob("*.fast.json"))
    before = {path: path.stat().st_mtime_ns for path in kept}
    assert before
    assert railsim_here("reproduce", "--fast", "--out", "reproduced").returncode == 0
    assert {path: path.stat().st_mtime_ns for path in kept} == before
    changed = json.loads(kept[0].read_text())
    name = next(iter(changed["numbers"]))
    changed["numbers"][name] += 1.0
    kept[0].write_text(json.dumps(changed))
    worse = railsim_here("reproduce", "--fast", "--out", "reproduced")
    assert worse.returncode == 1 and name in worse.stdout


def test_numbers_differ_by_more_than_the_tolerance_or_are_missing():
    stored = {"near": 1.0, "far": 1.0, "gone": 1.0, "tiny": 0.0, "none": math.inf}
    made = {"near": 1.005, "far": 1.02, "new": 1.0, "tiny": 1e-7, "none": math.inf}
    found = {one.name: one.agrees for one in differences(ONE, stored, made)}
    assert found == {"near": True, "far": False, "gone": False, "tiny": True, "none": True, "new": False}


def test_stored_table_is_read_as_written(tmp_path: Path):
    numbers = {("one", "full"): {'a "quoted", long name': 0.125}, ("one", "fast"): {"b": -3.0}}
    write_stored(numbers, tmp_path / "stored.csv")
    assert read_stored(tmp_path / "stored.csv") == numbers


def test_numbers_of_every_kind_of_result():
    claim = {"claim": "peak", "value": 2.0, "target": "", "held": None}
    result = {"figures": {"f": {"claims": [claim]}}, "scores": [{"estimator": "e", "score": "rms", "value": 1}]}
    assert numbers_in(result) == {"f: peak": 2.0, "e: rms": 1.0}
    counted = {
        "metrics": {"right": {"value": 0.5, "low": 0.2, "high": 0.8, "cases": 9}},
        "figures": {"s": {"value": 3.0}},
    }
    assert numbers_in(counted) == {"right": 0.5, "right, from": 0.2, "right, to": 0.8, "s": 3.0}


def test_a_command_that_fails_is_named(tmp_path: Path):
    wrong = ONE.but(command="figure no_such_figure --out {out}")
    with pytest.raises(InputError, match="slice 'one' ended with 2"):
        run.perform([wrong], tmp_path, False)
    assert not list(tmp_path.glob("*.json"))


def test_slices_are_listed_with_hours(railsim_here: Command):
    done = railsim_here("reproduce", "--list")
    assert done.returncode == 0
    assert all(name in done.stdout for name in slices())
    assert "h of one core together" in done.stdout
    assert railsim_here("reproduce").returncode == 2
