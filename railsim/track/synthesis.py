"""Synthesis of tracks: irregularities from spectra and design geometry from segments."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from railsim.errors import InputError
from railsim.track.spectra import Band, Spectrum

ROUNDING = 4.0
"""Length over which the corners of ramps are rounded, m."""


@dataclasses.dataclass(frozen=True)
class Segment:
    """A piece of track with constant curvature (1/m, left +), cant (m, right rail higher +) and gradient (uphill +)."""

    length: float
    curvature: float = 0.0
    cant: float = 0.0
    gradient: float = 0.0


@dataclasses.dataclass(frozen=True)
class Transition:
    """A piece over which curvature (clothoid), cant and gradient go linearly from the piece before to the next one."""

    length: float


def distances(length: float, spacing: float) -> np.ndarray:
    """Distances from 0 to `length` at `spacing`, m, rounded to the micrometre."""
    return np.round(np.arange(round(length / spacing) + 1) * spacing, 6)


def irregularity(
    spectrum: Spectrum, count: int, spacing: float, rng: np.random.Generator, band: Band | None = None
) -> np.ndarray:
    """One realisation of an irregularity with the spectrum `spectrum` within `band`, m, shape (count,).

    Random-phase method (Shinozuka and Deodatis, 1991): harmonics of fixed amplitude sqrt(2 S dW) with phases
    independent and uniform over a circle; nearly Gaussian, because many harmonics add. The period of the sum is at
    least twice the length that is asked for, so that the end does not lead back to the start.

    Raises
    ------
    InputError : the band reaches below two spacings.
    """
    band = band or Band()
    if band.shortest / band.skirt < 2 * spacing:
        raise InputError(
            f"wavelengths down to {band.shortest / band.skirt:g} m do not fit a spacing of {spacing:g} m;"
            " take a finer spacing or longer waves"
        )
    least = max(2 * count, int(np.ceil(8 * band.longest * band.skirt / spacing)))
    period = 2 ** int(np.ceil(np.log2(least)))
    step = 2 * np.pi / (period * spacing)
    wavenumber = step * np.arange(1, period // 2 + 1)
    amplitude = np.sqrt(2 * spectrum.density(wavenumber) * band.weight(wavenumber) * step)
    phase = rng.uniform(0, 2 * np.pi, wavenumber.size)
    harmonics = np.concatenate([[0.0], amplitude * np.exp(1j * phase) * period / 2])
    return np.fft.irfft(harmonics, period)[:count]


def irregularities(
    spectra: Mapping[str, Spectrum], count: int, spacing: float, rng: np.random.Generator, band: Band | None = None
) -> dict[str, np.ndarray]:
    """Independent realisations for every quantity of `spectra`, m, by column name."""
    return {key: irregularity(spectrum, count, spacing, rng, band) for key, spectrum in spectra.items()}


def faded_irregularities(
    spectra: Mapping[str, Spectrum],
    s: np.ndarray,
    spacing: float,
    rng: np.random.Generator,
    band: Band,
    ramp: tuple[float, float],
) -> dict[str, np.ndarray]:
    """Irregularities over the distances `s`, m, that begin as `fade_in` with the two lengths of `ramp` says."""
    columns = irregularities(spectra, s.size, spacing, rng, band)
    return {key: column * fade_in(s, *ramp) for key, column in columns.items()}


def fade_in(s: np.ndarray, clean: float, length: float) -> np.ndarray:
    """Factor that is 0 up to the distance `clean`, 1 from `clean + length` on, with continuous second derivative."""
    t = np.clip((s - clean) / length, 0, 1)
    return t**3 * (10 - 15 * t + 6 * t**2)


def design(pieces: Sequence[Segment | Transition], s: np.ndarray, rounding: float = ROUNDING) -> dict[str, np.ndarray]:
    """Curvature (1/m), cant (m) and gradient (-) of a line of `pieces` at the distances `s`, from 0 on.

    The linear ramps of the transitions meet the constant pieces with corners rounded over the length `rounding` (m):
    the piecewise linear course is averaged with the weight (1 + cos(2 pi x / rounding)) / rounding. This keeps the
    change of heading and height exactly and makes the second derivative continuous: without it a vehicle meets pulses
    of roll acceleration at the corners that no real track has.

    Raises
    ------
    InputError : no pieces, a length that is not positive or shorter than `rounding`, a transition without neighbours of
        constant geometry, or a step between neighbours.
    """
    knots, values = _course(pieces, rounding)
    return {key: _rounded(s, knots, column, rounding) for key, column in values.items()}


def _course(pieces: Sequence[Segment | Transition], rounding: float) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Ends of the pieces (m) and the values there."""
    for number, piece in enumerate(pieces, 1):
        if not rounding <= piece.length < np.inf or piece.length <= 0:
            raise InputError(f"piece {number} is {piece.length:g} m long; make it at least {rounding:g} m")
    if not pieces:
        raise InputError("the line has no pieces; give at least one")
    knots = np.concatenate([[0.0], np.cumsum([piece.length for piece in pieces])])
    ends: list[Segment | None] = [None] * len(knots)
    for i, piece in enumerate(pieces):
        if isinstance(piece, Segment):
            before = ends[i]
            if before is not None and dataclasses.replace(before, length=piece.length) != piece:
                raise InputError(f"pieces {i} and {i + 1} meet with a step; put a transition between them")
            ends[i] = ends[i + 1] = piece
    known = [end for end in ends if end is not None]
    if len(known) < len(ends):
        raise InputError("a transition stands at an end or beside another; put a segment of constant geometry there")
    keys = ("curvature", "cant", "gradient")
    return knots, {key: np.array([getattr(end, key) for end in known]) for key in keys}


def _rounded(s: np.ndarray, knots: np.ndarray, values: np.ndarray, rounding: float) -> np.ndarray:
    slopes = np.concatenate([[0.0], np.diff(values) / np.diff(knots), [0.0]])
    result = np.full(s.shape, values[0])
    for knot, change in zip(knots, np.diff(slopes), strict=True):
        if change:
            result = result + change * rounded_ramp(s - knot, rounding)
    return result


def rounded_ramp(x: np.ndarray, width: float) -> np.ndarray:
    """max(x, 0) averaged with the weight (1 + cos(2 pi x / width)) / width over |x| < width / 2."""
    if width == 0:
        return np.maximum(x, 0)
    inside = np.clip(x, -width / 2, width / 2)
    wave = width / (4 * np.pi**2) * (1 + np.cos(2 * np.pi * inside / width))
    return (inside + width / 2) ** 2 / (2 * width) - wave + np.maximum(x - width / 2, 0)
