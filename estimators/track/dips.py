"""Dips of the rails as a bogie feels them: shape in each channel, background, matched filters in space.

A dip g(x) of both rails' mean at the place s0 tilts the line through both wheelsets, 2 b apart, whose curvature is

    c(s) = [g'(s - s0 + b) - g'(s - s0 - b)] / (2 b):

where g' steps by the dip angle 2 alpha, c steps by 2 alpha / (2 b) when the leading wheelset is at the joint, and back
a wheelbase later (section 3.3 of Ward et al. 2011). Two parabolas that meet in the angle 2 alpha = 4 e / L,
g = -e (1 - |x| / L)^2 (dipped joint of Jenkins et al. 1974), have the transform -4 e / (k^2 L) (1 - sin(kL) / (kL)).
Everything is done in wave numbers, where the wheelbase and the resolution of a channel are factors.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import scipy.fft
from scipy import signal

WINDOW = 32.0
"""Length of the stretch on which a dip is fitted, m."""
LENGTHS = np.geomspace(0.4, 3.6, 25)
"""Half lengths L that are tried, m."""
COARSE = slice(2, None, 5)
"""Those that the search takes."""
SEGMENT = 64.0
"""Length of the pieces whose spectra are averaged, m."""
LONGEST = 30.0
"""Waves longer than this, m, are left to the alignment."""
SHORTEST = 0.9
"""Down to this wavelength, m, the background is what the record shows."""
FINEST = 2.0
"""Wave number times blur up to which waves are used: the Gaussian leaves exp(-2) there."""
TRACK_WIDTH = 1.5
"""Between the contacts of a wheelset, m (standard gauge)."""
NULL = 0.05
"""Share of a wave's roll that shows although the two wheelsets cancel it (illustrative)."""
ROUNDING = 0.3
"""Length over which the angle of a joint is rounded by fishplates and rail ends, m (illustrative)."""
_FALL = {"chord": 2.0, "rail": 0.0, "roll": 2.0}
"""Exponent with which a channel's background falls towards short waves, the rails' curvature being white."""

ChannelKind = Literal["chord", "rail", "roll"]


@dataclass(frozen=True)
class Channel:
    """Samples on a grid of distance with their background made white, and what a dip looks like in them.

    Attributes
    ----------
    data : variance 1 where there is no dip, shape (n,).
    kind : "chord", curvature of the line through both wheelsets; "rail", of the rails' mean under the bogie's centre;
        "roll", the wheelsets' mean roll over distance, which goes with the difference of the rails.
    half_base : b, m.
    blur : standard deviation of the Gaussian through which the channel is seen, m.
    spacing : of the grid, m.
    table_k, weight : wave numbers, rad/m, increasing, and what makes the background white, shape (m,).
    """

    data: np.ndarray
    kind: ChannelKind
    half_base: float
    blur: float
    spacing: float
    table_k: np.ndarray
    weight: np.ndarray

    @property
    def parity(self) -> complex:
        """Factor of `spectrum`: a dip is even in the curvatures, odd in the roll over distance."""
        return 1j if self.kind == "roll" else 1.0

    @cached_property
    def shapes(self) -> np.ndarray:
        """`spectrum` of all `LENGTHS` in a window, shape (lengths, wave numbers)."""
        return self.spectrum(window(self.spacing)[1], LENGTHS)

    @cached_property
    def coarse(self) -> np.ndarray:
        """`spectrum` of the coarse lengths over the whole record, shape (coarse lengths, wave numbers)."""
        return self.spectrum(grid(len(self.data), self.spacing)[1], LENGTHS[COARSE])

    @cached_property
    def power(self) -> np.ndarray:
        """Energy of a dip of e = 1 m, shape (lengths,): 1 over the variance of its size."""
        return energy(self.shapes, window(self.spacing)[0])

    @cached_property
    def stiffness(self) -> np.ndarray:
        """Energy of its slope, 1/m2, shape (lengths,): 1 over the variance of the place of a dip of 1 m."""
        count, k = window(self.spacing)
        return energy(self.shapes * k, count)

    def spectrum(self, k: np.ndarray, half_length: np.ndarray, white: bool = True) -> np.ndarray:
        """Discrete transform of the samples of a dip of e = 1 m at place 0 over `turn`, (lengths, wave numbers)."""
        shape = dip_transform(k, half_length) * self._pair(k) * rounding_gain(k, ROUNDING)
        seen = shape * np.exp(-((k * self.blur) ** 2) / 2) / self.spacing
        return seen * np.interp(k, self.table_k, self.weight) if white else seen

    def _pair(self, k: np.ndarray) -> np.ndarray:
        if self.kind == "rail":
            return -(k**2)
        if self.kind == "roll":
            return 2 * k * np.cos(k * self.half_base) / TRACK_WIDTH
        return -k * np.sin(k * self.half_base) / self.half_base


def dip_transform(k: np.ndarray, half_length: np.ndarray) -> np.ndarray:
    """Transform of -(1 - |x| / L)^2 within +-L, m, shape (lengths, wave numbers)."""
    q = k[None, :] * half_length[:, None]
    small = q < 1e-2
    safe = np.where(small, 1.0, q)
    share = np.where(small, 1 / 6 - q**2 / 120, (1 - np.sin(safe) / safe) / safe**2)
    return -4 * half_length[:, None] * share


def rounding_gain(k: np.ndarray, width: float) -> np.ndarray:
    """Transform of the raised cosine (1 + cos(2 pi x / w)) / w."""
    u = k * width / 2
    turn = np.where(np.abs(u - np.pi) < 1e-6, np.pi + 1e-6, u)
    return np.sinc(turn / np.pi) / (1 - (turn / np.pi) ** 2)


def lowest(half_length: np.ndarray) -> np.ndarray:
    """Depth over e of a rounded dip: rounding takes w (1/4 - 1/pi^2) 2 / L off."""
    return 1 - 2 * ROUNDING * (0.25 - 1 / np.pi**2) / half_length


def channel(
    values: np.ndarray,
    background: np.ndarray,
    valid: np.ndarray,
    kind: ChannelKind,
    half_base: float,
    blur: float,
    spacing: float,
    trust: Callable[[np.ndarray], np.ndarray] = np.ones_like,
) -> Channel:
    """Whiten `values` by the spectrum of `background`, what is left of them without dips; 0 where not `valid`.

    `trust`: of wave numbers, rad/m; 1 where the channel is as the model says, towards 0 where it need not be.
    """
    k, power = density(background, valid, spacing, _FALL[kind])
    ratio = (k * LONGEST / (2 * np.pi)) ** 4
    weight = np.sqrt(spacing / power) * ratio / (1 + ratio) * (k * blur < FINEST) * trust(k)
    if kind == "roll":
        seen = np.cos(k * half_base) ** 2
        weight *= np.sqrt(seen / (seen + NULL**2))
    size, wave_number = grid(len(values), spacing)
    white = np.fft.irfft(np.fft.rfft(values, size) * np.interp(wave_number, k, weight), size)[: len(values)]
    return Channel(white, kind, half_base, blur, spacing, k, weight)


def clipped(values: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """First guess of the background: what exceeds three standard deviations (by the median) is cut off."""
    limit = 3 * 1.4826 * float(np.median(np.abs(values[valid]))) if valid.any() else 0.0
    return np.clip(values, -limit, limit)


def welch(values: np.ndarray, spacing: float, size: int) -> tuple[np.ndarray, np.ndarray]:
    """As `scipy.signal.welch` by default, all pieces of `size` at once: cycles/m, one-sided density."""
    pieces = np.lib.stride_tricks.sliding_window_view(values, size)[:: size - size // 2]
    shape = np.asarray(signal.get_window("hann", size))
    waves = np.fft.rfft((pieces - pieces.mean(axis=1, keepdims=True)) * shape, axis=1)
    power = np.mean(waves.real**2 + waves.imag**2, axis=0) * twice(size) * spacing / np.sum(shape**2)
    return np.fft.rfftfreq(size, spacing), power


def density(values: np.ndarray, valid: np.ndarray, spacing: float, fall: float) -> tuple[np.ndarray, np.ndarray]:
    """Two-sided spectral density over wave number, shape (m,): wave numbers in rad/m, densities (Welch, smoothed).

    Waves shorter than `SHORTEST` have at least the level there, falling by 1 / k^fall as the background of rails does:
    a joint's shape is not known so finely, whatever a quiet record seems to promise.
    """
    size = min(len(values), round(SEGMENT / spacing))
    frequency, power = welch(np.where(valid, values, 0.0), spacing, size)
    floor = 1e-9 * float(power.max()) + 1e-300
    smooth = np.exp(np.asarray(signal.savgol_filter(np.log(power + floor), min(9, len(power) - 1 + len(power) % 2), 1)))
    k = 2 * np.pi * frequency
    edge = 2 * np.pi / SHORTEST
    level = float(np.median(smooth[(k > 0.6 * edge) & (k < edge)]))
    smooth = np.where(k > edge, np.maximum(smooth, level * (edge / np.maximum(k, edge)) ** fall), smooth)
    return k, smooth / (2 * max(float(np.mean(valid)), 1e-3))


class MatchedFilters:
    """Matched filters at every place: for each side (both, left, right rail) and coarse length one row."""

    def __init__(self, channels: Sequence[Channel], rests: Sequence[np.ndarray] | None = None) -> None:
        """`rests`: taken in place of the channels' data, shape (n,) each."""
        rests = [one.data for one in channels] if rests is None else rests
        rows, powers = zip(*(_rows(one, rest) for one, rest in zip(channels, rests, strict=True)), strict=True)
        parts = [rows[0] / np.sqrt(powers[0])[:, None]]
        for sign in (1.0, -1.0) if len(channels) > 1 else ():
            parts.append((rows[0] + sign * rows[1]) / np.sqrt(powers[0] + powers[1])[:, None])
        self._rows = np.concatenate(parts)

    @cached_property
    def snr(self) -> np.ndarray:
        """Largest signal to noise ratio at every place, shape (n,)."""
        return self._rows.max(axis=0)

    def at(self, indices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Side (0, 1, 2: both, left, right) and number of the length that fit best at indices of the grid."""
        side, number = np.divmod(self._rows[:, indices].argmax(axis=0), len(LENGTHS[COARSE]))
        return side, np.arange(len(LENGTHS))[COARSE][number]


def _rows(whitened: Channel, rest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Product of `rest` with a dip of each coarse length at every place, (lengths, n), and the dips' energies."""
    size, _ = grid(len(rest), whitened.spacing)
    waves = np.fft.rfft(rest, size) * np.conj(whitened.parity)
    return np.fft.irfft(waves * whitened.coarse, size, axis=1)[:, : len(rest)], energy(whitened.coarse, size)


def energy(shapes: np.ndarray, size: int) -> np.ndarray:
    """Sum of squares of the samples of each row's inverse transform."""
    return np.einsum("lk,k->l", np.abs(shapes) ** 2, twice(size)) / size


def twice(size: int) -> np.ndarray:
    """How often each wave number of a real transform counts."""
    weight = np.full(size // 2 + 1, 2.0)
    weight[0] = 1.0
    if size % 2 == 0:
        weight[-1] = 1.0
    return weight


def window(spacing: float) -> tuple[int, np.ndarray]:
    """Samples of the stretch on which a dip is fitted, and its wave numbers, rad/m."""
    count = 2 * round(WINDOW / spacing / 2)
    return count, 2 * np.pi * np.fft.rfftfreq(count, spacing)


def grid(length: int, spacing: float) -> tuple[int, np.ndarray]:
    """Size of a transform that leaves room for a dip beyond the end, and its wave numbers, rad/m."""
    size = scipy.fft.next_fast_len(length + round(WINDOW / spacing), real=True) or length
    return size, 2 * np.pi * np.fft.rfftfreq(size, spacing)
