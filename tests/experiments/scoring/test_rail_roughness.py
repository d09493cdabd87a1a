"""Scores of roughness: a made-up estimate of rails that are rough, and of rails that are smooth."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from estimators.track.roughness_bands import CORRUGATION
from experiments.scoring.rail_roughness import RailRoughnessScorer
from railsim.truth import TIME, Truth, TruthWriter

SPEED, RATE, LENGTH = 20.0, 2000.0, 10.0
SIDES = ("left", "right")


def made(folder: Path, amplitude: float) -> Truth:
    """6 s at 20 m/s over waves of 0.2 m."""
    time = np.arange(6.0 * RATE) / RATE
    wave = amplitude * np.sin(2.0 * np.pi * SPEED * time / 0.2)
    columns = {TIME: time, "s [m]": SPEED * time} | {f"track1.{side}_vertical [m]": wave for side in SIDES}
    with TruthWriter(folder / "truth", list(columns), RATE, {}) as writer:
        writer.append(np.stack(list(columns.values()), axis=1))
    return Truth.open(folder / "truth")


def estimate(rms: float) -> Estimate:
    """Windows of 10 m, every band with the same rms."""
    middle = 20.0 + LENGTH * np.arange(8)
    table = {"s [m]": middle, TIME: middle / SPEED, "valid [-]": np.ones(8)}
    for name in CORRUGATION:
        for side in SIDES:
            table |= {
                f"{side}_roughness_{name}mm [m]": np.full(8, rms),
                f"{side}_roughness_{name}mm_std [m]": 0.1 * rms,
            }
    entry = {"wavelength [m]": 0.2} | {f"{side} level [dB]": 20.0 * np.log10(rms / 1e-6) for side in SIDES}
    entry |= {f"{side} level_std [dB]": 1.0 for side in SIDES}
    about = {"settings": {"length": LENGTH, "axle": 1}, "spectrum": [entry], "contact half length [m]": 0.0}
    return Estimate("rail_roughness", pd.DataFrame(table), about)


def test_rails_that_are_rough_have_errors_relative_to_them(tmp_path: Path):
    scores = RailRoughnessScorer().score(estimate(50e-6), made(tmp_path, np.sqrt(2.0) * 50e-6))
    assert scores["roughness spectrum rms error [dB]"] == pytest.approx(0.0, abs=1.0)
    assert any("relative error" in name and value < 0.2 for name, value in scores.items())


def test_no_error_is_relative_to_rails_that_are_smooth(tmp_path: Path):
    """As those of a record whose distances lie beyond the truth."""
    scores = RailRoughnessScorer().score(estimate(50e-6), made(tmp_path, 0.0))
    assert not any("relative" in name or "rms error" in name for name in scores)
    assert {value for name, value in scores.items() if name.endswith("within 2 std [-]")} == {0.0}
    assert all(np.isfinite(value) for value in scores.values())
