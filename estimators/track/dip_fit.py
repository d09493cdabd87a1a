"""Search for dips and estimation of their sizes.

Where a dip is, is found by Newton's method. For its half length all values of a list are tried, each for both rails and
for the left or the right rail alone; size, length and angle are means over these guesses, weighted with how likely each
is. (A least-squares length alone is a poor guess: dips of the background as long as the joint make the likelihood flat
and give it several tops.) With one rail alone the roll tells as much of the size as the curvature does: a dip of e in
both rails' mean is then one of e in half their difference.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from estimators.track.dips import LENGTHS, Channel, MatchedFilters, lowest, twice, window

APART = 1.5
"""Dips found in one round of the search lie this far apart, m; fitted ones half of it."""
USUAL, SPREAD = 1.2, 0.3
"""Median (m) and relative standard deviation of joints' half lengths beforehand, illustrative."""
UNEVEN = 0.25
"""Standard deviation of the ratio of a joint on both rails beforehand, illustrative."""
ECHO = 0.25
"""Size over a joint's of what may be its echo from the other wheelset (up to 0.15 in simulated runs)."""
FARTHEST = 0.3
"""Largest step of Newton's method, m."""
SIDES = ("both", "left", "right")
SIGNS = np.array([0.0, 1.0, -1.0])
LEAST = 1e-6  # m


@dataclass(frozen=True)
class Dips:
    """Fitted dips; arrays of shape (n,). A guess is a half length and a side: all `LENGTHS` of each of `SIDES`.

    Attributes
    ----------
    distance : s0, m; `distance_std`.
    chances : how likely each guess is, shape (n, guesses).
    sizes : e of both rails' mean with each guess, m, shape (n, guesses); `sizes_std`, shape (guesses,).
    ratios : difference of the rails' sizes over their sum with each guess, shape (n, guesses).
    snr : signal to noise ratio.
    """

    distance: np.ndarray
    distance_std: np.ndarray
    chances: np.ndarray
    sizes: np.ndarray
    sizes_std: np.ndarray
    ratios: np.ndarray
    snr: np.ndarray

    def take(self, which: np.ndarray) -> "Dips":
        """Those of an index or mask."""
        rows = {key: value[which] for key, value in vars(self).items() if key != "sizes_std"}
        return replace(self, **rows)

    @property
    def likeliest(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Number of the likeliest length, size (m) and ratio of the likeliest guess."""
        number = self.chances.argmax(axis=1)
        each = np.arange(len(number))
        return number % LENGTHS.size, self.sizes[each, number], self.ratios[each, number]

    def mean(self, factor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation of the size times a factor that goes with the length, shape (lengths,)."""
        factor = np.tile(factor, len(SIDES))
        values = self.sizes * factor
        mean = (self.chances * values).sum(axis=1)
        spread = (self.chances * ((values - mean[:, None]) ** 2 + (self.sizes_std * factor) ** 2)).sum(axis=1)
        return mean, np.sqrt(spread)

    def depth(self) -> tuple[np.ndarray, np.ndarray]:
        """Depth of both rails' mean, m, and its standard deviation."""
        return self.mean(lowest(LENGTHS))

    def angle(self) -> tuple[np.ndarray, np.ndarray]:
        """Total dip angle 2 alpha of both rails' mean, rad, and its standard deviation."""
        return self.mean(4 / LENGTHS)

    def half_length(self) -> np.ndarray:
        """Mean half length, m."""
        return (self.chances * np.tile(LENGTHS, len(SIDES))).sum(axis=1)

    def side(self) -> np.ndarray:
        """Number of the likeliest of `SIDES`."""
        return self.chances.reshape(len(self.distance), len(SIDES), LENGTHS.size).sum(axis=2).argmax(axis=1)


def find(channels: Sequence[Channel], threshold: float, rounds: int = 2, known: Dips | None = None) -> Dips:
    """Dips in whitened channels, the first of them felt by both rails' mean, and "roll" second where there is one.

    The strongest are fitted and taken away, until none is left above `threshold`. `known`: dips to begin with.
    """
    dips = no_dips()
    if known is not None and len(known.distance):
        dips = _distinct(refine(channels, known), threshold)
    spacing = channels[0].spacing
    for _ in range(rounds):
        rests = [one.data - synthesise(dips, one) for one in channels]
        filters = MatchedFilters(channels, rests)
        peaks = signal.find_peaks(filters.snr, height=threshold, distance=round(APART / spacing))[0]
        if not peaks.size:
            break
        new = _started(channels, peaks * spacing, *filters.at(peaks), filters.snr[peaks])
        dips = _distinct(refine(channels, _joined(dips, new)), threshold)
    return dips


def refine(channels: Sequence[Channel], dips: Dips, steps: int = 3) -> Dips:
    """Fit all dips, each with its neighbours taken away."""
    for _ in range(steps):
        dips = _step(channels, dips)
    return dips


def synthesise(dips: Dips, channel: Channel, white: bool = True) -> np.ndarray:
    """What the dips add up to in a channel, shape (n,)."""
    if not len(dips.distance):
        return np.zeros(len(channel.data))
    own, rows = _own(dips, channel, _phase(dips, channel), white)
    return _total(own, rows, channel)[own.shape[1] : own.shape[1] + len(channel.data)]


def _step(channels: Sequence[Channel], dips: Dips) -> Dips:
    first = channels[0]
    count, k = window(first.spacing)
    phase = _phase(dips, first)
    number, size, ratio = dips.likeliest
    gradient, stiffness, products = np.zeros(len(size)), np.zeros(len(size)), []
    for channel, amplitude in zip(channels, (size, size * ratio), strict=False):
        waves = _rest(dips, channel, phase) * phase * (np.conj(channel.parity) * twice(count) / count)
        products.append(np.einsum("nk,lk->nl", waves.real, channel.shapes, optimize=True))
        gradient -= amplitude * np.einsum("nk,nk->n", waves.imag, channel.shapes[number] * k)
        stiffness += amplitude**2 * channel.stiffness[number]
    dips = _weighed(channels, products, dips)
    move = np.clip(gradient / stiffness, -FARTHEST, FARTHEST)
    return replace(dips, distance=dips.distance + move, distance_std=1 / np.sqrt(stiffness))


def _weighed(channels: Sequence[Channel], products: Sequence[np.ndarray], dips: Dips) -> Dips:
    """Sizes, ratios and chances of all guesses, from the channels' products with dips of all lengths, (n, lengths)."""
    product, power = products[0], channels[0].power
    prior = -((np.log(LENGTHS / USUAL) / SPREAD) ** 2) / 2
    size = np.maximum(product / power, LEAST)
    chances, sizes, ratios = [size**2 * power / 2 - np.log(power) / 2 + prior], [size], [np.zeros_like(size)]
    spreads = [1 / np.sqrt(power)] * len(SIDES)
    if len(channels) > 1:
        other, less = products[1], channels[1].power
        uneven_power = (UNEVEN * size) ** 2 * less
        chances[0] += other**2 / less * uneven_power / (1 + uneven_power) / 2 - np.log(1 + uneven_power) / 2
        ratios[0] = np.clip(other / less * uneven_power / (1 + uneven_power) / size, -1, 1)
        for sign in SIGNS[1:]:
            total = power + less
            sizes.append(np.maximum((product + sign * other) / total, LEAST))
            chances.append(sizes[-1] ** 2 * total / 2 - np.log(total) / 2 + prior)
            ratios.append(np.full_like(size, sign))
        spreads[1:] = [1 / np.sqrt(power + less)] * 2
    else:
        chances += [np.full_like(size, -np.inf)] * 2
        sizes, ratios = sizes * len(SIDES), ratios * len(SIDES)
    chance = np.concatenate(chances, axis=1)
    chance = np.exp(chance - chance.max(axis=1, keepdims=True))
    chance /= chance.sum(axis=1, keepdims=True)
    rows = {"sizes": np.concatenate(sizes, axis=1), "ratios": np.concatenate(ratios, axis=1)}
    dips = replace(dips, chances=chance, sizes_std=np.concatenate(spreads), **rows)
    number, size, ratio = dips.likeliest
    energies = channels[0].power[number] + (ratio**2 * channels[1].power[number] if len(channels) > 1 else 0.0)
    return replace(dips, snr=size * np.sqrt(energies))


def _rest(dips: Dips, channel: Channel, phase: np.ndarray) -> np.ndarray:
    """Transform of the channel around every dip, the other dips taken away, (n, wave numbers)."""
    own, rows = _own(dips, channel, phase)
    rest = np.pad(channel.data, own.shape[1]) - _total(own, rows, channel)
    return np.asarray(np.fft.rfft(rest[rows] + own, axis=1))


def _total(own: np.ndarray, rows: np.ndarray, channel: Channel) -> np.ndarray:
    """Sum of all windows in the channel padded by their length on both sides."""
    return np.bincount(rows.ravel(), own.ravel(), len(channel.data) + 2 * own.shape[1])


def _own(dips: Dips, channel: Channel, phase: np.ndarray, white: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Every dip in its window, (n, count), and the window's rows in the channel padded by `count` on both sides."""
    count, k = window(channel.spacing)
    number, size, ratio = dips.likeliest
    amplitude = size * ratio if channel.kind == "roll" else size
    shapes = channel.shapes if white else channel.spectrum(k, LENGTHS, white)
    waves = (channel.parity * amplitude)[:, None] * shapes[number] * np.conj(phase)
    index = np.rint(dips.distance / channel.spacing).astype(np.int64)
    rows = np.clip(index, -count // 2, len(channel.data) + count // 2)[:, None] + count // 2 + np.arange(count)[None, :]
    return np.asarray(np.fft.irfft(waves, count, axis=1)), rows


def _phase(dips: Dips, channel: Channel) -> np.ndarray:
    """Factor that brings a dip from its place in the window to the window's first sample, (n, wave numbers)."""
    count, k = window(channel.spacing)
    offset = dips.distance - np.rint(dips.distance / channel.spacing) * channel.spacing + count // 2 * channel.spacing
    phase = np.repeat(np.exp(1j * k[1] * offset)[:, None], len(k), axis=1)
    phase[:, 0] = 1.0
    return np.cumprod(phase, axis=1)


def _started(
    channels: Sequence[Channel], distance: np.ndarray, side: np.ndarray, number: np.ndarray, snr: np.ndarray
) -> Dips:
    """Dips as the search gives them: side and number of the length are sure."""
    ratio = SIGNS[side]
    power = channels[0].power[number] + (ratio**2 * channels[-1].power[number] if len(channels) > 1 else 0.0)
    guesses = len(SIDES) * LENGTHS.size
    chances = np.zeros((distance.size, guesses))
    chances[np.arange(distance.size), side * LENGTHS.size + number] = 1.0
    sizes = np.repeat((snr / np.sqrt(power))[:, None], guesses, axis=1)
    ratios = np.repeat(ratio[:, None], guesses, axis=1)
    return Dips(distance, np.zeros(distance.size), chances, sizes, np.zeros(guesses), ratios, snr)


def no_dips() -> Dips:
    """No dips."""
    guesses = len(SIDES) * LENGTHS.size
    zero, table = np.zeros(0), np.zeros((0, guesses))
    return Dips(zero, zero, table, table, np.zeros(guesses), table, zero)


def _joined(first: Dips, second: Dips) -> Dips:
    rows = {
        key: np.concatenate([value, getattr(second, key)]) for key, value in vars(first).items() if key != "sizes_std"
    }
    return replace(second, **rows)


def without_echoes(dips: Dips, wheelbase: float) -> Dips:
    """Without dips that are a wheelbase (m) from another and smaller than `ECHO` of it.

    Both wheelsets feel every dip; where the odometer or the suspension is not as thought, one passes for a small dip
    of its own.
    """
    _, size, _ = dips.likeliest
    apart = np.abs(np.abs(dips.distance[:, None] - dips.distance[None, :]) - wheelbase) < APART / 4
    small = size[:, None] < ECHO * size[None, :]
    return dips.take(np.flatnonzero(~np.any(apart & small, axis=1)))


def _distinct(dips: Dips, threshold: float) -> Dips:
    """Without dips that are weak, or closer than half `APART` to a stronger one; by place."""
    dips = dips.take(dips.snr > threshold)
    dips = dips.take(np.argsort(dips.distance))
    keep = np.ones(len(dips.distance), dtype=bool)
    crowded = np.flatnonzero(np.diff(dips.distance) < APART / 2)
    around = np.unique(np.concatenate([crowded, crowded + 1]))
    for i in around[np.argsort(dips.snr[around])]:
        near = (np.abs(dips.distance - dips.distance[i]) < APART / 2) & keep & (dips.snr > dips.snr[i])
        keep[i] &= not near.any()
    return dips.take(keep)
