"""The same recording written in seven formats and imported back is the same recording."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from estimators.speed.speed_refined import SpeedRefined
from experiments.cli import main
from railsim import Recording
from railsim.field.guard import Guard
from railsim.field.importing import import_file
from railsim.track.files import read_track, write_track
from tests.field.formats import WRITERS, save_map

ROUNDING = 1e-15  # two conversions of a 64-bit number: some units in the last place
STAMPS = {"hdf5": 0.5e-9}  # s, by which a format rounds times: whole nanoseconds in RCM-DX


@pytest.mark.parametrize("kind", list(WRITERS))
def test_format_gives_the_recording_back(kind: str, original: Recording, guard: Guard, place: Path, tmp_path: Path):
    before = original.measurements
    path, mapped = WRITERS[kind](before, place)
    done = import_file(path, save_map(mapped, place), tmp_path / "out", guard)
    after = Recording.open(tmp_path / "out").measurements
    assert after.channels == before.channels
    for name in before.channels:
        assert after.rate(name) == before.rate(name)
        np.testing.assert_allclose(
            after.time(name), before.time(name), rtol=ROUNDING, atol=STAMPS.get(kind, 0.0) + 1e-15
        )
        np.testing.assert_allclose(after[name], before[name], rtol=4 * ROUNDING, atol=1e-300)
        assert after.sensor(name) == before.sensor(name)
    assert after.vehicle == before.vehicle
    assert after.about["assumptions"] == done.notes.assumptions
    assert after.about["import"]["format"] == kind.removesuffix("73")
    assert not (tmp_path / "out" / "truth").exists()


def test_command_says_every_assumption_and_the_recording_serves(
    original: Recording, place: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    path, mapped = WRITERS["csv"](original.measurements, place)
    write_track(read_track(str(original.true_track)), place / "mine.csv")
    out = str(tmp_path / "out")
    words = ["import", str(path), "--map", str(save_map(mapped | {"track": "mine.csv"}, place)), "--out", out]
    assert main([*words, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    stored = json.loads((tmp_path / "out" / "about.json").read_text())
    assert said["assumptions"] == stored["assumptions"]
    assert any("decimal mark ','" in text for text in said["assumptions"])
    assert any("separated by ';'" in text for text in said["assumptions"])
    assert main(words) == 0
    assert all(text in capsys.readouterr().out for text in ["assumed: decimal mark ','"])
    assert main(["inspect", out]) == 0
    assert main(["estimate", "speed_refined", out, "--out", str(tmp_path / "speed")]) == 0
    track = Recording.open(out).measurements.track
    assert track is not None
    np.testing.assert_array_equal(track["vertical [m]"], read_track(str(original.true_track)).vertical)


def test_estimate_does_not_notice_the_import(original: Recording, guard: Guard, place: Path, tmp_path: Path):
    path, mapped = WRITERS["mdf4"](original.measurements, place)
    import_file(path, save_map(mapped, place), tmp_path / "out", guard)
    column = "speed [m/s]"
    before = SpeedRefined().estimate(original.measurements).series[column]
    after = SpeedRefined().estimate(Recording.open(tmp_path / "out").measurements).series[column]
    np.testing.assert_allclose(after, before, rtol=1e-9)
    assert abs(float(after.iloc[-1]) - 30.0) < 0.5


def test_older_recording_stays_where_the_import_fails(original: Recording, guard: Guard, place: Path, tmp_path: Path):
    path, mapped = WRITERS["tdms"](original.measurements, place)
    out = tmp_path / "out"
    shutil.copytree(original.folder, out)
    before = {one: one.read_bytes() for one in out.rglob("*") if one.is_file()}
    path.write_bytes(path.read_bytes()[:-1000])
    with pytest.raises(ValueError, match="data.tdms"):
        import_file(path, save_map(mapped, place), out, guard)
    assert {one: one.read_bytes() for one in out.rglob("*") if one.is_file()} == before
    assert sorted(one.name for one in tmp_path.iterdir()) == ["in", "out"]
