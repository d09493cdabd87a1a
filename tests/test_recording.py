"""Recording: round trip, cut and inconsistent folders, no way from measurements to truth."""

import json
import os
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import estimators.interface
from railsim.errors import InputError
from railsim.recording import Measurements, Recording, write_recording
from railsim.truth import Truth, TruthWriter

ABOUT: dict[str, Any] = {
    "origin": "made by a test",
    "vehicle": {"name": "test", "semi_wheelbase": 1.3},
    "sensors": [{"kind": "gyro", "name": "bogie", "rate": 256.0, "channels": ["bogie.rate_pitch [rad/s]"]}],
}


def frames() -> dict[float, pd.DataFrame]:
    slow, fast = np.arange(40) / 8, np.arange(20_000) / 256
    return {
        256.0: pd.DataFrame({"time [s]": fast, "bogie.rate_pitch [rad/s]": np.sin(fast)}),
        8.0: pd.DataFrame({"time [s]": slow, "gnss.speed [m/s]": np.where(slow > 3, np.nan, 20 + slow)}),
    }


def truth_in(folder: Path) -> Truth:
    time = np.arange(300) / 1024
    with TruthWriter(folder, ["time [s]", "secret [m]"], 1024, {}) as writer:
        writer.append(np.column_stack([time, time**2]))
    return Truth.open(folder)


def write(tmp_path: Path, name: str = "recording") -> Path:
    track = pd.DataFrame({"s [m]": [0.0, 0.1, 0.3], "vertical [m]": [0.1 + 0.2, 0.0, -1e-5]})
    (tmp_path / "true.csv").write_text("# true\ns [m],vertical [m]\n0,0\n1,0\n")
    return write_recording(
        tmp_path / name,
        frames(),
        ABOUT,
        truth_in(tmp_path / "cache"),
        track=track,
        true_track=tmp_path / "true.csv",
        scenario="seed: 1\n",
    )


def test_round_trip(tmp_path: Path) -> None:
    recording = Recording.open(write(tmp_path))
    seen = recording.measurements
    assert seen.channels == ["gnss.speed [m/s]", "bogie.rate_pitch [rad/s]"]
    for rate, frame in frames().items():
        name = str(frame.columns[1])
        assert seen.rate(name) == rate
        np.testing.assert_array_equal(seen[name], frame[name])
        np.testing.assert_array_equal(seen.time(name), frame["time [s]"])
    assert seen.vehicle == ABOUT["vehicle"]
    assert seen.sensor("bogie.rate_pitch [rad/s]")["kind"] == "gyro"
    assert seen.about["software"]["numpy"] == np.__version__
    assert seen.track is not None
    assert seen.track["vertical [m]"].tolist() == [0.1 + 0.2, 0.0, -1e-5]
    assert recording.truth is not None
    assert recording.truth["secret [m]"][-1] == (299 / 1024) ** 2
    assert recording.scenario == "seed: 1\n"
    assert recording.true_track is not None
    assert recording.true_track.read_text().startswith("# true")


def test_without_truth_it_is_a_blind_challenge(tmp_path: Path) -> None:
    folder = write(tmp_path)
    for path in (folder / "truth").iterdir():
        path.unlink()
    (folder / "truth").rmdir()
    recording = Recording.open(folder)
    assert (recording.truth, recording.scenario, recording.true_track) == (None, None, None)
    assert "gnss.speed [m/s]" in recording.measurements


def test_same_contents_same_bytes(tmp_path: Path) -> None:
    one, other = write(tmp_path, "one"), write(tmp_path, "other")
    paths = sorted(path.relative_to(one) for path in one.rglob("*") if path.is_file())
    assert len(paths) == 10
    for path in paths:
        assert (one / path).read_bytes() == (other / path).read_bytes()


def test_measurements_know_no_way_to_the_truth(tmp_path: Path) -> None:
    recording = Recording.open(write(tmp_path))
    held = pickle.dumps(recording.measurements)
    assert str(tmp_path).encode() not in held
    assert b"secret" not in held
    names = set(dir(recording.measurements)) | set(vars(recording.measurements))
    assert not [name for name in names if "truth" in name or "folder" in name or "path" in name]
    for value in vars(recording.measurements).values():
        assert not isinstance(value, Truth | Recording | Path)
    assert b"secret" not in (recording.folder / "about.json").read_bytes()


def test_samples_cannot_be_changed(tmp_path: Path) -> None:
    seen = Recording.open(write(tmp_path)).measurements
    with pytest.raises(ValueError, match="read-only"):
        seen["gnss.speed [m/s]"][0] = 1.0


def test_unknown_channel_lists_those_there_are() -> None:
    seen = Measurements(ABOUT, frames())
    with pytest.raises(InputError, match=r"no measured channel 'x'; there are: gnss.speed \[m/s\], bogie"):
        seen["x"]
    with pytest.raises(InputError, match="no sensor in about.json states"):
        seen.sensor("gnss.speed [m/s]")


def test_an_older_recording_is_replaced_whole_and_others_folders_never(tmp_path: Path) -> None:
    folder = write(tmp_path)
    write_recording(folder, {8.0: frames()[8.0]}, ABOUT)
    assert Recording.open(folder).measurements.channels == ["gnss.speed [m/s]"]
    assert sorted(os.listdir(folder)) == [".railsim", "about.json", "measured"]
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("words")
    with pytest.raises(InputError, match="did not write; name a new or empty one"):
        write_recording(tmp_path / "mine", frames(), ABOUT)
    assert os.listdir(tmp_path / "mine") == ["thesis.txt"]
    with pytest.raises(InputError, match="cannot write"):
        write_recording(tmp_path / "mine" / "thesis.txt" / "recording", frames(), ABOUT)


@pytest.mark.parametrize("part", ["measured/256hz.parquet", "about.json", "truth/channels.parquet", "truth/about.json"])
def test_cut_in_half_is_one_clear_line(tmp_path: Path, part: str) -> None:
    path = write(tmp_path) / part
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"cut short|SHA-256") as caught:
        Recording.open(tmp_path / "recording")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("part", "line"),
    [("about.json", r"has no about\.json"), ("measured/8hz.parquet", r"must hold the tables 256hz.parquet, 8hz")],
)
def test_missing_part_is_one_clear_line(tmp_path: Path, part: str, line: str) -> None:
    (write(tmp_path) / part).unlink()
    with pytest.raises(InputError, match=line):
        Recording.open(tmp_path / "recording")


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"format": "other"}, "does not state the format 'railsim recording'"),
        ({"format_version": 9}, "has format version 9; this railsim reads 1"),
        ({"measured": {"8hz.parquet": {"rows": 40}, "256hz.parquet": {"rows": 7}}}, "has 20000 rows where"),
        ({"vehicle": None}, '"vehicle" is missing'),
        ({"origin": None}, '"origin" is missing'),
        ({"sensors": [{}]}, 'sensor 1 has no "name"'),
    ],
)
def test_description_that_does_not_fit_is_one_clear_line(tmp_path: Path, change: dict[str, Any], line: str) -> None:
    path = write(tmp_path) / "about.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(InputError, match=line) as caught:
        Recording.open(tmp_path / "recording")
    assert "\n" not in str(caught.value)
    path.write_text("[1]")
    with pytest.raises(InputError, match="one JSON object"):
        Recording.open(tmp_path / "recording")


TIME = np.arange(10) / 8


@pytest.mark.parametrize(
    ("tables", "line"),
    [
        ({}, "at least one measured channel"),
        ({8: {"time [s]": TIME, "a.b [m]": TIME[:-1]}}, "has 9 samples for 10 times"),
        ({8: {"time [s]": TIME[::-1], "a.b [m]": TIME}}, "does not increase at row 2"),
        ({8: {"time [s]": np.where(TIME > 1, np.nan, TIME)}}, "does not increase at row 10"),
        ({9: {"time [s]": TIME, "a.b [m]": TIME}}, "stated as 9 Hz follow each other at 8 Hz"),
        ({8: {"a.b [m]": TIME}}, "must begin with the column"),
        ({8: {"time [s]": TIME, "a.b": TIME}}, "name it"),
        ({8: {"time [s]": TIME, "a.b [m]": np.full(10, np.inf)}}, "holds infinity"),
        ({8: {"time [s]": TIME, "a.b [m]": ["x"] * 10}}, "not a number"),
        ({8: {"time [s]": TIME, "a.b [m]": TIME}, 16: {"time [s]": TIME / 2, "a.b [m]": TIME}}, "appears twice"),
    ],
)
def test_tables_that_cannot_be_used_are_one_clear_line(tables: dict[float, Any], line: str) -> None:
    with pytest.raises(InputError, match=line) as caught:
        Measurements(ABOUT, tables)
    assert "\n" not in str(caught.value)


def test_measured_track_is_checked(tmp_path: Path) -> None:
    folder = write(tmp_path)
    for text, line in [("x,y\n1,2\n", "must begin with"), ("s [m],vertical [m]\n1,0\n0,0\n", "increase at row 2")]:
        (folder / "track.csv").write_text(text)
        with pytest.raises(InputError, match=line):
            Recording.open(folder)


def test_estimators_can_take_measurements() -> None:
    assert isinstance(Measurements(ABOUT, frames()), estimators.interface.Measurements)
