"""Recordings of every format version that there has been can still be read, measurements, track and truth."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from railsim import Recording
from railsim.recording import FORMAT_VERSION
from tests.formats.write import HERE, samples

FOLDERS = sorted(HERE.glob("recording_*/"))


def test_every_version_has_a_recording_here():
    wanted = [f"recording_{version}" for version in range(1, FORMAT_VERSION + 1)]
    assert [folder.name for folder in FOLDERS] == wanted, "a new version: python -m tests.formats.write"


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_it_opens_with_the_numbers_that_were_written(folder: Path):
    """The numbers stand beside it as text, so that no reader of the tables is asked twice."""
    recording = Recording.open(folder)
    found = samples(recording)
    stored = pd.read_csv(folder.with_suffix(".csv"), dtype={"value": str})
    assert list(found["channel"]) == list(stored["channel"])
    assert np.array_equal(found["value"].to_numpy(), [float(one) for one in stored["value"]], equal_nan=True)
    assert recording.measurements.track is not None and recording.true_track is not None
    assert "vehicle" in (recording.scenario or "")
