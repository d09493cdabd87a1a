"""Studies of the half car: verdicts from kept tables are those that were said, other errors, longer records."""

import numpy as np
import pytest

from experiments.inference.policy import Policy
from experiments.inference.systems import half_car_truth as truth
from experiments.inference.systems.half_car import SCALES
from experiments.inference.systems.half_car_studies import OtherErrors, decided_anew, hypothesis_of, sensitivity

TABLE = [["rear friction", 8.0, 0.9], ["none", 0.0, 0.1], ["rear friction + small bump", 7.0, 0.0],
         ["unknown: force rear suspension", 1.0, 0.0], ["unknown: law of the rear damper", 2.0, 0.0]]  # fmt: skip
ROW = {"kind": "effect", "setting": "home", "effects": ["rear friction"], "families": ["friction"], "place": None,
       "table": TABLE}  # fmt: skip


def test_names_of_a_table_are_hypotheses_again():
    levels = OtherErrors(truth.make(np.random.default_rng(1)).record, times=1.0).levels
    for name, *_ in TABLE:
        assert hypothesis_of(name, levels).name == name
    assert hypothesis_of("unknown: force rear suspension", levels).place == "rear suspension"


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
