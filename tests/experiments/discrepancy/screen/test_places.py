"""Tones and places in a residual: put in where they are known, found where they were put."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from experiments.discrepancy.baseline.frames import frames_of, stack
from experiments.discrepancy.screen.places import RATE, distance_of, in_time, likely_places, series, tones

FRAMES = frames_of(24.0, 256.0)
TIME = np.arange(24 * 256) / 256.0
SPEED = 30.0


class White:
    """Nothing but a unit."""

    def complex(self, coefficients: np.ndarray) -> np.ndarray:
        return coefficients


def _problem(signal: np.ndarray) -> Any:
    knots = np.arange(0.0, 24.6, 0.5)
    evidence = SimpleNamespace(speed=(knots, np.full(knots.size, SPEED), 0.0))
    forward = SimpleNamespace(evidence=evidence, registration=SimpleNamespace(start=25.0, scale=1.0))
    measured = stack(FRAMES, ["a"], {"a": signal}, {"a": 256.0})
    return SimpleNamespace(forward=forward, frames=FRAMES, measured=measured, white=White())


def _nothing(problem: Any) -> Any:
    return SimpleNamespace(stacked=np.zeros_like(problem.measured))


def _dips(places: list[float]) -> np.ndarray:
    s = 25.0 + SPEED * TIME
    return np.sum([np.exp(-0.5 * ((s - one) / 0.8) ** 2) for one in places], axis=0)


def test_frames_are_put_together_again():
    signal = np.sin(2.0 * np.pi * 7.3 * TIME)
    found = in_time(FRAMES, stack(FRAMES, ["a"], {"a": signal}, {"a": 256.0}))[:, 0]
    at = FRAMES.starts[0] + np.arange(len(found)) / RATE
    inside = (at > 2.2) & (at < 22.0)
    assert np.allclose(found[inside], np.sin(2.0 * np.pi * 7.3 * at[inside]), atol=1e-3)


def test_the_wavelength_of_a_tone_is_read_to_a_small_part_of_a_turn_over_the_run():
    rng = np.random.default_rng(4)
    signal = np.sin(2.0 * np.pi * SPEED * TIME / 2.95) + rng.standard_normal(TIME.size)
    problem = _problem(signal)
    (_, wavelength), *rest = tones(problem, _nothing(problem))
    assert not rest
    assert abs(700.0 / wavelength - 700.0 / 2.95) < 0.1
    noise = _problem(rng.standard_normal(TIME.size))
    assert not tones(noise, _nothing(noise))


def test_a_tone_of_the_last_fifth_of_a_run_is_heard():
    """A window over the whole run fades it to less than what stands out."""
    rng = np.random.default_rng(5)
    there = 0.8 * TIME[-1] < TIME
    signal = 0.7 * there * np.sin(2.0 * np.pi * SPEED * TIME / 2.95) + rng.standard_normal(TIME.size)
    problem = _problem(signal)
    (_, wavelength), *rest = tones(problem, _nothing(problem))
    assert not rest
    assert abs(700.0 / wavelength - 700.0 / 2.95) < 0.5


def test_the_places_of_dips_and_the_spacing_of_a_series_are_found():
    rng = np.random.default_rng(5)
    template = stack(FRAMES, ["a"], {"a": _dips([500.0])}, {"a": 256.0})
    truth = [312.4 + 63.7 * number for number in range(7)]
    problem = _problem(0.6 * _dips(truth) + 0.05 * rng.standard_normal(TIME.size))
    places, fits, _ = likely_places(problem, _nothing(problem), template, 500.0)
    at = int(np.argmin(np.abs(places - truth[2])))
    assert fits[at - 3 : at + 4].max() == pytest.approx(0.6, abs=0.05)
    first, spacing = series(places, fits, (5.0, 200.0))[0]
    assert (first, spacing) == (pytest.approx(312.4, abs=0.5), pytest.approx(63.7, abs=0.2))
    assert distance_of(problem, 2)[0] == pytest.approx(25.0 + SPEED)
