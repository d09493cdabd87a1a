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
        gain /= 1.0 + _steep(k * (band.shortest / (2.0 * np.pi)))
    if np.isfinite(band.longest):
        power = _steep(k * (band.longest / (2.0 * np.pi)))
        gain *= power / (1.0 + power)
    return gain


def _steep(ratio: np.ndarray) -> np.ndarray:
    """To the power of `ORDER`, by squares: `**` takes many times longer."""
    square = ratio * ratio
    fourth = square * square
    return fourth * fourth


def band_pass(values: np.ndarray, spacing: float, band: Band, integrate: int = 0) -> np.ndarray:
    """Band of a quantity on a uniform grid; NaN splits it into stretches that are filtered each by itself.

    Parameters
    ----------
    values : shape (..., n), NaN where there is nothing.
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
    values : shape (..., n), NaN where there is nothing; what is NaN in one row is so in all.
    gain : real or complex response, shape as its argument.
    reach : length over which the filter remembers, m; a stretch is continued that far by reflection at its ends.
    even : as in a mirror, which suits noisy curvatures and slopes; otherwise through the end point, which suits smooth
        heights.
    detrend : take a straight line out of each stretch beforehand.
    """
    rows = np.atleast_2d(values)
    out = np.full(rows.shape, np.nan)
    for first, last in stretches(np.all(np.isfinite(rows), axis=0)):
        pad, count = int(np.ceil(reach / spacing)), last - first
        whole = np.empty(int(fft.next_fast_len(count + 2 * pad, real=True) or count + 2 * pad))
        follows = gain(2.0 * np.pi * fft.rfftfreq(len(whole), spacing))
        for row, result in zip(rows, out, strict=True):  # one by one, in little memory
            _continue(_without_trend(row[first:last]) if detrend else row[first:last], pad, even, whole)
            spectrum = fft.rfft(whole)
            spectrum *= follows
            result[first:last] = fft.irfft(spectrum, len(whole))[pad : pad + count]
    return out.reshape(values.shape)


def _continue(piece: np.ndarray, pad: int, even: bool, whole: np.ndarray) -> None:
    """Put a stretch into an array, with `pad` samples of its reflection at both ends, then a line from end to begin."""
    count = len(piece)
    length = count + 2 * pad
    if pad < count:
        left, right = piece[pad:0:-1], piece[-2 : -pad - 2 : -1]
        whole[:pad] = left if even else 2.0 * piece[0] - left
        whole[pad : pad + count] = piece
        whole[pad + count : length] = right if even else 2.0 * piece[-1] - right
    else:
        kind = "even" if even else "odd"
        whole[:length] = np.pad(piece, pad, mode="reflect", reflect_type=kind) if count > 1 else np.pad(piece, pad)
    whole[length:] = np.linspace(whole[length - 1], whole[0], len(whole) - length + 2)[1:-1]


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
    gain = response(k, band)
    if not integrate:
        return gain
    gain[0] = 0.0
    gain[1:] /= k[1:] ** integrate
    return gain * (1.0, -1j, -1.0, 1j)[integrate % 4]


def _reach(band: Band) -> float:
    return PADDING * (band.longest if np.isfinite(band.longest) else band.shortest)


def _without_trend(piece: np.ndarray) -> np.ndarray:
    x = np.linspace(-1.0, 1.0, len(piece)) if len(piece) > 1 else np.zeros(1)
    slope = float(np.sum(x * piece)) / max(float(np.sum(x * x)), 1.0)  # sums, not products of the threaded BLAS
    x *= -slope
    x += piece
    x -= piece.mean()
    return x
