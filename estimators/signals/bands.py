"""Wavelength bands of track geometry: zero-phase filters over distance, the same for estimates and truth.

D1, D2, D3 are the ranges of EN 13848-1: 3 to 25 m, 25 to 70 m, 70 to 150 m (lateral: to 200 m). The amplitude
response is 1 / (1 + (k_c / k)^8) at the long end and 1 / (1 + (k / k_c)^8) at the short end: a Butterworth filter of
fourth order run forwards and backwards, one half at the edge wavelength, so that neighbouring bands add up to one. Its
memory decays with exp(-2.4 x / wavelength): a tenth is left one edge wavelength away from an end, a hundredth two away.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import fft

ORDER = 8
"""Exponent of the response: half amplitude at the edge, 1/257 an octave beyond it."""
PADDING = 3.0
"""Length by which a stretch is continued on both sides for filtering, in edge wavelengths."""


class Band(NamedTuple):
    """Shortest and longest wavelength, m; 0 or infinity where there is no edge."""

    shortest: float
    longest: float


BANDS = {"d1": Band(3.0, 25.0), "d2": Band(25.0, 70.0), "d3": Band(70.0, 150.0)}
"""By name, for everything but lateral quantities."""
LATERAL_BANDS = BANDS | {"d3": Band(70.0, 200.0)}
"""By name, for lateral quantities and gauge."""


def bands_of(quantity: str) -> dict[str, Band]:
    """The bands of a quantity by its name: "vertical", "lateral", "left_lateral", "gauge_deviation" ..."""
    return LATERAL_BANDS if "lateral" in quantity or "gauge" in quantity else BANDS


def response(wave_number: np.ndarray, band: Band) -> np.ndarray:
    """Amplitude response at angular wave numbers, rad/m (zero phase)."""
    k = np.abs(np.asarray(wave_number, dtype=float))
    gain = np.ones_like(k)
    if band.shortest > 0.0:
        gain /= 1.0 + (k * band.shortest / (2.0 * np.pi)) ** ORDER
    if np.isfinite(band.longest):
        power = (k * band.longest / (2.0 * np.pi)) ** ORDER
        gain *= power / (1.0 + power)
    return gain


def band_pass(values: np.ndarray, spacing: float, band: Band, integrate: int = 0) -> np.ndarray:
    """Band of a quantity on a uniform grid; NaN splits it into stretches that are filtered each by itself.

    Parameters
    ----------
    values : shape (n,), NaN where there is nothing.
    spacing : of the grid, m.
    band : edges; `longest` must be finite where `integrate` is not 0.
    integrate : how often to integrate over distance on the way; each stretch loses its linear trend first, which the
        long edge would take out anyway.
    """
    long = np.isfinite(band.longest)
    return transform(values, spacing, lambda k: _gain(k, band, integrate), _reach(band), long, integrate > 0)


def high_pass(values: np.ndarray, spacing: float, longest: float) -> np.ndarray:
    """Wavelengths below `longest` (m): 35 or 70 m alignment in Ward et al. (2011), section 3.2."""
    return band_pass(values, spacing, Band(0.0, longest))


def transform(
    values: np.ndarray,
    spacing: float,
    gain: Callable[[np.ndarray], np.ndarray],
    reach: float,
    detrend: bool,
    even: bool = True,
) -> np.ndarray:
    """Multiply each stretch without NaN by `gain` of the angular wave number (rad/m, from 0) in the wave-number domain.

    Parameters
    ----------
    values : shape (n,), NaN where there is nothing; those stay NaN.
    gain : real or complex response, shape as its argument.
    reach : length over which the filter remembers, m; a stretch is continued that far by reflection at its ends.
    even : as in a mirror, which suits noisy curvatures and slopes; otherwise through the end point, which suits smooth
        heights.
    detrend : take a straight line out of each stretch beforehand.
    """
    out = np.full(len(values), np.nan)
    for first, last in stretches(np.isfinite(values)):
        piece = values[first:last]
        if detrend:
            piece = _without_trend(piece)
        pad = int(np.ceil(reach / spacing))
        kind = "even" if even else "odd"
        whole = np.pad(piece, pad, mode="reflect", reflect_type=kind) if len(piece) > 1 else np.pad(piece, pad)
        size = int(fft.next_fast_len(len(whole), real=True) or len(whole))
        whole = np.concatenate([whole, np.linspace(whole[-1], whole[0], size - len(whole) + 2)[1:-1]])
        wave_number = 2.0 * np.pi * fft.rfftfreq(size, spacing)
        filtered = fft.irfft(fft.rfft(whole) * gain(wave_number), size)
        out[first:last] = filtered[pad : pad + len(piece)]
    return out


def stretches(present: np.ndarray) -> list[tuple[int, int]]:
    """First and one past the last index of every run of True."""
    edges = np.diff(np.concatenate([[0], np.asarray(present, dtype=np.int8), [0]]))
    return list(zip(np.flatnonzero(edges > 0).tolist(), np.flatnonzero(edges < 0).tolist(), strict=True))


def settled(present: np.ndarray, spacing: float, reach: float) -> np.ndarray:
    """Where no False (nor an end of the array) lies within `reach` m: what a filter of that memory has settled on."""
    inside = np.zeros(len(present), dtype=bool)
    margin = int(np.ceil(reach / spacing))
    for first, last in stretches(present):
        inside[first + margin : max(last - margin, first + margin)] = True
    return inside


def _gain(k: np.ndarray, band: Band, integrate: int) -> np.ndarray:
    gain = response(k, band).astype(complex)
    if integrate:
        gain[0] = 0.0
        gain[1:] /= (1j * k[1:]) ** integrate
    return gain


def _reach(band: Band) -> float:
    return PADDING * (band.longest if np.isfinite(band.longest) else band.shortest)


def _without_trend(piece: np.ndarray) -> np.ndarray:
    x = np.linspace(-1.0, 1.0, len(piece)) if len(piece) > 1 else np.zeros(1)
    slope = float(np.sum(x * piece)) / max(float(np.sum(x * x)), 1.0)  # sums, not products of the threaded BLAS
    return piece - piece.mean() - slope * x
