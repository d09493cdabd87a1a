"""Calibration and scores of the adhesion estimators."""

from pathlib import Path

import numpy as np
import pytest

from estimators.adhesion.classifier import LEVELS, Classifier
from experiments.calibration.adhesion import TRACKS, Windows, fit, write
from experiments.runs.adhesion import CLEAR, between, recording, run, scenario, sensors, spliced
from experiments.runs.adhesion_unseen import TRACKS as UNSEEN
from experiments.runs.unseen_tracks import SEEDS
from experiments.scoring.adhesion_level import true_level
from railsim.contact.adhesion import CONDITIONS


def made_up(spread: float) -> Windows:
    """Windows whose first feature is the level plus noise; where the noise is large the level cannot be known."""
    rng = np.random.default_rng(11)
    track = np.repeat(np.arange(len(TRACKS)), 60)
    level = rng.integers(0, len(LEVELS), len(track))
    speed = rng.uniform(15.0, 45.0, len(track))
    features = np.column_stack([level + spread * rng.standard_normal(len(track)), rng.standard_normal(len(track))])
    return Windows(features, speed, level, track)


def test_fit_is_sure_where_levels_are_apart_and_not_where_they_are_not():
    apart, mixed = fit(made_up(0.1)), fit(made_up(1.0))
    assert apart["right on tracks left out"] > 0.98
    data = made_up(1.0)
    stated = Classifier.read(mixed).probabilities(data.features, data.speed)
    right = stated.argmax(axis=1) == data.level
    assert 0.35 < right.mean() < 0.75  # Bayes: 0.54 for levels one standard deviation apart
    assert stated.max(axis=1).mean() == pytest.approx(right.mean(), abs=0.05)


def test_the_file_keeps_other_vehicles(tmp_path: Path):
    path = tmp_path / "calibration.json"
    write(path, "one", {"bogie, 10 s": fit(made_up(0.1))})
    write(path, "two", {"bogie, 10 s": fit(made_up(1.0))})
    text = path.read_text(encoding="utf-8")
    assert '"one"' in text
    assert '"two"' in text


def test_unseen_tracks_are_none_of_the_calibration():
    assert {track.seed for track in TRACKS}.isdisjoint(SEEDS.values())
    assert {track.spectrum for track in TRACKS}.isdisjoint(UNSEEN)


def test_between_two_levels_lies_the_geometric_mean():
    middle = between("dry", "wet")
    share = 0.5 * (middle["k_adhesion"] + middle["k_slip"])
    low, high = CONDITIONS["wet"].initial_share, CONDITIONS["dry"].initial_share
    assert low < share < high


@pytest.mark.parametrize("level", LEVELS)
def test_level_of_truth_is_that_of_the_run(level: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("RAILSIM_CACHE", str(tmp_path))
    settings = {"track": "straight_erri_low", "vehicle": {"name": "class175", "adhesion": level}}
    truth, _ = run(scenario(settings, 30.0, 1.0, sensors()), 1)
    assert set(true_level(truth).tolist()) == {LEVELS.index(level)}


def test_what_a_vehicle_really_is_does_not_stand_in_its_recording():
    settings = {"track": "straight_erri_low", "vehicle": {"name": "class175"}, "start": CLEAR}
    known = recording(settings, 30.0, 1.0, sensors(), 1)
    unknown = recording(settings, 30.0, 1.0, sensors(), 1, {"body_mass": 20000.0})
    assert known.about == unknown.about
    channel = "body.acceleration_y [m/s2]"
    assert not np.array_equal(known[channel], unknown[channel])
    joined = spliced(known, unknown, 0.5)
    early = known.time(channel) < 0.5
    assert np.array_equal(joined[channel][early], known[channel][early])
    assert np.array_equal(joined[channel][~early], unknown[channel][~early])
