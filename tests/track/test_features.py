"""Features of a track: comment lines there and back, and who gets to see them."""

import pytest

from railsim.errors import InputError
from railsim.recording import Recording
from railsim.scenario import Scenario
from railsim.simulation import measure, simulate
from railsim.track import Track, read_track, write_track
from railsim.track.features import MARK, Feature, features, from_stated, parse, with_features

JOINT = Feature("joint", 12.5, "left", 0.004, 0.011, 1.2)


def test_features_go_through_a_file(tmp_path) -> None:
    late = Feature("crossing", 20.0, label="C")
    track = with_features(Track([0, 10, 20, 30], {"vertical": [0.0] * 4}, "t", ["made by hand"]), [late, JOINT])
    write_track(track, tmp_path / "t.csv")
    again = read_track(tmp_path / "t.csv")
    assert features(again) == [JOINT, late]
    assert again.comments[0] == "made by hand"
    assert from_stated(JOINT.stated()) == JOINT


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("joint at 5 m", "not JSON"),
        ('{"kind": "joint"}', "'s \\[m\\]' is missing"),
        ('{"kind": "joint", "s [m]": "five"}', "five"),
        ('{"kind": "joint", "s [m]": 5, "deep": 1}', "unknown key 'deep'"),
        ('{"kind": "joint", "s [m]": 5, "side": "top"}', "side is 'top'"),
        ("[1]", "no keys"),
    ],
)
def test_bad_features_are_named(text: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        parse(MARK + text)


def test_truth_states_features_and_measured_track_does_not(tmp_path) -> None:
    values = {
        "track": "crossover_1in13",
        "vehicle": "class175",
        "speed": {"kind": "constant", "speed": 20.0},
        "duration": 0.1,
        "sensors": [{"kind": "gyro", "name": "bogie", "body": "bogie", "rate": 256}],
    }
    scenario = Scenario.build(values)
    recording = measure(simulate(scenario, engine="compiled"), scenario, folder=tmp_path / "recording")
    assert recording.truth is not None
    stated = [from_stated(values) for values in recording.truth.about["features"]]
    assert stated == features(scenario.geometry)
    assert "".join(sorted({feature.label for feature in stated})) == "ABCDEF"
    folder = Recording.open(tmp_path / "recording").folder
    assert MARK in (folder / "truth" / "track.csv").read_text()
    assert MARK not in (folder / "track.csv").read_text()
    assert "features" not in (folder / "about.json").read_text()
