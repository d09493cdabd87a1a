"""Linear filters over time on whole records, by their response in frequency."""

from collections.abc import Callable

import numpy as np
from scipy import fft

PADDING = 10.0
"""s by which a record is continued at both ends."""


<<<<<<< HEAD
def filter_time(values: np.ndarray, rate: float, gain: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Multiply the spectrum of `values` (no NaN) by `gain` of the angular frequency in rad/s (from 0, not negative).

    `values` : shape (..., n).
    """
    count = values.shape[-1]
    pad = min(int(PADDING * rate), count - 1)
    whole = np.pad(values, [*[(0, 0)] * (values.ndim - 1), (pad, pad)], mode="reflect", reflect_type="odd")
    size = int(fft.next_fast_len(count + 2 * pad, real=True) or count + 2 * pad)
    bridge = np.linspace(whole[..., -1], whole[..., 0], size - count - 2 * pad + 2, axis=-1)[..., 1:-1]
    spectrum = fft.rfft(np.concatenate([whole, bridge], axis=-1))
=======
def filter_time(
    values: np.ndarray, rate: float, gain: Callable[[np.ndarray], np.ndarray], through_ends: bool = True
) -> np.ndarray:
    """Multiply the spectrum of `values` (no NaN) by `gain` of the angular frequency in rad/s (from 0, not negative).

    through_ends : the record is continued turned about its ends, which suits paths; else mirrored, which makes no step
        of noise.
    """
    pad = min(int(PADDING * rate), len(values) - 1)
    whole = np.pad(values, pad, mode="reflect", reflect_type="odd" if through_ends else "even")
    size = int(fft.next_fast_len(len(whole), real=True) or len(whole))
    whole = np.concatenate([whole, np.linspace(whole[-1], whole[0], size - len(whole) + 2)[1:-1]])
>>>>>>> c8a172d (Ride comfort and running stability: two estimators that a box with accelerometers can feed)
    omega = 2.0 * np.pi * fft.rfftfreq(size, 1.0 / rate)
    return np.asarray(fft.irfft(spectrum * gain(omega), size))[..., pad : pad + count]
