"""Search for dips and estimation of their sizes.

Where a dip is, is found by Newton's method; for its half length all values of a list are tried, and size, length and
angle are means over the list, weighted with how likely each length is. (A least-squares length alone is a poor guess:
dips of the background as long as the joint make the likelihood flat and give it several tops.)
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from estimators._dips import LENGTHS, Channel, bank, energy, lowest, twice, window

APART = 1.5
"""Dips found in one round of the search lie this far apart, m; fitted ones half of it."""
USUAL, SPREAD = 1.2, 0.3
"""Median (m) and relative standard deviation of joints' half lengths beforehand, illustrative."""
ONE_SIDED = 0.7
"""Standard deviation of the ratio that is expected beforehand: from one rail to both."""
FARTHEST = 0.3
"""Largest step of Newton's method, m."""


@dataclass(frozen=True)
class Dips:
    """Fitted dips; arrays of shape (n,).

    Attributes
    ----------
    place : s0, m; `place_std`.
    chances : how likely each of `LENGTHS` is, shape (n, lengths).
    sizes : e of both rails' mean for each of `LENGTHS`, m, shape (n, lengths); `sizes_std`, shape (lengths,).
    ratio : difference of the rails' sizes over their sum; `ratio_std`.
    snr : signal to noise ratio.
    """

    place: np.ndarray
    place_std: np.ndarray
    chances: np.ndarray
    sizes: np.ndarray
    sizes_std: np.ndarray
    ratio: np.ndarray
    ratio_std: np.ndarray
    snr: np.ndarray

    def take(self, which: np.ndarray) -> "Dips":
        """Those of an index or mask."""
        rows = {key: value[which] for key, value in vars(self).items() if key != "sizes_std"}
        return replace(self, **rows)

    @property
    def likeliest(self) -> tuple[np.ndarray, np.ndarray]:
        """Number of the likeliest length, and the size with it, m."""
        number = self.chances.argmax(axis=1)
        return number, self.sizes[np.arange(len(number)), number]

    def mean(self, factor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation of the size times a factor that goes with the length, shape (lengths,)."""
        mean = (self.chances * self.sizes * factor).sum(axis=1)
        spread = (self.chances * ((self.sizes * factor - mean[:, None]) ** 2 + (self.sizes_std * factor) ** 2)).sum(
            axis=1
        )
        return mean, np.sqrt(spread)

    def depth(self) -> tuple[np.ndarray, np.ndarray]:
        """Depth of both rails' mean, m, and its standard deviation."""
        return self.mean(lowest(LENGTHS))

    def angle(self) -> tuple[np.ndarray, np.ndarray]:
        """Total dip angle 2 alpha of both rails' mean, rad, and its standard deviation."""
        return self.mean(4 / LENGTHS)

    def half_length(self) -> np.ndarray:
        """Mean half length, m."""
        return self.chances @ LENGTHS


def find(channels: Sequence[Channel], threshold: float, rounds: int = 3) -> Dips:
    """Dips in whitened channels, the first of them felt by both rails' mean, and "roll" second where there is one.

    The strongest are fitted and taken away, until none is left above `threshold`.
    """
    found = none_found()
    rest = channels
    spacing = channels[0].spacing
    for _ in range(rounds):
        snr, number, ratio = bank(rest)
        peaks = signal.find_peaks(snr, height=threshold, distance=round(APART / spacing))[0]
        if not peaks.size:
            break
        chances = np.zeros((peaks.size, LENGTHS.size))
        chances[np.arange(peaks.size), number[peaks]] = 1.0
        new = _started(channels, peaks * spacing, chances, ratio[peaks], snr[peaks])
        found = _distinct(refine(channels, _joined(found, new)), threshold)
        rest = [replace(one, data=one.data - synthesise(found, one)) for one in channels]
    return found.take(np.argsort(found.place))


def refine(channels: Sequence[Channel], dips: Dips, steps: int = 3) -> Dips:
    """Fit all dips, each with its neighbours taken away."""
    for _ in range(steps):
        dips = _step(channels, dips)
    return dips


def synthesise(dips: Dips, one: Channel, white: bool = True) -> np.ndarray:
    """What the dips add up to in a channel, shape (n,)."""
    own, rows = _own(dips, one, white)
    return _total(own, rows, one)[own.shape[1] : own.shape[1] + len(one.data)]


def _step(channels: Sequence[Channel], dips: Dips) -> Dips:
    first = channels[0]
    count, k = window(first.spacing)
    shapes, waves = first.spectrum(k, LENGTHS), _rest(dips, first) * twice(count) / count
    power = energy(shapes, count)
    turned = waves * _phase(dips, first, k)
    product = np.real(turned) @ np.real(shapes).T + np.imag(turned) @ np.imag(shapes).T
    sizes = np.maximum(product / power, 1e-6)
    chance = sizes**2 * power / 2 - np.log(power) / 2 - (np.log(LENGTHS / USUAL) / SPREAD) ** 2 / 2
    chance = np.exp(chance - chance.max(axis=1, keepdims=True))
    dips = replace(dips, sizes=sizes, sizes_std=1 / np.sqrt(power), chances=chance / chance.sum(axis=1, keepdims=True))
    number, size = dips.likeliest
    slope = shapes[number] * (-1j * k)
    stiffness = size * energy(slope, count)
    move = (turned * np.conj(slope)).sum(axis=1).real / stiffness
    snr = size * np.sqrt(power[number])
    dips = replace(dips, place_std=1 / np.sqrt(size * stiffness), snr=snr)
    if len(channels) > 1:
        dips = _rolled(channels[1], dips, number, size)
    return replace(dips, place=dips.place + np.clip(move, -FARTHEST, FARTHEST))


def _rolled(roll: Channel, dips: Dips, number: np.ndarray, size: np.ndarray) -> Dips:
    """Ratio from the roll, its energy added to the signal to noise ratio."""
    count, k = window(roll.spacing)
    shapes = roll.spectrum(k, LENGTHS)[number] * size[:, None]
    power = energy(shapes, count)
    waves = _rest(dips, roll) * twice(count) / count * _phase(dips, roll, k)
    ratio = (waves * np.conj(shapes)).sum(axis=1).real / (power + ONE_SIDED**-2)
    snr = np.sqrt(dips.snr**2 + np.clip(ratio, -1, 1) ** 2 * power)
    return replace(dips, ratio=ratio, ratio_std=1 / np.sqrt(power + ONE_SIDED**-2), snr=snr)


def _rest(dips: Dips, one: Channel) -> np.ndarray:
    """Transform of the channel around every dip, the other dips taken away, (n, wave numbers)."""
    own, rows = _own(dips, one)
    rest = np.pad(one.data, own.shape[1]) - _total(own, rows, one)
    return np.asarray(np.fft.rfft(rest[rows] + own, axis=1))


def _total(own: np.ndarray, rows: np.ndarray, one: Channel) -> np.ndarray:
    """Sum of all windows in the channel padded by their length on both sides."""
    return np.bincount(rows.ravel(), own.ravel(), len(one.data) + 2 * own.shape[1])


def _own(dips: Dips, one: Channel, white: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Every dip in its window, (n, count), and the window's rows in the channel padded by `count` on both sides."""
    count, k = window(one.spacing)
    number, size = dips.likeliest
    amplitude = size * dips.ratio if one.kind == "roll" else size
    waves = one.spectrum(k, LENGTHS, white)[number] * np.conj(_phase(dips, one, k)) * amplitude[:, None]
    index = np.rint(dips.place / one.spacing).astype(np.int64)
    rows = np.clip(index, -count // 2, len(one.data) + count // 2)[:, None] + count // 2 + np.arange(count)[None, :]
    return np.asarray(np.fft.irfft(waves, count, axis=1)), rows


def _phase(dips: Dips, one: Channel, k: np.ndarray) -> np.ndarray:
    """Factor that brings a dip from its place in the window to the window's first sample, (n, wave numbers)."""
    count = window(one.spacing)[0]
    offset = dips.place - np.rint(dips.place / one.spacing) * one.spacing + count // 2 * one.spacing
    return np.exp(1j * k[None, :] * offset[:, None])


def _started(
    channels: Sequence[Channel], place: np.ndarray, chances: np.ndarray, ratio: np.ndarray, snr: np.ndarray
) -> Dips:
    """Dips as the search gives them; what the roll does not explain of the ratio the channels together do."""
    powers = [energy(one.spectrum(window(one.spacing)[1], LENGTHS), window(one.spacing)[0]) for one in channels]
    number = chances.argmax(axis=1)
    total = powers[0][number] + (ratio**2 * powers[-1][number] if len(channels) > 1 else 0.0)
    sizes = np.repeat((snr / np.sqrt(total))[:, None], LENGTHS.size, axis=1)
    zero = np.zeros(place.size)
    return Dips(place, zero, chances, sizes, 1 / np.sqrt(powers[0]), ratio, zero, snr)


def none_found() -> Dips:
    """No dips."""
    zero, table = np.zeros(0), np.zeros((0, LENGTHS.size))
    return Dips(zero, zero, table, table, np.zeros(LENGTHS.size), zero, zero, zero)


def _joined(one: Dips, other: Dips) -> Dips:
    rows = {key: np.concatenate([value, getattr(other, key)]) for key, value in vars(one).items() if key != "sizes_std"}
    return replace(other, **rows)


def _distinct(dips: Dips, threshold: float) -> Dips:
    """Without dips that are weak, or closer than half `APART` to a stronger one."""
    keep = dips.snr > threshold
    for i in np.argsort(dips.snr):
        near = (np.abs(dips.place - dips.place[i]) < APART / 2) & keep & (dips.snr > dips.snr[i])
        keep[i] &= not near.any()
    return dips.take(keep)
