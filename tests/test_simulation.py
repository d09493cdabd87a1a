"""simulate and measure: same in, same bytes out; the cache; nothing true in what a field engineer may see; memory."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from railsim import InputError, Recording, Scenario, load_scenario, measure, simulate
from railsim import cache as cache_module
from railsim.errors import Noticed
from railsim.measurements import Measurements
from railsim.simulation import engine_names, load_engine, run_digest
from railsim.track.files import read_track, write_track
from railsim.track.track import Track

SHORT = {"duration": 2.0}
MEMORY_LIMIT = 1.5 * 1024  # MiB, for a run of 30 minutes
LONG = 1800.0  # s


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("RAILSIM_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def scenario() -> Scenario:
    return load_scenario("default", SHORT)


def test_engines_are_found():
    assert set(engine_names()) >= {"compiled"}
    with pytest.raises(InputError, match="unknown engine 'nix'; there are: .*compiled"):
        load_engine("nix")


def test_truth_covers_the_run(scenario: Scenario):
    truth = simulate(scenario, "compiled")
    assert len(truth) == 2 * 1024 + 1
    assert truth.time[-1] == 2.0
    assert truth["s [m]"][0] == scenario.start
    assert truth.about["vehicle"]["wheel_radius [m]"] == 0.42
    assert truth.about["vehicle"]["name"] == "class175"
    assert truth.about["engine"] == "compiled"


def test_same_scenario_and_seed_give_the_same_bytes(scenario: Scenario, tmp_path: Path):
    for name in "ab":
        truth = simulate(scenario, "compiled", tmp_path / f"truth_{name}")
        measure(truth, scenario, folder=tmp_path / name)
    files = sorted(path.relative_to(tmp_path / "a") for path in (tmp_path / "a").rglob("*") if path.is_file())
    assert len([path for path in files if path.suffix == ".parquet"]) == 5
    different = [
        str(path) for path in files if (tmp_path / "a" / path).read_bytes() != (tmp_path / "b" / path).read_bytes()
    ]
    assert different == []


def test_another_seed_gives_other_noise_on_the_same_truth(scenario: Scenario):
    truth = simulate(scenario, "compiled")
    one, two, again = (measure(truth, scenario, seed).measurements for seed in (1, 2, 1))
    channel = "bogie.acceleration_z [m/s2]"
    assert np.array_equal(one[channel], again[channel])
    assert not np.array_equal(one[channel], two[channel])


def test_cache_is_used_and_can_be_passed_by(scenario: Scenario):
    first = simulate(scenario, "compiled")
    written = (first.folder / "channels.parquet").stat().st_mtime_ns
    assert (simulate(scenario, "compiled").folder / "channels.parquet").stat().st_mtime_ns == written
    assert (simulate(scenario, "compiled", cache=False).folder / "channels.parquet").stat().st_mtime_ns != written


def test_damaged_entry_of_the_cache_is_made_again(scenario: Scenario):
    folder = simulate(scenario, "compiled").folder
    table = folder / "channels.parquet"
    whole = table.read_bytes()
    table.write_bytes(whole[: len(whole) // 2])
    simulate(scenario, "compiled")
    assert table.read_bytes() == whole


def test_digest_of_a_run_follows_what_shapes_it(scenario: Scenario):
    digest = run_digest(scenario, "compiled")
    assert run_digest(scenario.but(seed=9, description="other", sensors=()), "compiled") == digest
    others = [scenario.but(start=26.0), scenario.but(vehicle="manchester"), scenario.but(track="smooth")]
    digests = {run_digest(other, "compiled") for other in others} | {run_digest(scenario, "exudyn"), digest}
    assert len(digests) == 5


def test_old_runs_leave_a_full_cache(scenario: Scenario, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(cache_module, "MOST_BYTES", 1)
    monkeypatch.setattr(cache_module, "IN_USE", -1.0)
    first, second = (simulate(scenario.but(start=start), "compiled") for start in (26.0, 27.0))
    assert second.folder.is_dir()
    assert not first.folder.exists()


def test_cache_that_cannot_be_written(scenario: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv("RAILSIM_CACHE", str(tmp_path / "file" / "cache"))
    with pytest.warns(Noticed, match="cannot write .*: simulated runs are not kept; set RAILSIM_CACHE"):
        truth = simulate(scenario, "compiled")
    assert truth.time.size


def test_recording_keeps_truth_apart(scenario: Scenario, tmp_path: Path):
    secret = scenario.but(name="secret_name", description="the secret is a worn wheel")
    recording = measure(simulate(secret, "compiled"), secret, folder=tmp_path / "recording")
    text = (tmp_path / "recording" / "about.json").read_text()
    about = json.loads(text)
    assert "secret" not in text
    assert "radius_error" not in text
    assert "outages" not in text
    assert about["vehicle"]["name"] == "class175"
    assert [sheet["name"] for sheet in about["sensors"]] == [sensor.name for sensor in scenario.sensors]
    assert recording.truth is not None
    assert {path.name for path in (tmp_path / "recording").iterdir()} == {
        ".railsim", "about.json", "measured", "track.csv", "truth",
    }  # fmt: skip


def test_scenario_in_the_truth_can_be_run_again(scenario: Scenario, tmp_path: Path):
    measure(simulate(scenario, "compiled"), scenario, 5, tmp_path / "recording")
    again = load_scenario(tmp_path / "recording" / "truth" / "scenario.yaml")
    assert again.digest() == scenario.but(seed=5).digest()


def test_measurements_in_memory_are_those_on_disk(scenario: Scenario, tmp_path: Path):
    truth = simulate(scenario, "compiled")
    memory, disk = measure(truth, scenario), measure(truth, scenario, folder=tmp_path / "recording")
    _same(memory.measurements, disk.measurements)
    _same(disk.measurements, Recording.open(tmp_path / "recording").measurements)


def _same(one: Measurements, two: Measurements) -> None:
    assert one.channels == two.channels
    assert all(np.array_equal(one[name], two[name], equal_nan=True) for name in one.channels)
    assert one.track is not None and two.track is not None
    pd.testing.assert_frame_equal(one.track, two.track)


def test_measured_track_has_the_errors_of_its_measurement(scenario: Scenario):
    truth = simulate(scenario, "compiled")
    noisy = scenario.but(track_errors={"vertical_std": 1e-3})
    exact, track = measure(truth, scenario).measurements.track, measure(truth, noisy).measurements.track
    assert exact is not None and track is not None
    assert np.array_equal(exact["vertical [m]"], read_track(scenario.track).vertical)
    assert np.std(track["vertical [m]"] - exact["vertical [m]"]) == pytest.approx(1e-3, rel=0.05)
    assert np.array_equal(track["lateral [m]"], exact["lateral [m]"])
    assert measure(truth, scenario.but(track_measured=False)).measurements.track is None


def test_run_that_rolls_off_its_track_ends_with_a_line(tmp_path: Path):
    write_track(Track(np.linspace(0.0, 60.0, 7), {}), tmp_path / "short.csv")
    changes = {"track": str(tmp_path / "short.csv"), "speed": {"kind": "driven", "speed": 20.0}, "duration": 5.0}
    with pytest.raises(InputError, match=r"^track: the run leaves 'short' at t = 1\.\d+ s"):
        simulate(load_scenario("default", changes), "compiled")


def test_sliding_wheelset_misleads_its_tachometer_only():
    slide = [{"wheelset": 1, "time": [0, 0.5, 1.0], "slip": [0, 0, 0.2]}]
    scenario = load_scenario("wheel_slide", {"duration": 4.0, "traction": slide, "speed": {"speed": 30.0}})
    measured = measure(simulate(scenario, "compiled"), scenario).measurements
    late = measured.time("wheelset1.speed [m/s]") > 2.0
    assert measured["wheelset1.speed [m/s]"][late] == pytest.approx(0.8 * 30.0, rel=1e-2)
    assert measured["wheelset2.speed [m/s]"][late] == pytest.approx(30.0, rel=2e-3)


def test_half_an_hour_stays_below_the_memory_limit(tmp_path: Path):
    """Peak memory grows linearly with duration: two runs give the rate, which is carried on to 30 minutes."""
    durations = (60.0, 240.0)
    write_track(Track(np.linspace(0.0, 50e3, 7), {}, "long"), tmp_path / "long.csv")
    peaks = [_peak_memory(tmp_path, duration) for duration in durations]
    rate = max(0.0, peaks[1] - peaks[0]) / (durations[1] - durations[0])
    assert peaks[1] + rate * (LONG - durations[1]) < MEMORY_LIMIT


def _peak_memory(folder: Path, duration: float) -> float:
    """Largest resident memory of a process that simulates and measures, MiB; not getrusage's, which counts the process
    that started it as well.
    """
    code = (
        "import re; from railsim import load_scenario, measure, simulate;"
        f"s = load_scenario('default', {{'track': r'{folder / 'long.csv'}', 'duration': {duration},"
        "'speed': {'kind': 'constant', 'speed': 25}});"
        f"measure(simulate(s, 'compiled'), s, folder=r'{folder / 'recording'}');"
        "print(int(re.search('VmHWM: *\\\\s*([0-9]+) kB', open('/proc/self/status').read())[1]) / 1024)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return float(done.stdout)
