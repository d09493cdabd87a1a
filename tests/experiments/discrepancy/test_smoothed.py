"""Track files that were smoothed: which waves they tell of, and that the statement says so."""

import re
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt, sosfreqz

from experiments.discrepancy.railway.answer import Answer
from experiments.discrepancy.railway.smoothed import shortest, told
from experiments.discrepancy.railway.statement import compared
from experiments.discrepancy.railway.survey import Surveyed
from railsim.track.survey import TrackErrors
from railsim.track.track import Track

STEP, COUNT, ERROR = 0.1, 16384, 2e-5  # m, samples, m
WAVES = np.fft.rfftfreq(COUNT, STEP)
POWER = 4e-6 / (1.0 + (WAVES / 0.05) ** 2) ** 1.5  # of a sample of the track


def measured(seed: int) -> np.ndarray:
    """(n,) a track with white errors [m]."""
    rng = np.random.default_rng(seed)
    return np.fft.irfft(np.sqrt(POWER + ERROR**2) * np.fft.rfft(rng.standard_normal(COUNT)), COUNT)


def of(file: np.ndarray) -> np.ndarray:
    """(lines,) waves that it tells of."""
    return told(np.abs(np.fft.rfft(file)[1:]) ** 2 / len(file), ERROR**2)


def test_a_file_that_was_not_smoothed_tells_of_all_waves() -> None:
    joints = np.arange(COUNT) * STEP % 18.3 < STEP  # their lines are far above what is between them
    for seed in range(8):
        assert of(measured(seed)).all()
        assert of(measured(seed) + 0.01 * joints).all()
        assert of(measured(seed)[: COUNT // 8]).all()
        assert shortest(of(measured(seed))) is None


@pytest.mark.parametrize("order", (2, 4, 8))
def test_a_smoothed_file_tells_of_waves_that_it_has_whole(order: int) -> None:
    """By a Butterworth filter from 3 m on, to and fro; its gain there is one half."""
    sections = butter(order, 1.0 / 3.0, fs=1.0 / STEP, output="sos")
    gain = np.abs(sosfreqz(sections, WAVES[1:], fs=1.0 / STEP)[1]) ** 2
    for seed in range(4):
        found = of(sosfiltfilt(sections, measured(seed)))
        assert found[gain > 0.99].mean() > 0.97
        assert found[gain < 0.4].mean() < 0.005


def test_a_track_that_ends_above_the_errors_of_its_file_was_not_smoothed() -> None:
    """Waves shorter than 1 m are neither in the track nor in the file, but its errors are."""
    rng = np.random.default_rng(7)
    lines = np.where(WAVES > 1.0, 0.0, np.sqrt(POWER)) * np.fft.rfft(rng.standard_normal(COUNT))
    errors = 0.2 * ERROR * rng.standard_normal(COUNT)
    file = np.fft.irfft(lines, COUNT) + errors
    assert told(np.abs(np.fft.rfft(file)[1:]) ** 2 / COUNT, (0.2 * ERROR) ** 2).all()


def test_cant_is_smooth_by_design() -> None:
    s = STEP * np.arange(COUNT)
    ramp = 0.06 * (1.0 - np.cos(np.pi * np.clip((s - 500.0) / 40.0, 0.0, 1.0)))
    assert not Surveyed(Track(s, {"cant": ramp}, "curve"), TrackErrors(cross_level_std=ERROR)).shortest()


def test_the_statement_tells_how_short_waves_a_file_has() -> None:
    """Of waves that the channels show: 20 m/s over 40 Hz are 0.5 m."""
    for cut, said in ((0.8, True), (3.0, False)):
        lines = np.where(cut < WAVES, 0.0, np.fft.rfft(measured(6)))
        file = Track(STEP * np.arange(COUNT), {"vertical": np.fft.irfft(lines, COUNT)}, "line")
        record = SimpleNamespace(
            duration=60.0, whole=60.0, sections=[0], frequencies=np.array([1.0, 40.0]), speed_of=lambda _: 20.0,
            surveyed=Surveyed(file, TrackErrors(vertical_std=ERROR)),
        )  # fmt: skip
        words = compared(cast(Answer, SimpleNamespace(system=SimpleNamespace(record=record))))
        assert ("The track file tells of no waves shorter than: vertical" in words) == said
        assert not said or re.search(r"vertical 1\.[23]\d? m", words)
