"""Bounds of the track's stiffness: closed forms of an oscillator and of a zone in white noise."""

import numpy as np
import pytest

from experiments.bounds.stiffness import lumped_receptance, one_pass, two_loads
from railsim.track.flexible import FlexibleTrack
from railsim.track.spectra import Band, Spectrum

TRACK = FlexibleTrack().corunning()
WHEEL = (700.0, 1e15)
ROUGH = Spectrum(1e-6, 0, (0.1, 0.1)), Band(shortest=0.02, longest=1000.0), 1.0


def bound(stiffness: float = 90e6, length: float = 20.0, noise: float = 1e-9, track: object = TRACK) -> float:
    """At 25 m/s, of a contact that does not give."""
    return one_pass(stiffness, 25.0, length, track, WHEEL, ROUGH, noise)  # type: ignore[arg-type]


def test_stiffness_at_rest_is_the_one_that_is_stated() -> None:
    found = lumped_receptance(np.array([1e-3]), 90e6, TRACK)[0]
    assert 1.0 / found.real == pytest.approx(90e6, rel=1e-6)


def test_bound_of_a_lightly_damped_oscillator() -> None:
    """Without masses of the track and with a damper, S has d ln S / d ln K = x / ((1 + x^2) zeta) about the resonance
    f0 = sqrt(K / m) / 2 pi, with x = (f / f0 - 1) / zeta. Its square integrated over f gives pi f0 / (2 zeta).
    """
    damper, stiffness = 8e3, 80e6
    light = TRACK._replace(
        rail_mass_z=1e-3, sleeper_mass_z=1e-3, pad_stiffness_z=1e13, pad_damping_z=0.0, ballast_damping_z=damper
    )
    omega = np.sqrt(stiffness / 700.0)
    zeta = damper / (2.0 * 700.0 * omega)
    information = np.pi * omega / (2.0 * np.pi) * 0.8 / (2.0 * zeta)
    assert zeta < 0.03
    assert bound(stiffness, track=light) == pytest.approx(information**-0.5, rel=0.1)


def test_bound_falls_with_the_root_of_the_length_and_rises_with_noise() -> None:
    assert bound(length=80.0) == pytest.approx(bound(length=20.0) / 2.0)
    assert bound(noise=1.0) > bound(noise=1e-9)


def test_bound_of_two_loads_is_least_squares_of_samples() -> None:
    """The zone's size fitted to made-up samples at 4096 Hz: scatter over draws of white noise."""
    stiffness, speed, length, loads, noise = 60e6, 25.0, 10.0, (57e3, 70e3), 0.007
    rate = 4096.0
    s = np.arange(0.0, length, speed / rate)
    shape = (
        (loads[0] - loads[1]) / stiffness * speed**2 * -0.5 * (2 * np.pi / length) ** 2 * np.cos(2 * np.pi * s / length)
    )
    rng = np.random.default_rng(1)
    draws = np.sqrt(2.0) * noise * np.sqrt(rate / 2.0) * rng.standard_normal((400, len(s)))
    assert np.std(draws @ shape / (shape @ shape)) == pytest.approx(
        two_loads(stiffness, speed, length, loads, noise), rel=0.12
    )
