"""A tight frame of sine windows that overlap by half: the likelihood of white noise is exact with half weights.

With windows sin(pi (i + 1/2) / N) sqrt(2 / N) the squares over all frames and bins (first and last bin by half) sum to
those of the record, and the mean square of every value is the variance of white noise (Daubechies, Grossmann and Meyer
1986, painless nonorthogonal expansions).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import fft


@dataclass(frozen=True)
class Frames:
    """Frames of `window` [s] of records of `samples` at `rate` [Hz], with the bins from `low` to `high` [Hz]."""

    samples: int
    rate: float
    window: float = 2.0
    low: float = 0.6
    high: float = 50.0

    @property
    def size(self) -> int:
        """Samples of a frame."""
        return round(self.window * self.rate)

    @cached_property
    def sine(self) -> np.ndarray:
        """(size,) the window."""
        return np.sin(np.pi * (np.arange(self.size) + 0.5) / self.size) * np.sqrt(2.0 / self.size)

    @cached_property
    def kept(self) -> np.ndarray:
        """Bins within the band."""
        bins = np.fft.rfftfreq(self.size, 1.0 / self.rate)
        return np.nonzero((bins >= self.low) & (bins <= self.high))[0]

    @property
    def frequencies(self) -> np.ndarray:
        """(F,) [Hz]."""
        return self.kept * self.rate / self.size

    @cached_property
    def places(self) -> np.ndarray:
        """(frames, size) samples."""
        half = self.size // 2
        count = (self.samples - self.size) // half + 1
        return np.arange(count)[:, None] * half + np.arange(self.size)

    def analyse(self, record: np.ndarray) -> np.ndarray:
        """(..., F, frames, channels) of a record (..., channels, samples)."""
        frames = np.lib.stride_tricks.sliding_window_view(record, self.size, axis=-1)[..., :: self.size // 2, :]
        spectra = np.asarray(fft.rfft(frames * self.sine, axis=-1))[..., self.kept]
        return np.moveaxis(spectra, (-3, -1), (-1, -3))

    def synthesise(self, values: np.ndarray) -> np.ndarray:
        """(channels, samples): the record again, of the bins of the band."""
        spectra = np.zeros((values.shape[2], values.shape[1], self.size // 2 + 1), complex)
        spectra[..., self.kept] = np.moveaxis(values, (0, 2), (2, 0))
        pieces = np.fft.irfft(spectra, self.size, axis=-1) * self.sine * (0.5 * self.size)
        record = np.zeros((values.shape[2], self.samples))
        for frame, places in enumerate(self.places):
            record[:, places] += pieces[:, frame]
        return record
