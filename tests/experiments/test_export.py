"""`railsim export`: what was measured or estimated goes to other programs and comes back."""

import json
import re
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from railsim import Recording
from railsim.field import exporting
from railsim.field.writers.interface import Content, Sheet
from railsim.field.writers.mat import identifiers
from railsim.measurements import Measurements
from railsim.recording import write_recording
from tests.experiments.conftest import Command

PITCH, GNSS = "bogie.rate_pitch [rad/s]", "gnss.speed [m/s]"


def refused(done: CompletedProcess[str], words: str) -> None:
    assert done.returncode == 2 and words in done.stderr and done.stderr.count("\n") == 1, done.stderr


def same(after: Measurements, before: Measurements) -> None:
    assert after.channels == before.channels
    for name in before.channels:
        assert after.rate(name) == before.rate(name)
        np.testing.assert_allclose(after.time(name), before.time(name), rtol=1e-15, atol=1e-12)
        np.testing.assert_array_equal(after[name], before[name])


@pytest.fixture
def lossy(tmp_path: Path) -> Path:
    """Two rates that share few instants, lost samples, a known start and a vehicle of which little is known."""
    fast, slow = np.arange(600) / 100, np.arange(18) / 3
    rate = np.sin(fast) * 1e-3 + 1e-12
    rate[[0, 5, 6, 599]] = np.nan
    frames = {
        100.0: pd.DataFrame({"time [s]": fast, PITCH: rate, "bogie.acceleration_z [m/s2]": np.cos(7 * fast)}),
        3.0: pd.DataFrame({"time [s]": slow, GNSS: np.linspace(11, 17, 18)}),
    }
    about: dict[str, Any] = {"origin": "bogie 7, Zürich", "vehicle": {"name": "mine", "semi_wheelbase": 1.3}}
    about |= {"sensors": [], "speed_source": GNSS, "start": "2024-05-03T10:00:00.250000+00:00"}
    return Path(write_recording(tmp_path / "lossy", frames, about))


@pytest.mark.parametrize("ending", exporting.READABLE)
def test_recording_comes_back(ending: str, railsim_here: Command, recording: Path, lossy: Path):
    for folder in (recording, lossy):
        file, out = f"{folder.name}{ending}", f"back_{folder.name}"
        done = railsim_here("export", folder, "--to", file, "--map", "map.yaml", "--overwrite")
        assert done.returncode == 0, done.stderr
        done = railsim_here("import", file, "--map", "map.yaml", "--out", out)
        assert done.returncode == 0, done.stderr
        after, before = Recording.open(out).measurements, Recording.open(folder).measurements
        same(after, before)
        assert after.vehicle == before.vehicle
        assert after.about["sensors"] == before.about["sensors"]
        assert after.about.get("speed_source") == before.about.get("speed_source")
        if ending == ".mf4":
            assert after.about.get("start") == before.about.get("start")


def _columns(path: Path) -> dict[str, np.ndarray]:
    """As pandas, scipy and asammdf read them, without railsim."""
    if path.suffix == ".csv":
        table = pd.read_csv(path)
    elif path.suffix == ".parquet":
        table = pd.read_parquet(path)
    elif path.suffix == ".mat":
        from scipy.io import loadmat

        held = loadmat(path, squeeze_me=True, simplify_cells=True)["speed_plain"]
        return {held["names"][field]: held[field] for field in held["names"]}
    else:
        from asammdf import MDF

        with MDF(path) as file:
            found = {f"{one.name} [{one.unit}]": one.samples for one in file.iter_channels()}
            return {"s [m]": file.get_master(0), **found}
    return {str(name): table[name].to_numpy() for name in table}


@pytest.mark.parametrize("ending", exporting.READABLE)
def test_estimate_in_other_programs(ending: str, railsim_here: Command, tmp_path: Path):
    place = np.arange(50) * 0.125
    series = pd.DataFrame({"s [m]": place, "time [s]": place / 20, "vertical [m]": 1e-3 * np.sin(place)})
    series.loc[7, "vertical [m]"] = np.nan
    Estimate("speed_plain", series, {}).save(tmp_path / "est")
    done = railsim_here("export", "est", "--to", f"table{ending}")
    assert done.returncode == 0, done.stderr
    found = _columns(tmp_path / f"table{ending}")
    assert list(found) == list(series.columns)
    for name, values in found.items():
        np.testing.assert_array_equal(values, series[name])


def test_matlab_reads_units_and_names(railsim_here: Command, lossy: Path, tmp_path: Path):
    from scipy.io import loadmat

    assert railsim_here("export", lossy, "--to", "x.mat").returncode == 0
    held = loadmat(tmp_path / "x.mat", simplify_cells=True)
    assert held["hz_100"]["units"]["bogie_rate_pitch"] == "rad/s"
    assert held["hz_3"]["names"]["gnss_speed"] == GNSS
    assert held["about"]["origin"] == "bogie 7, Zürich"
    assert loadmat(tmp_path / "x.mat")["hz_100"]["time"][0, 0].shape == (600, 1)


def _messages(path: Path) -> tuple[dict[str, set[str]], list[tuple[str, int, dict[str, float]]], dict[str, str]]:
    """Fields by topic as the schemas say, the messages in the order of their times, and the metadata, by mcap alone."""
    from mcap.reader import make_reader

    with path.open("rb") as file:
        reader = make_reader(file)
        read = list(reader.iter_messages())
        said = {one.name: one.metadata for one in reader.iter_metadata()}
    assert {(channel.message_encoding, schema and schema.encoding) for schema, channel, _ in read} == {
        ("json", "jsonschema")
    }
    fields = {channel.topic: set(json.loads(schema.data)["properties"]) for schema, channel, _ in read if schema}
    return fields, [(channel.topic, one.log_time, json.loads(one.data)) for _, channel, one in read], said["railsim"]


def test_mcap_holds_every_sample(railsim_here: Command, lossy: Path, tmp_path: Path):
    assert railsim_here("export", lossy, "--to", "x.mcap").returncode == 0
    fields, messages, said = _messages(tmp_path / "x.mcap")
    assert fields == {"bogie": {"rate_pitch [rad/s]", "acceleration_z [m/s2]"}, "gnss": {"speed [m/s]"}}
    start = 1714730400250000000  # ns since 1970 of 2024-05-03 10:00:00.25 UTC
    assert said == {"origin": "bogie 7, Zürich", "start": "2024-05-03T10:00:00.250000+00:00"}
    times = [time for _, time, _ in messages]
    assert times == sorted(times)
    seen = Recording.open(lossy).measurements
    for name in seen.channels:
        topic, field = name.split(".", 1)
        found = [(time, values[field]) for of, time, values in messages if of == topic and field in values]
        good = np.isfinite(seen[name])
        assert [time for time, _ in found] == [start + round(1e9 * one) for one in seen.time(name)[good]]
        np.testing.assert_array_equal([value for _, value in found], seen[name][good])


def test_an_estimate_goes_to_mcap_by_its_times(railsim_here: Command, tmp_path: Path):
    place = np.arange(5) * 0.125
    series = pd.DataFrame({"s [m]": place, "time [s]": place / 20, "vertical [m]": [1e-3, np.nan, 2e-3, 3e-3, 4e-3]})
    Estimate("speed_plain", series, {}).save(tmp_path / "est")
    Estimate("speed_plain", series.drop(columns="time [s]"), {}).save(tmp_path / "timeless")
    Estimate("speed_plain", series.assign(**{"time [s]": place - 0.25}), {}).save(tmp_path / "early")
    assert railsim_here("export", "est", "--to", "x.mcap").returncode == 0
    _, messages, _ = _messages(tmp_path / "x.mcap")
    assert messages[:2] == [
        ("speed_plain", 0, {"s [m]": 0.0, "vertical [m]": 1e-3}),
        ("speed_plain", 6250000, {"s [m]": 0.125}),
    ]
    assert len(messages) == 5
    refused(railsim_here("export", "timeless", "--to", "y.mcap"), "has no times, which MCAP needs; export to .csv")
    refused(railsim_here("export", "early", "--to", "y.mcap"), "has times before 0, which MCAP cannot hold")
    assert not (tmp_path / "y.mcap").exists()


def test_no_map_is_written_for_what_cannot_be_imported(railsim_here: Command, lossy: Path, tmp_path: Path):
    done = railsim_here("export", lossy, "--to", "x.mcap", "--map", "map.yaml")
    refused(done, "does not read .mcap; leave it out, or export to .csv, .parquet, .mat, .mf4")
    assert not (tmp_path / "x.mcap").exists()


def test_nothing_is_replaced_unasked(railsim_here: Command, lossy: Path, tmp_path: Path):
    (tmp_path / "x.csv").write_text("mine")
    refused(railsim_here("export", lossy, "--to", "x.csv"), "add --overwrite")
    (tmp_path / "map.yaml").write_text("mine")
    refused(railsim_here("export", lossy, "--to", "y.csv", "--map", "map.yaml"), "'map.yaml' is there already")
    assert not (tmp_path / "y.csv").exists() and (tmp_path / "x.csv").read_text() == "mine"
    assert railsim_here("export", lossy, "--to", "x.csv", "--overwrite").returncode == 0
    assert (tmp_path / "x.csv").read_text().startswith(f"time [s],{GNSS}")
    before = sorted(tmp_path.rglob("*"))
    refused(railsim_here("export", lossy, "--to", lossy / "x.csv"), "lies within the recording itself")
    refused(railsim_here("export", lossy, "--to", "x.xlsx"), "write to .csv, .parquet, .mat, .mf4, .mcap")
    refused(railsim_here("export", lossy, "--to", "x.parqet"), "did you mean '.parquet'?")
    refused(railsim_here("export", lossy, "--to", "none/x.csv"), "there is no folder 'none'")
    refused(railsim_here("export", lossy, "--to", "."), "is a folder; name a file")
    refused(railsim_here("export", "nowhere", "--to", "y.csv"), "name a recording or an estimate")
    refused(railsim_here("export", lossy, "--to", "y.csv", "--map", "y.csv"), "name two")
    assert sorted(tmp_path.rglob("*")) == before


def test_half_a_file_never_stands_there(lossy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def fails(_: object, path: Path) -> None:
        path.write_text("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("railsim.field.writers.csv.write", fails)
    content = exporting.recording_content(Recording.open(lossy).measurements)
    (tmp_path / "x.csv").write_text("older")
    with pytest.raises(ValueError, match=r"cannot write '.*x.csv': No space left on device; free some space"):
        exporting.export(content, tmp_path / "x.csv", overwrite=True)
    assert (tmp_path / "x.csv").read_text() == "older"
    assert not list(tmp_path.glob(".x.csv*"))


def test_matlab_has_two_gibibytes_a_variable(tmp_path: Path):
    wide = np.broadcast_to(np.zeros(1), (300_000_000,))
    content = Content("test", [Sheet("100 Hz", {"time [s]": wide})])
    with pytest.raises(ValueError, match=r"takes 2.2 GiB, .* export to .parquet"):
        exporting.export(content, tmp_path / "x.mat")
    assert not list(tmp_path.iterdir())


def test_names_for_matlab_are_taken_once():
    names = identifiers(["a.b", "a b", "units", "2 m", "256 Hz", "0.5 Hz", "é", "x" * 80, "x" * 90], ["units"])
    assert names[:6] == ["a_b", "a_b_2", "units_2", "x_2_m", "hz_256", "hz_0_5"]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[A-Za-z]\w{0,62}", name, re.ASCII) for name in names)
