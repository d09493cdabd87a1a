"""Frames: short, overlapping Fourier transforms of every channel at the same instants and frequencies.

A sine window with half overlap is a tight frame: the sum of the squares over all frames is that of the samples, twice
over. Coefficients are scaled so that their mean square is the one-sided power spectral density.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

HIGHEST = 60.0  # Hz; above it neither the track file nor the sensors say much
REDUNDANCY = 2.0  # of half overlap


@dataclass(frozen=True)
class Frames:
    """Where and when.

    Attributes
    ----------
    starts : (k,) s. length : s. frequencies : (f,) Hz, 0 included.
    """

    starts: np.ndarray
    length: float
    frequencies: np.ndarray

    @property
    def middles(self) -> np.ndarray:
        """Middle of each frame [s]."""
        return self.starts + 0.5 * self.length

    @property
    def shape(self) -> tuple[int, int]:
        """Frames and frequencies."""
        return len(self.starts), len(self.frequencies)


def frames_of(duration: float, lowest_rate: float, length: float = 2.0, skip: float = 1.0) -> Frames:
    """Frames of `length` [s] every half of it, from `skip` [s] on (the start is no steady state)."""
    count = int((duration - skip - length) / (0.5 * length)) + 1
    highest = min(HIGHEST, 0.35 * lowest_rate)
    frequencies = np.arange(0.0, highest, 1.0 / length)
    return Frames(skip + 0.5 * length * np.arange(count), length, frequencies)


def transform(frames: Frames, samples: np.ndarray, rate: float) -> np.ndarray:
    """(k, f) coefficients of one channel, NaN where a sample of the frame is lost."""
    count = round(frames.length * rate)
    first = np.round(frames.starts * rate).astype(int)
    window = np.sin(np.pi * (np.arange(count) + 0.5) / count)
    pieces = samples[first[:, None] + np.arange(count)] * window
    spectrum = np.fft.rfft(pieces, axis=1)[:, : len(frames.frequencies)]
    return spectrum * np.sqrt(2.0 / (rate * float(window @ window)))


def stack(
    frames: Frames, channels: Sequence[str], samples: Mapping[str, np.ndarray], rates: Mapping[str, float]
) -> np.ndarray:
    """(k, f, c) coefficients of all channels."""
    return np.stack([transform(frames, samples[name], rates[name]) for name in channels], axis=-1)


def held_out(frames: Frames, train: float = 8.0, test: float = 4.0) -> tuple[np.ndarray, np.ndarray]:
    """Masks (k,) of the frames that train and that are held out; those across a border are neither."""
    place = (frames.starts - frames.starts[0]) % (train + test)
    return place + frames.length <= train + 1e-9, (place >= train - 1e-9) & (
        place + frames.length <= train + test + 1e-9
    )
