"""What a course over time is like: signals that are made here, by closed forms."""

import numpy as np
import pytest

from experiments.discrepancy.core.course import curve, pulses, tone

RATE, LENGTH = 128.0, 20.0
TIME = np.arange(0.0, LENGTH, 1.0 / RATE)


@pytest.fixture
def noise() -> np.ndarray:
    return np.random.default_rng(1).standard_normal(len(TIME))


def test_a_tone_between_two_bins_is_found_with_its_share(noise: np.ndarray) -> None:
    """2 sin has twice the power of the noise: two thirds of all."""
    frequency, share = tone(2.0 * np.sin(2.0 * np.pi * 12.017 * TIME) + noise, RATE)
    assert frequency == pytest.approx(12.017, abs=0.01) and share == pytest.approx(2.0 / 3.0, abs=0.05)


def test_pulses_are_told_by_their_period(noise: np.ndarray) -> None:
    train = np.exp(-0.5 * ((np.mod(TIME, 0.85) - 0.4) / 0.02) ** 2)
    period, alike = pulses(10.0 * train + noise, RATE)
    assert period == pytest.approx(0.85, abs=0.01) and alike > 0.5


def test_noise_is_neither(noise: np.ndarray) -> None:
    narrow = np.convolve(noise, np.sin(2.0 * np.pi * 9.0 * TIME[:32]), "same")
    assert tone(noise, RATE)[1] < 0.1
    assert max(pulses(noise, RATE)[1], pulses(narrow, RATE)[1]) < 0.4


def test_a_curve_over_the_motion_explains_what_follows_it(noise: np.ndarray) -> None:
    """Coulomb friction of 3 beside noise of 1: eight of nine bins of nine tenths, and nothing over another motion."""
    rng = np.random.default_rng(2)
    velocity, other = rng.standard_normal((2, len(TIME)))
    found = curve(3.0 * np.sign(velocity) + noise, velocity, len(TIME))
    assert found.share == pytest.approx(0.8, abs=0.03)
    np.testing.assert_allclose(found.mean[[0, 1, 7, 8]], [-3.0, -3.0, 3.0, 3.0], atol=0.25)
    assert abs(curve(noise, other, len(TIME)).share) < 0.02


def test_what_does_not_move_is_like_nothing() -> None:
    still = np.zeros(len(TIME))
    assert tone(still, RATE)[1] == pulses(still, RATE)[1] == 0.0
