"""`railsim estimate` takes what a recording lacks, and `--out` says what it replaces."""

import re
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from railsim.recording import write_recording
from railsim.vehicles.lookup import build_vehicle
from tests.experiments.conftest import Command

GNSS, PITCH = "gnss.speed [m/s]", "bogie.rate_pitch [rad/s]"


@pytest.fixture
def box(tmp_path: Path) -> Path:
    """A gyro on a bogie and a receiver, of a vehicle of which nothing is known."""
    fast, slow = np.arange(0, 40, 1 / 100), np.arange(0.0, 40.0)
    frames = {
        100.0: pd.DataFrame({"time [s]": fast, PITCH: 0.01 * np.sin(12.0 * fast)}),
        1.0: pd.DataFrame({"time [s]": slow, GNSS: 20.0 + 0.05 * np.cos(slow)}),
    }
    about = {"origin": "test", "vehicle": {"name": "unknown"}, "sensors": []}
    return Path(write_recording(tmp_path / "box", frames, about))


def refused(done: CompletedProcess[str], words: str) -> None:
    assert done.returncode == 2 and words in done.stderr and done.stderr.count("\n") == 1, done.stderr


def test_each_message_names_the_next_option(railsim_here: Command, box: Path):
    refused(railsim_here("estimate", "alignment_vertical", box, "--out", "out"), "--speed-source CHANNEL")
    source = ("--speed-source", GNSS)
    call = ("estimate", "alignment_vertical", box, "--out", "out")
    done = railsim_here(*call, *source)
    assert done.returncode == 0, done.stderr
    assert "replaced" not in done.stdout
    joints = ("estimate", "dipped_joints", box, "--out", "joints", *source)
    asked = railsim_here(*joints)
    refused(asked, "in SI units; give them under 'vehicle' in the map")
    nominal = build_vehicle("manchester", Path()).nominal()
    given = [f"vehicle.{name}={nominal[name]}" for name in re.findall(r"'(\w+)'", asked.stderr) if name in nominal]
    assert railsim_here(*joints, "--set", *given).returncode == 0
    again = railsim_here(*call, *source, "--set", "vehicle.semi_wheelbase=1.3", "cut=35")
    assert "replaced: an earlier estimate" in again.stdout
    estimate = Estimate.open("out")
    assert estimate.about["settings"]["cut"] == 35
    assert np.nanmax(estimate.series["vertical [m]"]) > 1e-4


def test_options_are_checked(railsim_here: Command, box: Path):
    call = ("estimate", "alignment_vertical", box, "--out", "out")
    refused(railsim_here(*call, "--speed-source", "gnss.sped [m/s]"), "no channel 'gnss.sped [m/s]'")
    refused(railsim_here(*call, "--set", "vehicle.semi_wheelbase"), "write key=value")
    refused(railsim_here(*call, "--set", "vehicle.semi_wheelbase=wide"), "is not a number")
    refused(railsim_here(*call, "--set", "cutt=35"), "did you mean 'cut'")
    refused(railsim_here(*call, "--start", "25"), "no setting 'start'")


def test_a_recording_is_not_replaced_by_an_estimate_unasked(railsim_here: Command, box: Path):
    call = ("estimate", "alignment_vertical", box, "--out", box, "--speed-source", GNSS)
    more = ("--set", "vehicle.semi_wheelbase=1.3")
    refused(railsim_here(*call, *more), "holds a recording, which would be lost; name another folder, or add --overwr")
    assert "replaced: an earlier recording" in railsim_here(*call, *more, "--overwrite").stdout
