"""Studies of the half car: verdicts from kept tables are those that were said, other errors, longer records."""

from pathlib import Path

import numpy as np
import pytest

from experiments.cli import main
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.systems import half_car_truth as truth
from experiments.discrepancy.systems.half_car import SCALES
from experiments.discrepancy.systems.half_car_policy import read_policy
from experiments.discrepancy.systems.half_car_studies import OtherErrors, decided_anew, hypothesis_of, sensitivity
from railsim.errors import InputError

TABLE = [["rear friction", 8.0, 0.9], ["none", 0.0, 0.1], ["rear friction + small bump", 7.0, 0.0],
         ["unknown: rear suspension", 1.0, 0.0], ["unknown: law of the rear damper", 2.0, 0.0]]  # fmt: skip
ROW = {"kind": "effect", "setting": "home", "effects": ["rear friction"], "families": ["friction"], "place": None,
       "table": TABLE}  # fmt: skip


def test_names_of_a_table_are_hypotheses_again():
    levels = OtherErrors(truth.make(np.random.default_rng(1)).record, times=1.0).levels
    for name, *_ in TABLE:
        assert hypothesis_of(name, levels).name == name
    assert hypothesis_of("unknown: rear suspension", levels).place == "rear suspension"


def test_a_policy_that_hardly_believes_in_effects_says_none():
    assert str(decided_anew(ROW, Policy())) == "friction"
    assert str(decided_anew(ROW, Policy().but({"effect": 1e-5, "pair": 1e-6}))) == "none"
    rows = {title: right for title, _, right, *_ in sensitivity([ROW])}
    assert rows["as it is"] == 1 and set(rows.values()) <= {1, 0, -1} and len(rows) == 1 + 2 * 13


def test_latent_levels_are_held_or_left_out():
    record = truth.make(np.random.default_rng(1)).record
    held, none = OtherErrors(record, times=1.0).levels, OtherErrors(record, times=0.0).levels
    for level in held:
        if level.name in SCALES:
            assert np.exp(level.prior.middle) == pytest.approx(SCALES[level.name])
    assert all(level.place is None for level in none)


def test_longer_records_are_longer():
    case = truth.make(np.random.default_rng(2), duration=8.0)
    assert case.record.seen.shape == (5, 1600)


def test_a_policy_of_a_file_is_taken(tmp_path: Path):
    path = tmp_path / "policy.yaml"
    path.write_text("numbers: {losses.miss: 7.0}\nscales: {force body: 0.02}\n")
    policy, scales = read_policy(path)
    assert policy.losses.miss == 7.0 and policy.none == Policy().none
    assert scales["force body"] == 0.02 and scales["force front axle"] == SCALES["force front axle"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[1]", "give 'numbers' and 'scales'"),
        ("scales: {force wing: 0.1}", "there is no level 'force wing'"),
        ("scales: {force body: much}", "must be a number"),
        ("numbers: {lossses.miss: 1}", "there is no number"),
    ],
)
def test_a_wrong_policy_file_is_refused(tmp_path: Path, text: str, words: str):
    (tmp_path / "policy.yaml").write_text(text)
    with pytest.raises(InputError, match=words):
        read_policy(tmp_path / "policy.yaml")


def test_a_study_of_cases_that_were_not_asked_says_so(tmp_path: Path):
    arguments = ["discrepancy-benchmark", "--system", "half_car", "--study", "sensitivity", "--out", str(tmp_path)]
    assert main(arguments) == 2
