"""Scores of the track's stiffness: made-up estimates of a made-up line, and of rails that do not give."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from experiments.scoring.track_stiffness import (
    RATIO,
    RATIO_STD,
    STIFFNESS,
    STIFFNESS_STD,
    TrackStiffnessScorer,
    true_stiffness,
)
from railsim.truth import TIME, Truth, TruthWriter

SPEED, RATE = 20.0, 200.0
SUPPORT = "track1.support_stiffness [N/m]"


def made(folder: Path, gives: bool = True) -> Truth:
    """20 s at 20 m/s from 30 m on: 50 MN/m up to 230 m, then 200 MN/m."""
    time = np.arange(20.0 * RATE) / RATE
    s = 30.0 + SPEED * time
    columns = {TIME: time, "s [m]": s} | ({SUPPORT: np.where(s < 230.0, 50e6, 200e6)} if gives else {})
    with TruthWriter(folder / "truth", list(columns), RATE, {}) as writer:
        writer.append(np.stack(list(columns.values()), axis=1))
    return Truth.open(folder / "truth")


def estimate(value: np.ndarray, std: float = 0.1) -> Estimate:
    """Windows of 20 m from the record's begin on; the ratio as the values have it."""
    middle = 10.0 + 20.0 * np.arange(len(value))
    known = np.isfinite(value)
    ratio = value / np.exp(np.mean(np.log(value[known]))) if known.any() else value
    table = {
        "s [m]": middle, TIME: middle / SPEED, STIFFNESS: value, STIFFNESS_STD: std * value, RATIO: ratio,
        RATIO_STD: std * ratio, "valid [-]": np.ones(len(value)),
    }  # fmt: skip
    return Estimate("made", pd.DataFrame(table), {"settings": {"length": 20.0, "axle": 1}})


def test_truth_of_a_window_is_its_geometric_mean(tmp_path: Path) -> None:
    """A window that changes from 50 to 200 MN/m in its middle has 100."""
    true = true_stiffness(estimate(np.ones(19)), made(tmp_path))
    assert true[:10] == pytest.approx(50e6, rel=0.02)
    assert true[11:] == pytest.approx(200e6, rel=0.02)
    shifted = Estimate(
        "made", pd.DataFrame({"s [m]": [200.0], TIME: [10.0]}), {"settings": {"length": 20.0, "axle": 1}}
    )
    assert true_stiffness(shifted, made(tmp_path / "again"))[0] == pytest.approx(100e6, rel=0.02)


def test_ten_per_cent_too_much(tmp_path: Path) -> None:
    """The level is wrong by 0.1, the ratio not at all; one window of ten is withheld."""
    truth = made(tmp_path)
    value = 1.1 * true_stiffness(estimate(np.ones(10)), truth)
    value[3] = np.nan
    scores = TrackStiffnessScorer().score(estimate(value, 0.06), truth)
    assert scores["track stiffness relative error [-]"] == pytest.approx(0.1)
    assert scores["track stiffness within 2 std [-]"] == 1.0
    assert scores["track stiffness within 90 % [-]"] == 0.0
    assert scores["ratio of track stiffness relative error [-]"] == pytest.approx(0.0, abs=1e-9)
    assert scores["track stiffness answered [-]"] == pytest.approx(0.9)


def test_a_stiffness_of_rigid_rails_is_wrong(tmp_path: Path) -> None:
    truth = made(tmp_path, gives=False)
    scores = TrackStiffnessScorer().score(estimate(np.full(10, 90e6)), truth)
    assert scores["track stiffness relative error [-]"] == 1.0
    assert scores["track stiffness within 2 std [-]"] == 0.0
    withheld = TrackStiffnessScorer().score(estimate(np.full(10, np.nan)), truth)
    assert withheld == {"track stiffness valid share [-]": 1.0, "track stiffness answered [-]": 0.0}
