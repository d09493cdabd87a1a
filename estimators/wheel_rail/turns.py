"""What repeats with each turn of a wheel: length of a turn, and amplitudes of its orders with what they scatter by."""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import median_filter

CLEARLY = 9.0
"""Growth of the logarithm of the likelihood from which another turn than the nominal one is believed; not derived."""
PADDED = 8
"""Times longer than the record its spectrum is taken, so that lines lie close."""
FINE = 4
"""Steps of the search in the width of the finest order's line."""


class Orders(NamedTuple):
    """Complex amplitudes of the orders in Hann windows of whole turns that overlap by half.

    Attributes
    ----------
    amplitude : m, shape (sides, windows, orders). middle : index of each window's middle, shape (windows,).
    """

    amplitude: np.ndarray
    middle: np.ndarray


def refined_turn(values: np.ndarray, spacing: float, nominal: float, share: float, orders: int) -> float:
    """Length of a turn, m, at which the lines of all orders stand out most; the nominal one where none clearly does.

    values : shape (sides, n), on a grid of `spacing` m; zero where they may not be used. share : of the nominal length
        on both sides in which is looked.

    The statistic is the sum of log(1 + P / P_0): a line's power P over that of its neighbourhood P_0, so that one
    strong line, a corrugated rail's for example, does not decide alone. Near its peak the sum of P / P_0 is sharper.
    """
    count = values.shape[-1]
    size = 1 << int(np.ceil(np.log2(PADDED * count)))
    power = np.abs(np.fft.rfft(values * np.hanning(count), size)) ** 2
    step = 1.0 / (size * spacing)
    width = max(3, 2 * round(0.02 / nominal / step) + 1)
    floor = median_filter(power, (1, width)) / np.log(2.0) + 1e-30
    lines = np.log1p(power / floor)
    steps = share * count * spacing / nominal * orders * FINE
    candidates = nominal * (1.0 + np.linspace(-share, share, 2 * max(int(np.ceil(steps)), 1) + 1))
    if orders / candidates[0] / step >= power.shape[-1] - 1:
        return nominal
    score = _summed(lines, candidates, step, orders)
    best, middle = int(np.argmax(score)), len(candidates) // 2
    if score[best] <= score[middle] + CLEARLY:
        return nominal
    near = candidates[best] + (candidates[1] - candidates[0]) * np.linspace(-2.0 * FINE, 2.0 * FINE, 161)
    return float(near[np.argmax(_summed(power / floor, near, step, orders))])


def _summed(lines: np.ndarray, turns: np.ndarray, step: float, orders: int) -> np.ndarray:
    """Sum over sides and orders of what stands at the orders' lines for each length of a turn, shape as `turns`."""
    at = np.arange(1, orders + 1) / turns[:, None] / step
    return np.sum([np.interp(at, np.arange(len(row)), row).sum(axis=1) for row in lines], axis=0)


def order_amplitudes(values: np.ndarray, spacing: float, turn: float, turns: int, orders: int) -> Orders:
    """Amplitude of each order m, of cos and sin of 2 pi m s / turn, in windows of twice `turns` turns.

    values : m, shape (sides, n).
    """
    half = round(turns * turn / spacing)
    middle = np.arange(half, values.shape[-1] - half + 1, half)
    hann = np.sin(np.pi * (np.arange(2 * half) + 0.5) / (2 * half)) ** 2
    number = np.arange(1, orders + 1)
    amplitude = np.empty((len(values), len(middle), orders), dtype=complex)
    for i, centre in enumerate(middle):
        place = spacing * np.arange(centre - half, centre + half)
        part = values[:, centre - half : centre + half]
        wave = hann[:, None] * np.exp(-2j * np.pi * place[:, None] * number / turn)
        amplitude[:, i] = 2.0 / hann.sum() * (part - part.mean(axis=-1, keepdims=True)) @ wave
    return Orders(amplitude, middle)


def mean_and_scatter(amplitude: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean over windows, and the standard deviation of its real and imaginary part; amplitude (..., windows, orders).

    Windows overlap by half, by which the variance of the mean is 19/18 times that of independent ones, the correlation
    of neighbours being 1/6 of amplitude, 1/36 of power (Welch 1967).
    """
    count = amplitude.shape[-2]
    mean = amplitude.mean(axis=-2)
    spread = np.sum(np.abs(amplitude - mean[..., None, :]) ** 2, axis=-2) / max(count - 1, 1) / count
    return mean, np.sqrt(spread / 2.0 * (1.0 + 2.0 / 6.0))
