"""Frames are a tight frame whose mean square is the one-sided density; training and held-out frames share no sample."""

import numpy as np

from experiments.discrepancy.baseline.frames import REDUNDANCY, Frames, frames_of, held_out, transform


def test_white_noise_shows_its_one_sided_density():
    """Samples of variance s^2 at rate r have the density 2 s^2 / r."""
    rate, std = 256.0, 0.7
    noise = std * np.random.default_rng(1).standard_normal(int(200 * rate))
    frames = frames_of(200.0, rate)
    power = np.mean(np.abs(transform(frames, noise, rate)[:, 1:]) ** 2)
    assert abs(power / (2.0 * std**2 / rate) - 1.0) < 0.03


def test_sum_of_squares_is_that_of_the_samples_times_the_redundancy():
    """Parseval, for a signal that vanishes at both ends of the record and at 0 Hz: in units of the density of unit
    variance, 2 / rate, a complex coefficient counts twice (`noise.split`).
    """
    rate, length, count = 64.0, 2.0, 20
    frames = Frames(0.5 * length * np.arange(count), length, np.arange(0.0, 0.5 * rate, 1.0 / length))
    time = np.arange(int((count + 1) * 0.5 * length * rate)) / rate
    signal = np.exp(-(((time - 10.0) / 2.0) ** 2)) * np.sin(2.0 * np.pi * 7.3 * time)
    counted = 2.0 * np.abs(transform(frames, signal, rate)) ** 2 / (2.0 / rate)
    assert np.isclose(counted.sum(), REDUNDANCY * np.sum(signal**2), rtol=1e-6)


def test_a_lost_sample_spoils_only_its_frames():
    rate = 100.0
    samples = np.ones(int(20 * rate))
    samples[int(10.5 * rate)] = np.nan
    frames = frames_of(20.0, rate)
    lost = np.isnan(transform(frames, samples, rate)).any(axis=1)
    inside = (frames.starts <= 10.5) & (frames.starts + frames.length > 10.5)
    assert np.array_equal(lost, inside)


def test_held_out_frames_share_no_sample_with_training_frames():
    frames = frames_of(60.0, 256.0)
    train, test = held_out(frames)
    assert train.sum() > test.sum() > 5
    for first in frames.starts[train]:
        assert np.all(np.abs(frames.starts[test] - first) >= frames.length - 1e-9)
