"""Spectra of roughness over distance: one-third octave bands of wavelength, and the wide ones for corrugation."""

from typing import NamedTuple

import numpy as np

THIRD_OCTAVES = 10.0 ** (-np.arange(0, 26) / 10.0)
"""m; centre wavelengths 1 m, 0.8 m ... 3.15 mm of one-third octave bands (EN 15610)."""
HALF_BAND = 10.0**0.05
"""Edge over centre of a one-third octave band."""
CORRUGATION = {"10_30": (0.01, 0.03), "30_100": (0.03, 0.1), "100_300": (0.1, 0.3), "300_1000": (0.3, 1.0)}
"""Wavelengths of the bands of EN 13231, m, by name in mm."""
MICROMETRE = 1e-6
"""m; reference of a roughness level."""
ISO_3095 = (
    (0.4, 17.1), (0.315, 15.0), (0.25, 13.0), (0.2, 11.0), (0.16, 9.0), (0.125, 7.0), (0.1, 4.9), (0.08, 2.9),
    (0.063, 0.9), (0.05, -1.1), (0.04, -3.2), (0.0315, -5.0), (0.025, -5.6), (0.02, -6.2), (0.016, -6.8),
    (0.0125, -7.4), (0.01, -8.0), (0.008, -8.6), (0.0063, -9.2), (0.005, -9.8), (0.004, -10.4), (0.00315, -11.0),
)  # fmt: skip
"""Limit of a reference track by nominal wavelength, m: dB re 1 um (ISO 3095:2013, figure 2, as quoted in a secondary
source; EN 15610:2009, annex B, has the same numbers)."""


class Spectra(NamedTuple):
    """One-sided spectra of windows along the line.

    Attributes
    ----------
    wave_number : cycles a metre, shape (k,), 0 left out.
    density : m2 m, shape (sides, windows, k).
    middle : index of each window's middle on the grid, shape (windows,).
    """

    wave_number: np.ndarray
    density: np.ndarray
    middle: np.ndarray

    def share(self, shortest: float, longest: float) -> np.ndarray:
        """Width of each line of the spectrum that lies within a band of wavelengths, cycles a metre, shape (k,)."""
        step = float(self.wave_number[0])
        low = np.maximum(self.wave_number - step / 2.0, 1.0 / longest)
        high = np.minimum(self.wave_number + step / 2.0, 1.0 / shortest)
        return np.maximum(high - low, 0.0)


def windows(count: int, spacing: float, length: float) -> np.ndarray:
    """Middles of windows of twice that length, one each `length` m, on a grid of so many places; shape (windows,)."""
    half = round(length / spacing)
    return np.arange(half, count - half + 1, half)


def spectra(values: np.ndarray, spacing: float, length: float) -> Spectra:
    """Spectra in Hann windows of twice `length`, m, one each `length`: together they weigh every place alike.

    values : m, shape (sides, n), on a grid of `spacing` m.
    """
    half = round(length / spacing)
    middles = windows(values.shape[-1], spacing, length)
    hann = np.sin(np.pi * (np.arange(2 * half) + 0.5) / (2 * half)) ** 2
    scale = 2.0 * spacing / np.sum(hann**2)
    wave_number = np.fft.rfftfreq(2 * half, spacing)[1:]
    density = np.empty((len(values), len(middles), len(wave_number)))
    for i, middle in enumerate(middles):
        part = values[:, middle - half : middle + half]
        part = part - part.mean(axis=-1, keepdims=True)
        density[:, i] = scale * np.abs(np.fft.rfft(part * hann)[:, 1:]) ** 2
    return Spectra(wave_number, density, middles)


def third_octave(centre: float) -> tuple[float, float]:
    """Shortest and longest wavelength of a one-third octave band, m."""
    return centre / HALF_BAND, centre * HALF_BAND


def level(rms: np.ndarray) -> np.ndarray:
    """dB re 1 um of an rms roughness, m."""
    return 20.0 * np.log10(np.maximum(rms, 1e-12) / MICROMETRE)


def limit(wavelength: float) -> float:
    """Of ISO 3095:2013 at the nearest nominal wavelength, dB re 1 um; NaN beyond its ends."""
    nominal = np.array([one for one, _ in ISO_3095])
    nearest = int(np.argmin(np.abs(np.log(nominal / wavelength))))
    if abs(np.log(nominal[nearest] / wavelength)) > np.log(HALF_BAND):
        return float("nan")
    return ISO_3095[nearest][1]
