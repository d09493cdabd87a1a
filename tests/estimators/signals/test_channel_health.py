"""Which samples of a channel are believed."""

import numpy as np
import pandas as pd
import pytest

from estimators.signals.channel_health import CLOSE, WINDOW, channel_health, judge
from railsim.data_sheet import DataSheet
from railsim.measurements import Measurements

RATE = 256.0
NAME = "bogie.acceleration_y [m/s2]"
ERRORS = {"range": 2.0, "resolution": 1e-5, "noise_density": 1e-3}
SHEET = DataSheet({"errors": ERRORS})


def noise(count: int = 2560) -> np.ndarray:
    """Samples of an accelerometer, m/s2."""
    return 0.3 * np.random.default_rng(4).standard_normal(count)


def recording(values: np.ndarray) -> Measurements:
    """One channel with its data sheet."""
    time = np.arange(len(values)) / RATE
    sheet = {"name": "bogie", "kind": "accelerometer", "channels": [NAME], "rate": RATE, "errors": ERRORS}
    return Measurements(
        {"origin": "test", "vehicle": {}, "sensors": [sheet]}, {RATE: pd.DataFrame({"time [s]": time, NAME: values})}
    )


def test_a_clean_channel_is_believed_whole():
    health = channel_health(recording(noise()), [NAME])
    assert health.good[NAME].all()
    assert health.left_out == []
    assert health.warnings() == []


def test_a_stuck_stretch_is_left_out_from_its_first_sample():
    values = noise()
    values[1000:1200] = values[1000]
    good, faults = judge(values, RATE, SHEET)
    assert not good[1000:1200].any()
    assert faults["stuck"][1000:1200].all()
    assert good[:999].mean() > 0.95


def test_equal_neighbours_for_a_moment_are_no_fault():
    values = noise()
    values[1000 : 1000 + int(WINDOW * RATE) - 1] = values[1000]
    assert judge(values, RATE, SHEET)[0].all()


def test_a_saturated_channel_names_its_reason():
    values = noise()
    values[500:520] = CLOSE * ERRORS["range"] + 1e-6
    health = channel_health(recording(values), [NAME])
    assert {entry["reason"] for entry in health.left_out} == {"saturated"}
    assert not health.good[NAME][500:520].any()


def test_lost_samples_are_named_with_their_time():
    values = noise()
    values[256:512] = np.nan
    (span,) = [entry for entry in channel_health(recording(values), [NAME]).left_out if entry["reason"] == "lost"]
    assert span["start [s]"] == pytest.approx(1.0, abs=0.3)
    assert span["end [s]"] == pytest.approx(2.0, abs=1.0)


@pytest.mark.parametrize("value", [np.nan, 0.0, 2.0])
def test_a_dead_channel_counts_as_absent(value: float):
    health = channel_health(recording(np.full(2560, value)), [NAME])
    assert health.channels == []
    assert len(health.left_out) == 1
    assert "all of it is left out" in health.warnings()[0]


def test_the_judgement_looks_ahead_by_no_more_than_two_windows():
    values = noise()
    values[1000:1300] = 0.1
    ahead = int(2 * WINDOW * RATE) + 8
    whole = judge(values, RATE, SHEET)[0]
    for end in range(800, 2200, 7):
        assert np.array_equal(judge(values[: end + ahead], RATE, SHEET)[0][:end], whole[:end])
