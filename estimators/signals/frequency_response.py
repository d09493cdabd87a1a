"""Linear filters over time on whole records, by their response in frequency."""

from collections.abc import Callable

import numpy as np
from scipy import fft

PADDING = 10.0
"""s by which a record is continued at both ends."""


def filter_time(
    values: np.ndarray, rate: float, gain: Callable[[np.ndarray], np.ndarray], through_ends: bool = True
) -> np.ndarray:
    """Multiply the spectrum of `values` (no NaN) by `gain` of the angular frequency in rad/s (from 0, not negative).

    values : shape (..., n).
    through_ends : the record is continued turned about its ends, which suits paths; else mirrored, which makes no step
        of noise.
    """
    count = values.shape[-1]
    pad = min(int(PADDING * rate), count - 1)
    widths = [*[(0, 0)] * (values.ndim - 1), (pad, pad)]
    whole = np.pad(values, widths, mode="reflect", reflect_type="odd" if through_ends else "even")
    size = int(fft.next_fast_len(count + 2 * pad, real=True) or count + 2 * pad)
    bridge = np.linspace(whole[..., -1], whole[..., 0], size - count - 2 * pad + 2, axis=-1)[..., 1:-1]
    spectrum = fft.rfft(np.concatenate([whole, bridge], axis=-1))
    omega = 2.0 * np.pi * fft.rfftfreq(size, 1.0 / rate)
    return np.asarray(fft.irfft(spectrum * gain(omega), size))[..., pad : pad + count]
