"""Scores of estimates with known errors."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from experiments.runs.pipeline import score_all
from experiments.scoring.interface import stated
from experiments.scoring.score import score, score_rows, scorers, unscored
from railsim import InputError, Truth
from railsim.truth import TruthWriter

RATE, LENGTH = 100.0, 40.0


@pytest.fixture
def truth(tmp_path: Path) -> Truth:
    """Speed rises from 10 m/s by 0.5 m/s2 for 40 s."""
    time = np.arange(0.0, LENGTH + 1e-9, 1 / RATE)
    with TruthWriter(tmp_path / "truth", ["time [s]", "speed [m/s]"], RATE, {}) as writer:
        writer.append(np.column_stack([time, 10.0 + 0.5 * time]))
    return Truth.open(tmp_path / "truth")


def estimate(error: np.ndarray, **columns: np.ndarray) -> Estimate:
    """An estimate with that speed error in m/s at 20 Hz."""
    time = np.arange(error.size) / 20.0
    return Estimate("mine", pd.DataFrame({"time [s]": time, "speed [m/s]": 10.0 + 0.5 * time + error, **columns}))


def test_errors_are_those_that_were_put_in(truth: Truth):
    error = np.random.default_rng(1).normal(0.1, 0.2, 800)
    found = score(estimate(error), truth)
    assert found["rms error [m/s]"] == pytest.approx(np.sqrt(np.mean(error**2)))
    assert found["rms error [km/h]"] == pytest.approx(3.6 * found["rms error [m/s]"])
    assert found["largest error [km/h]"] == pytest.approx(3.6 * np.abs(error).max())
    assert found["99.9 % error [km/h]"] == pytest.approx(3.6 * np.quantile(np.abs(error), 0.999))
    assert found["bias [km/h]"] == pytest.approx(3.6 * error.mean())
    assert found["valid share [-]"] == 1.0
    assert "within 2 std [-]" not in found


def test_coverage_counts_errors_within_two_standard_deviations(truth: Truth):
    error = np.random.default_rng(2).normal(0.0, 0.2, 800)
    found = score(estimate(error, **{"speed_std [m/s]": np.full(800, 0.2)}), truth)
    assert found["within 2 std [-]"] == np.mean(np.abs(error) <= 0.4)
    assert 0.93 < found["within 2 std [-]"] < 0.98


def test_invalid_and_nan_samples_are_no_errors_but_a_share(truth: Truth):
    error = np.zeros(800)
    error[:200] = 50.0
    error[200:300] = np.nan
    found = score(estimate(error, **{"valid [-]": np.arange(800) >= 200}), truth)
    assert found["largest error [m/s]"] == pytest.approx(0.0, abs=1e-12)
    assert found["valid share [-]"] == 500 / 800


def test_estimate_that_is_never_valid_has_that_as_its_only_score(truth: Truth):
    assert score(estimate(np.full(800, np.nan)), truth) == {"valid share [-]": 0.0}


def test_estimate_of_another_record_is_refused(truth: Truth):
    with pytest.raises(InputError, match="covers 0 to 44.95 s, the truth 0 to 40 s"):
        score(estimate(np.zeros(900)), truth)


UNKNOWN = Estimate("mine", pd.DataFrame({"time [s]": [0.0], "colour [-]": [1.0], "colour_std [-]": [0.1]}))


def test_estimate_that_nothing_scores_has_no_scores_and_a_note(truth: Truth):
    assert score(UNKNOWN, truth) == {}
    assert unscored(UNKNOWN) == (
        "nothing scores column 'colour [-]' of estimate 'mine'; add a Scorer, see CONTRIBUTING.md"
    )


def test_scorer_whose_needs_are_not_met_is_not_asked_and_the_note_names_them(truth: Truth):
    over_distance = Estimate("mine", pd.DataFrame({"s [m]": [0.0], "speed [m/s]": [1.0]}))
    assert score(over_distance, truth) == {}
    assert "scorer 'speed' needs 'time [s]' beside it" in unscored(over_distance)


def test_number_that_the_about_of_an_estimate_lacks_is_named():
    assert stated(Estimate("mine", UNKNOWN.series, {"settings": {"corner": 2}}), "settings", "corner") == 2.0
    with pytest.raises(InputError, match="about of estimate 'mine' has no number settings > corner"):
        stated(UNKNOWN, "settings", "corner")


def test_run_keeps_the_scores_of_others_beside_an_estimate_that_has_none(truth: Truth):
    found = score_all({"good": estimate(np.zeros(100)), "long": estimate(np.zeros(900)), "mine": UNKNOWN}, truth)
    assert {row["estimator"] for row in found.rows} == {"good"}
    notes = [note.partition(" covers")[0] for note in found.notes]
    assert notes == ["long has no score: estimate 'mine'", unscored(UNKNOWN)]


def test_every_scorer_names_the_columns_that_it_scores_and_no_other_does():
    names = [column for scorer in scorers().values() for column in scorer.columns]
    assert len(names) == len(set(names))
    assert {column for column in names if not re.fullmatch(r"\S+ \[\S.*\]", column)} == set()


def test_rows_name_score_and_unit():
    assert score_rows("mine", {"99.9 % error [km/h]": 0.5}) == [
        {"estimator": "mine", "score": "99.9 % error", "value": 0.5, "unit": "km/h"}
    ]
