"""Linear filters over time on whole records, by their response in frequency."""

from collections.abc import Callable

import numpy as np
from scipy import fft

PADDING = 10.0
"""s by which a record is continued at both ends."""


def filter_time(values: np.ndarray, rate: float, gain: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Multiply the spectrum of `values` (no NaN) by `gain` of the angular frequency in rad/s (from 0, not negative)."""
    pad = min(int(PADDING * rate), len(values) - 1)
    whole = np.pad(values, pad, mode="reflect", reflect_type="odd")
    size = int(fft.next_fast_len(len(whole), real=True) or len(whole))
    whole = np.concatenate([whole, np.linspace(whole[-1], whole[0], size - len(whole) + 2)[1:-1]])
    omega = 2.0 * np.pi * fft.rfftfreq(size, 1.0 / rate)
    return np.asarray(fft.irfft(fft.rfft(whole) * gain(omega), size))[pad : pad + len(values)]
