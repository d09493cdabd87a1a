"""Spectra of the axleboxes' mean vertical acceleration in windows along the line."""

from typing import NamedTuple

import numpy as np

from estimators.speed.axleboxes import Axle, Line

TAPERS = 3
"""Sine tapers of a window (Riedel and Sidorenko 1995)."""
INFORMATION = 1.0 / (1.0 + 0.5 / TAPERS)
"""Of a bin: the mean square of these tapers weighs the places of a window unevenly, which costs that share."""
REACH = 6
"""Bins to either side over which the tapers smear a spectrum."""
FINER = 16
"""Times finer the smearing is summed."""
STEADY = 0.1
"""Most that the speed may change in a window, over its mean."""


class Windows(NamedTuple):
    """Spectra in windows that follow each other.

    Attributes
    ----------
    s : middle of each, m since the record began, shape (windows,). time : when the axle was there, s.
    speed : m/s, shape (windows,).
    wave_number : cycles a metre, shape (bins,).
    power : mean of the tapers' spectra, one-sided, (m/s2)^2 m, shape (windows, bins).
    low_pass : square of the sensor's, shape (windows, bins).
    used : which bins count, shape (windows, bins).
    smear : what a bin holds of the density in each, shape (bins, bins).
    """

    s: np.ndarray
    time: np.ndarray
    speed: np.ndarray
    wave_number: np.ndarray
    power: np.ndarray
    low_pass: np.ndarray
    used: np.ndarray
    smear: np.ndarray

    @property
    def omega(self) -> np.ndarray:
        """Angular frequency, rad/s, shape (windows, bins)."""
        return 2.0 * np.pi * self.speed[:, None] * self.wave_number

    def smeared(self, density: np.ndarray) -> np.ndarray:
        """Expectation of the power of densities (..., bins)."""
        return density @ self.smear

    def take(self, which: np.ndarray) -> "Windows":
        """Some of the windows."""
        own = {name: getattr(self, name)[which] for name in ("s", "time", "speed", "power", "low_pass", "used")}
        return self._replace(**own)

    def without(self, bins: np.ndarray) -> "Windows":
        """Some bins do not count any more."""
        return self._replace(used=self.used & ~bins)


def tapers(count: int) -> np.ndarray:
    """Sine tapers of so many samples, of unit energy, shape (TAPERS, count)."""
    order, place = np.arange(1, TAPERS + 1)[:, None], np.arange(1, count + 1)
    return np.sqrt(2.0 / (count + 1)) * np.sin(np.pi * order * place / (count + 1))


def smearing(count: int, bins: int) -> np.ndarray:
    """Share of the density of each bin (row) in the power of each (column) of so many samples, shape (bins, bins)."""
    power = np.mean(np.abs(np.fft.fft(tapers(count), FINER * count, axis=-1)) ** 2, axis=0)
    width = 2 * REACH + 1
    share = np.roll(power, REACH * FINER + FINER // 2)[: width * FINER].reshape(width, FINER).sum(axis=1)
    apart = np.arange(bins)[:, None] - np.arange(bins)
    near = np.abs(apart) <= REACH
    return np.where(near, (share / share.sum())[np.where(near, apart, 0) + REACH], 0.0)


def windows(axle: Axle, line: Line, length: float, lowest: float, highest: float) -> Windows:
    """Windows of that length, m, whose bins between two frequencies, Hz, count where all is good and the speed steady.

    Bins below the lowest frequency and above the highest one are kept as far as their power smears into those.
    """
    count = round(length / line.spacing)
    acceleration = line.at(axle, axle.acceleration.mean(axis=0)[None])[0]
    parts = [slice(first, first + count) for first in range(0, len(acceleration) - count + 1, count)]
    speed = np.array([line.speed[one].mean() for one in parts])
    good = [line.good[one].all() and np.ptp(line.speed[one]) <= STEADY * line.speed[one].mean() for one in parts]
    wave_number = np.fft.rfftfreq(count, line.spacing)[1:]
    slowest = speed[np.array(good)].min() if any(good) else line.speed.mean()
    wave_number = wave_number[: int(np.searchsorted(wave_number, highest / slowest)) + REACH + 1]
    weights = tapers(count)
    power = np.empty((len(parts), len(wave_number)))
    for i, one in enumerate(parts):
        values = acceleration[one] - acceleration[one].mean()
        spectrum = np.abs(np.fft.rfft(weights * values, axis=-1)[:, 1 : len(wave_number) + 1]) ** 2
        power[i] = 2.0 * line.spacing * spectrum.mean(axis=0)
    frequency = speed[:, None] * wave_number
    used = (frequency >= lowest) & (frequency <= highest) & np.array(good, dtype=bool)[:, None]
    middle = [(one.start + one.stop - 1) // 2 for one in parts]
    low_pass = np.abs(axle.sheet.low_pass(2.0 * np.pi * frequency)) ** 2
    smear = smearing(count, len(wave_number))
    return Windows(line.s[middle], line.time[middle], speed, wave_number, power, low_pass, used, smear)
