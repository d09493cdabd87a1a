"""Whitening: noise of the stated covariance becomes independent and of variance one; lost channels count nothing."""

from types import SimpleNamespace

import numpy as np

from experiments.discrepancy.baseline.frames import Frames
from experiments.discrepancy.baseline.noise import noise_level, sensor_density, split, whitener
from railsim import load_scenario


def _noise(covariance: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """(count, 1, c) complex coefficients of that covariance."""
    size = len(covariance)
    unit = (rng.standard_normal((count, size)) + 1j * rng.standard_normal((count, size))) / np.sqrt(2.0)
    return (unit @ np.linalg.cholesky(covariance).T)[:, None, :]


def test_correlated_noise_becomes_white():
    rng = np.random.default_rng(2)
    mixed = np.array([[2.0, 0.8j, 0.1], [-0.8j, 1.0, 0.3], [0.1, 0.3, 0.5]])
    count = 20000
    noise = np.concatenate([np.zeros((count, 1, 3)), _noise(mixed, count, rng)], axis=1)
    white = whitener(np.broadcast_to(mixed, (count, 2, 3, 3)), noise)(noise)[:, 1]
    assert np.allclose(np.cov(white.T), np.eye(6), atol=0.04)


def test_a_lost_channel_takes_no_part_and_leaves_the_others_right():
    covariance = np.broadcast_to(np.diag([4.0, 9.0]).astype(complex), (3, 2, 2, 2))
    values = np.full((3, 2, 2), 3.0 + 0.0j)
    values[1, :, 0] = np.nan
    white = whitener(covariance, values)
    found = white(values)
    assert np.all(found[1][:, [0, 2]] == 0.0)
    assert np.isclose(found[1, 1, 1], np.sqrt(2.0))  # 3 over its deviation 3, in units of unit variance
    assert np.isnan(white.marginal(values)[1, :, 0]).all()


def test_zero_frequency_counts_once():
    """A real coefficient of unit mean square has unit variance; a complex one has it in each part."""
    rng = np.random.default_rng(3)
    unit = np.ones((4000, 2, 1), complex)
    unit[:, 0, 0] = rng.standard_normal(4000)
    unit[:, 1, 0] = (rng.standard_normal(4000) + 1j * rng.standard_normal(4000)) / np.sqrt(2.0)
    assert np.allclose(split(unit).var(axis=0), [[1.0, 0.0], [1.0, 1.0]], atol=0.08)


def test_levels_are_read_where_the_sensor_speaks():
    """Noise of 0.6 and 1.5 times the stated density comes out, and one where it is as stated."""
    rng = np.random.default_rng(5)
    scenario = load_scenario("yaw_dampers")
    sensor = next(one for one in scenario.sensors if one.kind == "gyro")
    names = tuple(sensor.channels())
    frames = Frames(np.arange(40.0), 2.0, np.arange(0.0, 60.0, 0.5))
    density = sensor_density(sensor, frames)
    power = np.stack([density, density, 10.0 * density], axis=-1)
    covariance = np.broadcast_to((power[..., None] * np.eye(3)).astype(complex), (40, len(density), 3, 3))
    levels = np.array([0.6, 1.5, 1.0])
    unit = (rng.standard_normal((40, len(density), 3)) + 1j * rng.standard_normal((40, len(density), 3))) / np.sqrt(2.0)
    evidence = SimpleNamespace(channels=names, sensors=[sensor])
    residual = unit * np.sqrt(power * levels)
    found = noise_level(evidence, frames, whitener(covariance, residual), residual)  # type: ignore[arg-type]
    assert np.allclose(found, levels, rtol=0.06)
    assert found[2] == 1.0
    resonant = residual.copy()
    resonant[:, 40:60] *= 6.0
    resonant[5:8] *= 6.0
    bent = noise_level(evidence, frames, whitener(covariance, residual), resonant)  # type: ignore[arg-type]
    assert np.allclose(bent[:2], levels[:2], rtol=0.35), "a resonance and an impact are not taken for noise"
    known = whitener(covariance * (found * np.eye(3)), residual)
    again = noise_level(evidence, frames, known, residual, found)  # type: ignore[arg-type]
    assert np.allclose(again, found, rtol=0.06), "a level that is known already does not go back to the data sheet's"
