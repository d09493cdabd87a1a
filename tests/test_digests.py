"""A changed bit in a result is noticed, wherever it is."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from railsim import cache
from railsim.digests import is_whole
from railsim.errors import InputError, Noticed
from railsim.recording import Recording, write_recording
from railsim.truth import Truth, TruthWriter

RATE = 100.0
COLUMNS = ["time [s]", "speed [m/s]"]


def write_truth(folder: Path) -> None:
    with TruthWriter(folder, COLUMNS, RATE, {"vehicle": {"name": "test"}}) as writer:
        writer.append(np.column_stack([np.arange(500) / RATE, np.full(500, 20.0)]))


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    write_truth(tmp_path / "truth")
    time = np.arange(500) / RATE
    frame = pd.DataFrame({"time [s]": time, "bogie.rate_yaw [rad/s]": np.sin(time)})
    about = {"origin": "test", "vehicle": {"name": "test", "body_mass": 30000.0}, "sensors": []}
    track = pd.DataFrame({"s [m]": [0.0, 1.0], "lateral_left [m]": [0.0, 1e-3]})
    (tmp_path / "track.csv").write_text("s [m]\n0\n")
    return write_recording(
        tmp_path / "recording", {RATE: frame}, about, Truth.open(tmp_path / "truth"), track=track,
        true_track=tmp_path / "track.csv", scenario="name: x\n",
    )  # fmt: skip


def flip(path: Path, bit: int) -> None:
    content = bytearray(path.read_bytes())
    content[bit // 8] ^= 1 << bit % 8
    path.write_bytes(bytes(content))


def read_all(folder: Path) -> None:
    seen = Recording.open(folder)
    assert seen.truth is not None
    for name in seen.truth.columns:
        assert seen.truth[name].size


def test_every_flipped_bit_of_a_table_is_refused_with_the_file_named(recording: Path) -> None:
    rng = np.random.default_rng(7)
    for name in ("measured/100hz.parquet", "truth/channels.parquet"):
        path = recording / name
        whole = path.read_bytes()
        for bit in rng.integers(8 * len(whole), size=60):
            flip(path, int(bit))
            with pytest.raises(InputError, match=rf"{path.name}' is (damaged|not a whole)|{path.name}"):
                read_all(recording)
            path.write_bytes(whole)
    read_all(recording)


def test_an_edited_description_is_noticed_and_used(recording: Path) -> None:
    path = recording / "about.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"origin": "mine"}))
    with pytest.warns(Noticed, match=r"about\.json' is not as railsim wrote it"):
        assert Recording.open(recording).measurements.about["origin"] == "mine"


def test_the_digests_are_those_of_the_usual_tool(recording: Path) -> None:
    checked = subprocess.run(
        ["sha256sum", "--check", "--ignore-missing", ".railsim"], cwd=recording, capture_output=True, text=True
    )
    assert checked.returncode == 0, checked.stderr
    assert "measured/100hz.parquet: OK" in checked.stdout


def test_a_folder_is_whole_only_with_all_its_files(recording: Path) -> None:
    assert is_whole(recording)
    flip(recording / "truth" / "about.json", 80)
    assert not is_whole(recording)
    flip(recording / "truth" / "about.json", 80)
    assert is_whole(recording)
    (recording / "truth" / "channels.parquet").unlink()
    assert not is_whole(recording)


def test_a_damaged_entry_of_the_cache_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "cache"))
    cache.cached("key", write_truth)
    path = tmp_path / "cache" / "key" / "channels.parquet"
    whole = path.read_bytes()
    rng = np.random.default_rng(8)
    for bit in rng.integers(8 * len(whole), size=40):
        flip(path, int(bit))
        assert cache.cached("key", write_truth)["speed [m/s]"][0] == 20.0
        assert path.read_bytes() == whole


def test_a_damaged_estimate_is_refused(tmp_path: Path) -> None:
    series = pd.DataFrame({"time [s]": [0.0, 1.0], "speed [m/s]": [1.0, 2.0]})
    Estimate("speed_plain", series, {}).save(tmp_path / "estimate")
    for name in ("estimate.parquet", "about.json"):
        flip(tmp_path / "estimate" / name, 100)
        with pytest.raises(InputError, match=r"damaged|not JSON"):
            Estimate.open(tmp_path / "estimate")
        flip(tmp_path / "estimate" / name, 100)
    assert Estimate.open(tmp_path / "estimate").name == "speed_plain"
