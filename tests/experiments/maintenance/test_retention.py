"""The inspection as a command: repair leaves the original alone, pruning does nothing unasked and loses nothing."""

import hashlib
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from experiments.maintenance import retention
from experiments.maintenance.retention import prune, seconds
from railsim.digests import write_marker
from railsim.errors import InputError
from railsim.parquet import write_frame
from railsim.recording import Recording
from tests.experiments.conftest import Command

LEAVING = ".measured.leaving"
CHANNEL = "bogie.rate_pitch [rad/s]"


@pytest.fixture
def spoilt(recording: Path, tmp_path: Path) -> Path:
    """A copy of the recording with zeros for a second in the pitch gyro."""
    folder = tmp_path / "spoilt"
    shutil.copytree(recording, folder)
    path = folder / "measured" / "256hz.parquet"
    table = pd.read_parquet(path)
    table.loc[512:767, CHANNEL] = 0.0
    table.to_parquet(path, index=False)
    write_marker(folder)
    return folder


def _digest(folder: Path) -> str:
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return hashlib.sha256(b"".join(str(p.relative_to(folder)).encode() + p.read_bytes() for p in files)).hexdigest()


def test_repair_writes_a_copy_with_a_log(spoilt: Path, tmp_path: Path, railsim_here: Command):
    before = _digest(spoilt)
    found = json.loads(railsim_here("inspect", spoilt, "--json").stdout)["inspected"][0]["findings"]
    assert [(one["kind"], one["channel"]) for one in found] == [("null", CHANNEL)]
    done = railsim_here("inspect", spoilt, "--repair", tmp_path / "clean")
    assert done.returncode == 0, done.stderr
    assert _digest(spoilt) == before
    clean = Recording.open(tmp_path / "clean")
    assert np.isnan(clean.measurements[CHANNEL][512:768]).all()
    assert clean.measurements.about["inspection"]["findings"][0]["done"] == "samples left out"
    assert clean.truth is not None
    assert railsim_here("inspect", spoilt, "--repair", spoilt).returncode == 2
    assert _digest(spoilt) == before


def test_prune_is_a_dry_run_unless_asked(spoilt: Path, railsim_here: Command):
    before = _digest(spoilt)
    young = railsim_here("inspect", spoilt, "--prune")
    dry = railsim_here("inspect", spoilt, "--prune", "--after", "0")
    assert "stay until 90 days" in young.stdout
    assert "nothing was changed" in dry.stdout
    assert (young.returncode, dry.returncode, _digest(spoilt)) == (0, 0, before)


def test_prune_keeps_events_and_features(spoilt: Path, railsim_here: Command):
    rows = seconds(Recording.open(spoilt).measurements)
    pitch = rows.loc[rows["channel"] == CHANNEL]
    assert pitch["std"].to_numpy()[2] == 0.0
    done = railsim_here("inspect", spoilt, "--prune", "--after", "0", "--yes")
    assert done.returncode == 0, done.stderr
    assert not (spoilt / "measured").exists()
    events = json.loads((spoilt / "features" / "events.json").read_text())
    assert [one["kind"] for one in events["inspection"]] == ["null"]
    assert len(Estimate.open(spoilt / "features" / "speed_refined").series) > 0
    assert len(pd.read_parquet(spoilt / "features" / "seconds.parquet")) >= len(events["channels"]) * 8
    with pytest.raises(InputError, match="reduced to"):
        Recording.open(spoilt)


def test_raw_data_stay_where_features_do_not_read_back(spoilt: Path, monkeypatch: pytest.MonkeyPatch):
    before = _digest(spoilt / "measured")

    def forget(path: Path, table: pd.DataFrame) -> None:
        write_frame(path, table.iloc[:-1])

    monkeypatch.setattr(retention, "write_frame", forget)
    with pytest.raises(InputError, match="does not read back as it was written"):
        prune(spoilt, 0.0, really=True)
    assert _digest(spoilt / "measured") == before


@pytest.fixture
def stopped(spoilt: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A pruning that ended between the features and the removal of the raw data."""

    def killed(path: Path, **options: Any) -> None:
        if path.name == LEAVING:
            raise KeyboardInterrupt
        rmtree(path, **options)

    rmtree = shutil.rmtree
    with monkeypatch.context() as patch:
        patch.setattr(retention.shutil, "rmtree", killed)
        with pytest.raises(KeyboardInterrupt):
            prune(spoilt, 0.0, really=True)
    assert (spoilt / LEAVING).is_dir()
    return spoilt


def test_an_interrupted_prune_is_finished(stopped: Path):
    assert prune(stopped, 0.0, really=True).result["pruned"] is True
    assert not (stopped / LEAVING).exists()


def test_an_interrupted_prune_heeds_the_age(stopped: Path):
    with pytest.raises(InputError):
        prune(stopped, 90.0, really=True)
    assert (stopped / LEAVING / "256hz.parquet").is_file()


def test_raw_data_come_back_where_features_are_damaged_or_missing(stopped: Path):
    features = stopped / "features" / "seconds.parquet"
    features.write_bytes(features.read_bytes()[:-1] + b"?")
    (stopped / LEAVING / "mine.txt").write_text("mine")
    assert not retention.gone_on(stopped)
    assert (stopped / "measured" / "mine.txt").is_file()
    (stopped / "measured" / "mine.txt").unlink()
    assert Recording.open(stopped).measurements.channels
    shutil.rmtree(stopped / "features")
    (stopped / "measured").rename(stopped / LEAVING)
    assert prune(stopped, 0.0, really=True).result["pruned"] is True
    assert Estimate.open(stopped / "features" / "speed_refined").name == "speed_refined"


@pytest.mark.parametrize("name", ["features", "measured", LEAVING])
def test_nothing_behind_a_link_is_touched(spoilt: Path, tmp_path: Path, name: str):
    foreign = tmp_path / "foreign"
    shutil.copytree(spoilt, foreign)
    before = _digest(foreign)
    if (spoilt / name).exists():
        shutil.rmtree(spoilt / name)
    (spoilt / name).symlink_to(foreign)
    with pytest.raises(InputError, match="is a link"):
        prune(spoilt, 0.0, really=True)
    assert _digest(foreign) == before


def test_repair_is_for_recordings(railsim_here: Command, tmp_path: Path):
    done = railsim_here("inspect", "straight_erri_low", "--repair", tmp_path / "x")
    assert done.returncode == 2
    assert "are for recordings" in done.stderr
