"""The inspection as a command: repair leaves the original alone, pruning does nothing unasked and loses nothing."""

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from experiments.maintenance import retention
from experiments.maintenance.retention import prune, seconds
from railsim.errors import InputError
from railsim.parquet import write_frame
from railsim.recording import Recording
from tests.experiments.conftest import Command

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


def test_an_interrupted_prune_is_finished(spoilt: Path):
    (spoilt / "measured").rename(spoilt / ".measured.leaving")
    assert prune(spoilt, 0.0, really=True).result["pruned"] is True
    assert not (spoilt / ".measured.leaving").exists()


def test_repair_is_for_recordings(railsim_here: Command, tmp_path: Path):
    done = railsim_here("inspect", "straight_erri_low", "--repair", tmp_path / "x")
    assert done.returncode == 2
    assert "are for recordings" in done.stderr
