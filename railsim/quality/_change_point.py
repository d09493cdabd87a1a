"""Where a channel's gain changes, to the sample: maximum-likelihood change points (Hinkley 1970, Biometrika 57, 1-17).

Two likelihoods are added. The kinematic one says how well the channel, divided by the gain or not, agrees with what the
other channels of the rigid body predict between 1 and 20 Hz. The channel's own autoregressive model sees the jump that
a change of gain makes of the reading.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import toeplitz
from scipy.signal import fftconvolve

from railsim.quality._signals import BLOCK, Whitened, filled, local_scale, whitened
from railsim.quality.agreement import Agreement

_TAIL = 4.0  # degrees of freedom of Student's t, by which innovations are judged: shocks count little
_CHANGE = 20.0  # nepers that one more change of the gain has to bring: ln of 3000 places
_DOUBT = 8.0  # nepers below the best place of the kinematic likelihood, within which others are tried
_REACH, _LEAST = 3.0, 0.5  # s about it, at most and at least
_PASSES = 2
_SURE = 4.5  # nepers below the best: three standard deviations


@dataclass(frozen=True)
class Edge:
    """First sample after a change, and the first and last place that are likely."""

    at: int
    earliest: int
    latest: int


def interval(gained: np.ndarray, first: int, last: int, blind: int) -> tuple[int, int]:
    """The stretch about [first, last) that gains most, in samples of the likelihood ratio up to each, shape (n + 1,).

    It reaches the end of the record where a change before it brings too little, or lies in the last `blind` samples.
    """
    middle, count = (first + last) // 2, gained.size - 1
    begin = int(np.argmin(gained[: middle + 1]))
    end = middle + int(np.argmax(gained[middle:]))
    if begin < blind or gained[0] - gained[begin] < _CHANGE:
        begin = 0
    if end > count - blind or gained[end] - gained[-1] < _CHANGE:
        end = count
    return begin, end


def edges(
    values: np.ndarray, rate: float, agreement: Agreement, first: int, last: int, gain: float
) -> tuple[Edge | None, Edge | None]:
    """Begin and end of a stretch of another gain, in samples of the channel; None where it reaches the record's end.

    Parameters
    ----------
    values : the channel, NaN where lost, shape (n,).
    rate : Hz, of the channel.
    first, last : the stretch in samples of `agreement`.
    """
    known = filled(values)
    ratio = rate / agreement.rate
    gained = agreement.gained(first, last, gain)
    bounds = [round(first * ratio), round(last * ratio) if last < gained.size - 1 else known.size]
    found_edges: list[Edge | None] = [None, None]
    for _ in range(_PASSES):
        mended = known.copy()
        mended[bounds[0] : bounds[1]] /= gain
        white = whitened(np.where(np.isnan(values), np.nan, mended), rate)
        if white is None:
            break
        level = float(np.median(mended))
        for which, sample in enumerate((first, last)):
            if not 0 < sample < gained.size - 1:
                continue
            near = _near(gained if which else -gained, sample, agreement.rate)
            order = white.filter.size
            low, high = (min(max(round(one * ratio), order), known.size - order) for one in near)
            tried = np.arange(low, high + 1)
            pair = (gain, 1.0) if which else (1.0, gain)
            likelihood = kinematic(known, rate, agreement, bounds, which, tried, gain)
            likelihood += own(known, level, white, tried, *pair, round(BLOCK * rate))
            edge = _best(tried, likelihood)
            found_edges[which], bounds[which] = edge, edge.at
    return found_edges[0], found_edges[1]


def kinematic(
    values: np.ndarray, rate: float, agreement: Agreement, bounds: list[int], which: int, tried: np.ndarray, gain: float
) -> np.ndarray:
    """Log-likelihood of one end of the stretch at each sample tried, by the energy that the other channels leave.

    Parameters
    ----------
    values : the channel, shape (n,).
    bounds : begin and end of the stretch, samples of the channel. which : 0 for its begin, 1 for its end.
    tried : consecutive samples, shape (k,).
    """
    share = 1.0 - 1.0 / gain
    faded = agreement.faded(values, rate)
    count = faded.size
    always = (int(tried[-1]), bounds[1]) if which == 0 else (bounds[0], int(tried[0]))
    fixed = agreement.total - share * agreement.spectrum(faded, *always)
    added = faded[tried[0] : tried[-1]] * share
    slope = agreement.back(fixed, count)[tried[0] : tried[-1]] * added
    kernel = agreement.back(agreement.white / count, count)[: added.size]
    if which == 0:
        added, slope = added[::-1], slope[::-1]
    past = fftconvolve(added, np.concatenate([[0.0], kernel[1:]]))[: added.size] if added.size else added
    square = kernel[:1] * added**2 + 2.0 * added * past
    energy = float(np.sum(np.abs(fixed) ** 2)) + np.concatenate([[0.0], np.cumsum(square - 2.0 * slope)])
    inside = np.arange(energy.size)
    if which == 0:
        energy, inside = energy[::-1], inside[::-1]
    freedom = 2.0 * agreement.at.size
    return -0.5 * freedom * energy / float(energy.min()) - freedom / count * np.log(gain) * inside


def own(
    values: np.ndarray,
    level: float,
    white: Whitened,
    tried: np.ndarray,
    before: float,
    after: float,
    block: int | None = None,
) -> np.ndarray:
    """Log-likelihood of a gain that is `before` up to a sample and `after` from it on, by the autoregressive model.

    Parameters
    ----------
    values : shape (n,). level : their mean once the gain is right. white : of the channel once the gain is right.
    tried : consecutive samples, shape (k,), from p to n - p, if the model has p coefficients.
    block : samples over which innovations have one scale, whatever it is, so that the jump alone counts: how large they
        are changes with the vehicle's movement too. None: their scale is that of `white`.
    """
    taps, order, count = white.filter, white.filter.size, tried.size
    start, stop = int(tried[0]), int(tried[-1]) + order
    piece = values[start - order + 1 : stop]
    size, at = white.scale[start:stop], np.arange(count)[:, None] + np.arange(order)
    first = np.convolve(piece / before - level, taps, mode="valid")
    jump = values[start:stop] * (1.0 / after - 1.0 / before)
    change = np.lib.stride_tricks.sliding_window_view(jump, order)[:count] @ toeplitz(taps, np.zeros(order)).T
    between = _density((first[at] + change) / size[at]).sum(axis=1)
    if block is not None:
        return between - _density(first / local_scale(first, block))[at].sum(axis=1)
    second = np.convolve(piece / after - level, taps, mode="valid")
    past = np.concatenate([[0.0], np.cumsum(_density(first / size) - np.log(before))])
    future = np.concatenate([[0.0], np.cumsum(_density(second / size) - np.log(after))])
    return past[:count] + between - order * np.log(after) + future[-1] - future[order : order + count]


def _density(deviate: np.ndarray) -> np.ndarray:
    """Logarithm of Student's density but for a constant."""
    return -0.5 * (_TAIL + 1.0) * np.log1p(deviate**2 / _TAIL)


def _near(likelihood: np.ndarray, sample: int, rate: float) -> tuple[float, float]:
    """The places about one that are not much less likely."""
    low, high = max(0, sample - round(_REACH * rate)), min(likelihood.size - 1, sample + round(_REACH * rate))
    likely = low + np.flatnonzero(likelihood[low : high + 1] > likelihood[sample] - _DOUBT)
    least = _LEAST * rate
    return min(float(likely[0]), sample - least), max(float(likely[-1]), sample + least)


def _best(tried: np.ndarray, likelihood: np.ndarray) -> Edge:
    best = int(np.argmax(likelihood))
    likely = tried[likelihood > likelihood[best] - _SURE]
    return Edge(int(tried[best]), int(likely[0]), int(likely[-1]))
