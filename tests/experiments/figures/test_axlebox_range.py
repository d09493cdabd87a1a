"""Errors of ±100 g axlebox accelerometers: what shakes them, and claims of made-up errors."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments.figures.axlebox_range import AxleboxRange
from experiments.runs.axlebox_errors import ADDED, CASES, FASTEST, FORCE, IDEAL, RATE, SERVICE, Shaken, added, converter
from railsim.track.joints import RAIL_LENGTH
from railsim.truth import TIME, Truth, TruthWriter


@pytest.fixture
def still(tmp_path: Path) -> Truth:
    """10 s in which nothing moves."""
    time = np.arange(10 * RATE) / RATE
    with TruthWriter(tmp_path / "truth", [TIME, FORCE], RATE, {}) as writer:
        writer.append(np.stack([time, np.full_like(time, 9.81)], axis=1))
    return Truth.open(tmp_path / "truth")


def test_vibration_has_its_level_and_nothing_that_long_waves_have(still: Truth):
    shaken = added(still, CASES["rectification"], FASTEST, np.random.default_rng(1))
    assert np.sqrt(np.mean(shaken**2)) == pytest.approx(SERVICE, rel=0.4)
    spectrum = np.abs(np.fft.rfft(shaken)) ** 2
    frequency = np.fft.rfftfreq(len(shaken), 1.0 / RATE)
    assert spectrum[frequency < 10.0].sum() < 1e-3 * spectrum.sum()
    assert np.sqrt(np.mean(added(still, CASES["rectification"], 4.5, np.random.default_rng(1)) ** 2)) < 0.2 * SERVICE


def test_impacts_come_at_joints_and_lead_nowhere(still: Truth):
    """Peak as stated at 45 m/s, one every rail; speed and height after each as before."""
    impacts = added(still, CASES["impacts of the range"], FASTEST, np.random.default_rng(1))
    assert impacts.max() == pytest.approx(CASES["impacts of the range"].impacts, rel=0.05)
    peaks = np.sum(
        (impacts[1:-1] > 0.8 * impacts.max()) & (impacts[1:-1] >= impacts[:-2]) & (impacts[1:-1] > impacts[2:])
    )
    assert peaks == int(FASTEST * 10.0 / RAIL_LENGTH)
    speed = np.cumsum(impacts) / RATE
    assert np.abs(speed[-1]) < 1e-3 * np.abs(speed).max()


def test_only_the_force_is_shaken(still: Truth):
    shaken = Shaken(still, np.ones(len(still)))
    np.testing.assert_allclose(shaken[FORCE], 10.81)
    np.testing.assert_array_equal(shaken[TIME], still[TIME])


def test_step_of_a_converter_is_the_span_over_its_codes():
    assert converter(12) * 4096 == pytest.approx(2.0 * 100.0 * 9.80665, rel=1e-3)


@pytest.mark.parametrize("error", [0.02, 0.3, 0.9])
def test_claims_follow_the_errors(error: float):
    rows = [
        {"case": case, "speed [m/s]": speed, "seed": 1, "rms error [mm]": error, "true rms [mm]": 1.0}
        for case in CASES
        for speed in (4.0, 15.0, 45.0)
    ]
    claims = AxleboxRange().check(pd.DataFrame(rows))
    assert len(claims) == len(rows)
    alone = [claim.held for claim in claims if claim.claim.startswith((IDEAL, ADDED))]
    others = [claim.held for claim in claims if not claim.claim.startswith((IDEAL, ADDED))]
    assert set(alone) == {error <= 0.1}
    assert set(others) == {error >= 0.5}
