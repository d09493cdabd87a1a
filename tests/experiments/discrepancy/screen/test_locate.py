"""What stands out: a band of one section against the others."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from experiments.discrepancy.baseline.frames import Frames
from experiments.discrepancy.screen import locate as module
from experiments.discrepancy.screen.locate import LONE, Located, locate

FRAMES = Frames(1.0 + np.arange(40.0), 2.0, np.arange(0.0, 60.0, 0.5))
CHANNELS = ("bogie.rate_pitch [rad/s]", "body.acceleration_z [m/s2]", "bogie.acceleration_y [m/s2]")


def _located(monkeypatch: pytest.MonkeyPatch, power: np.ndarray) -> Located:
    """Of powers (k, f, c) over the stated noise."""
    monkeypatch.setattr(module, "_regimes", lambda problem, strip: {})
    white = SimpleNamespace(marginal=lambda residual: power, good=np.ones((len(power), len(CHANNELS)), bool))
    problem: Any = SimpleNamespace(
        white=white, measured=0.0, frames=FRAMES, evidence=SimpleNamespace(channels=CHANNELS),
        forward=SimpleNamespace(nuisances=()),
    )  # fmt: skip
    fit: Any = SimpleNamespace(stacked=0.0, residual=np.zeros((*power.shape[:2], 6)), z=np.zeros(0))
    return locate(problem, fit)


def _noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).exponential(size=(*FRAMES.shape, len(CHANNELS)))


def test_chance_makes_no_place_stand_out(monkeypatch: pytest.MonkeyPatch):
    assert max(_located(monkeypatch, _noise(seed)).spot.nats for seed in range(20)) < 0.2 * LONE


def test_a_section_that_is_louder_in_one_band_stands_out_there(monkeypatch: pytest.MonkeyPatch):
    """By half of what is there beyond the noise [nats], but for the logarithm."""
    power = _noise(1)
    inside = (FRAMES.frequencies >= 4.0) & (FRAMES.frequencies < 8.0)
    power[7, inside, 0] = 30.0
    spot = _located(monkeypatch, power).spot
    assert (spot.channel, spot.low, spot.high, spot.frame) == (CHANNELS[0], 4.0, 8.0, 7)
    assert spot.alone and spot.nats == pytest.approx(8 * (29.0 - np.log(30.0)), rel=0.1)


def test_a_flange_that_touches_is_no_place(monkeypatch: pytest.MonkeyPatch):
    power = _noise(1)
    power[7, :, 2] *= 30.0
    assert not _located(monkeypatch, power).spot.alone


def test_what_is_loud_everywhere_is_no_place_by_itself(monkeypatch: pytest.MonkeyPatch):
    power = _noise(2)
    power[:, FRAMES.frequencies < 8.0, 1] *= 30.0
    found = _located(monkeypatch, power)
    assert found.loud and not found.spot.alone


def test_lost_samples_are_no_place(monkeypatch: pytest.MonkeyPatch):
    power = _noise(3)
    power[5:9, :, 0] = np.nan
    assert not _located(monkeypatch, power).spot.alone
