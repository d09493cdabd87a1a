"""Geometry of the crossover."""

import numpy as np
import pytest

from railsim.track import read_track
from railsim.track.features import features
from railsim.track.kernel import HEADING, build_tables, sample
from railsim.track.switches import Crossover, lateral_offset

SHAPE = Crossover()
S = np.arange(0.0, 260.0, 0.02)


def test_path_turns_by_the_crossing_angle_and_back() -> None:
    track = read_track("crossover_1in13")
    heading = sample(build_tables(track), HEADING, S)
    assert heading.max() == pytest.approx(1 / 13, rel=1e-5)
    assert heading[-1] == pytest.approx(0.0, abs=1e-9)
    between = np.abs(S - SHAPE.middle) < 7.0
    assert heading[between] == pytest.approx(np.full(between.sum(), 1 / 13), rel=1e-5)


def test_half_turn_about_the_middle_changes_nothing() -> None:
    x = np.linspace(0, 60, 601)
    after, before = SHAPE.curvature(SHAPE.middle + x), SHAPE.curvature(SHAPE.middle - x)
    assert after == pytest.approx(-before, abs=1e-15)
    dips = {(round(one.s, 3), one.side): one.depth for one in SHAPE.features()}
    other = {"left": "right", "right": "left"}
    for (s, side), depth in dips.items():
        assert dips[round(2 * SHAPE.middle - s, 3), other[side]] == depth


def test_tracks_are_a_british_six_foot_apart() -> None:
    assert lateral_offset(SHAPE.curvature(S), S)[-1] == pytest.approx(3.405, abs=0.02)


def test_features_are_toe_heel_crossing_and_back() -> None:
    found = features(read_track("crossover_1in13"))
    places = {one.label: one.s for one in found}
    assert list(places) == list("ABCDEF")
    assert places["F"] - places["A"] == pytest.approx(75.0)
    assert max(places.values()) + 100 < read_track("crossover_1in13").length
