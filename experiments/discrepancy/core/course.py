"""What a force or reading over time is like: a tone, pulses that come again and again, or a curve over the motion.

Each question is answered by a share, 0 ... 1, of what is there that the answer explains.
"""

from dataclasses import dataclass

import numpy as np
from scipy import signal

PADDED = 8  # times as many frequencies as a record has by itself: a tone lies between them
LOBE = 2  # bins to each side over which a Hann window spreads a tone
AGAIN = 0.8  # of the largest likeness to itself: the first time at which it is so large is the period
BINS = 9  # of a curve, each with as many samples


@dataclass(frozen=True)
class Curve:
    """Mean over bins of the motion: `state`, `mean` (bins,); `share` of the variance that it explains, less chance."""

    state: np.ndarray
    mean: np.ndarray
    share: float


def tone(values: np.ndarray, rate: float) -> tuple[float, float]:
    """Frequency [Hz] of the strongest tone in samples (n,) at `rate` [Hz], and its share of the power.

    The peak of a periodogram with a Hann window, between its bins too (Rife and Boorstyn 1974, IEEE Transactions on
    Information Theory 20).
    """
    size = PADDED * len(values)
    power = np.abs(np.fft.rfft((values - values.mean()) * np.hanning(len(values)), size)) ** 2
    peak, aside = int(power.argmax()), LOBE * PADDED
    share = power[max(0, peak - aside) : peak + aside + 1].sum() / max(power.sum(), np.finfo(float).tiny)
    return peak * rate / size, float(share)


def pulses(values: np.ndarray, rate: float) -> tuple[float, float]:
    """Time [s] after which the envelope of samples (n,) comes again, and how alike it is then (autocorrelation)."""
    envelope = np.abs(np.asarray(signal.hilbert(values))) ** 2
    envelope = envelope - envelope.mean()
    if not envelope.any():
        return 0.0, 0.0
    spectrum = np.fft.rfft(envelope, 2 * len(envelope))
    alike = np.fft.irfft(np.abs(spectrum) ** 2)[: len(envelope)]
    alike *= len(envelope) / np.arange(len(envelope), 0, -1) / alike[0]
    below = np.flatnonzero(alike < 0.0)  # the pulse itself ends there
    first, last = (int(below[0]) if len(below) else len(alike)), len(alike) // 3
    looked = alike[first:last]
    if not len(looked) or looked.max() <= 0.0:
        return 0.0, 0.0
    top = int(np.flatnonzero(looked >= AGAIN * looked.max())[0])
    while top + 1 < len(looked) and looked[top + 1] > looked[top]:
        top += 1
    return (first + top) / rate, float(min(looked[top], 1.0))


def curve(values: np.ndarray, state: np.ndarray, count: float) -> Curve:
    """Of samples (n,) over the state (n,) at the same times; `count` of them are independent."""
    edges = np.quantile(state, np.linspace(0.0, 1.0, BINS + 1)[1:-1])
    places = np.searchsorted(edges, state)
    sizes = np.maximum(np.bincount(places, minlength=BINS), 1)
    mean, middle = (np.bincount(places, one, BINS) / sizes for one in (values, state))
    left = np.mean((values - mean[places]) ** 2) / max(float(np.var(values)), np.finfo(float).tiny)
    return Curve(middle, mean, float(1.0 - left * (count - 1.0) / max(count - BINS, 1.0)))
