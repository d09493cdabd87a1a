"""Power spectral densities of track irregularities: ERRI B176 (low, high) and FRA classes 1 to 6.

Convention here: one-sided densities S(W) over the angular wavenumber W in rad/m (W > 0), in m^2/(rad/m), so that the
variance is the integral of S over W. Publications differ: many print the same formulas without saying whether they are
one- or two-sided; read as two-sided densities the same constants give sqrt(2) times our standard deviations. Read
one-sided, ERRI low gives a vertical standard deviation of 1.0 mm in the band D1 (3 to 25 m), that of ordinary
main-line track.

Quantities: vertical and lateral are the mean of both rails, cross level is the height difference of the rails 1.5 m
apart, gauge is the change of their lateral distance. The formulas do not say how the quantities hang together: they are
taken as independent.

ERRI B176 (1989), with S0 = Wc^2 / ((W^2 + Wr^2) (W^2 + Wc^2)):
    vertical Av S0, lateral Al S0, gauge Ag S0 W^2 / (W^2 + Ws^2),
    roll angle of the track (rad^2/(rad/m)) Av S0 W^2 / (b^2 (W^2 + Ws^2)), b = 0.75 m half the distance of the rails;
    the height difference is the angle times 2 b, which takes b out: cross level 4 Av S0 W^2 / (W^2 + Ws^2).
FRA (Hamid and others, 1983, as commonly restated with the safety factor k = 0.25):
    vertical k Av Wc^2 / (W^2 (W^2 + Wc^2)), alignment (lateral) the same with Aa,
    cross level and gauge each 4 k Av Wc^2 / ((W^2 + Wc^2) (W^2 + Ws^2)), as height and as distance.
    Formulas and constants (cm^2 rad/m) are those of secondary sources; the original report was not at hand.
"""

import dataclasses

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import quad

from railsim.errors import InputError
from railsim.registry import pick

QUANTITIES = ("vertical", "lateral", "cross_level", "gauge_deviation")
"""Columns of a track that a spectrum set describes."""
WR, WS, WC = 0.0206, 0.438, 0.8246
"""Corners of the spectra of ERRI B176 (1989), rad/m, in the symbols above."""


@dataclasses.dataclass(frozen=True)
class Spectrum:
    """S(W) = amplitude W^power / product of (W^2 + corner^2), one-sided, m^2/(rad/m), corners in rad/m."""

    amplitude: float
    power: int
    corners: tuple[float, ...]

    def density(self, wavenumber: ArrayLike) -> np.ndarray:
        """One-sided density in m^2/(rad/m) at angular wavenumbers in rad/m (greater than zero)."""
        w = np.asarray(wavenumber, dtype=float)
        result = self.amplitude * w**self.power
        for corner in self.corners:
            result = result / (w**2 + corner**2)
        return result


@dataclasses.dataclass(frozen=True)
class Band:
    """Band of wavelengths in m: full density from `shortest` to `longest`, none beyond a factor `skirt` outside.

    Over the skirts the density is weighted by half a cosine wave in the logarithm of the wavenumber.
    """

    shortest: float = 3.0
    longest: float = 100.0
    skirt: float = 1.25

    def __post_init__(self) -> None:
        if not 0 < self.shortest < self.longest < np.inf or not 1 < self.skirt < np.inf:
            raise InputError(
                f"wavelengths from {self.shortest:g} to {self.longest:g} m with skirt {self.skirt:g} make no band;"
                " give 0 < shortest < longest and a skirt greater than 1"
            )

    def weight(self, wavenumber: ArrayLike) -> np.ndarray:
        """Factor of the density, 0 to 1, at angular wavenumbers in rad/m (greater than zero)."""
        wavelength = np.log(2 * np.pi / np.asarray(wavenumber, dtype=float))
        beyond = np.maximum(np.log(self.shortest) - wavelength, wavelength - np.log(self.longest))
        return (1 + np.cos(np.pi * np.clip(beyond / np.log(self.skirt), 0, 1))) / 2

    def corners(self) -> list[float]:
        """The four wavenumbers between which the weight is smooth, rad/m, increasing."""
        lengths = (self.longest * self.skirt, self.longest, self.shortest, self.shortest / self.skirt)
        return [2 * np.pi / length for length in lengths]


def variance(spectrum: Spectrum, band: Band) -> float:
    """Variance in m^2 of an irregularity with this density within the band (integral of the weighted density)."""

    def integrand(log_wavenumber: float) -> float:
        w = np.exp(log_wavenumber)
        return float(spectrum.density(w) * band.weight(w) * w)

    edges = np.log(band.corners())
    parts = zip(edges[:-1], edges[1:], strict=True)
    return sum(float(quad(integrand, low, high, epsrel=1e-10)[0]) for low, high in parts)


def spectra(name: str) -> dict[str, Spectrum]:
    """Spectra of `QUANTITIES` for "erri_low", "erri_high", "fra_1" ... "fra_6".

    Raises
    ------
    InputError : unknown name.
    """
    return pick(_all(), name, "track spectrum")


def names() -> list[str]:
    """Names that `spectra` knows."""
    return sorted(_all())


def _all() -> dict[str, dict[str, Spectrum]]:
    # ERRI B176 constants in m rad (shared reference data, "Other facts"): vertical, lateral, gauge.
    densities = {
        "erri_low": _erri(4.032e-7, 2.119e-7, 5.32e-8),
        "erri_high": _erri(1.08e-6, 6.125e-7, 1.032e-7),
    }
    # FRA: Av, Aa in cm^2 rad/m, Ws in rad/m (same place).
    classes = {
        1: (1.2107, 3.3634, 0.6046),
        2: (1.0181, 1.2107, 0.9308),
        3: (0.6816, 0.4128, 0.8520),
        4: (0.5376, 0.3027, 1.1312),
        5: (0.2095, 0.0762, 0.8209),
        6: (0.0339, 0.0339, 0.4380),
    }
    return densities | {f"fra_{number}": _fra(*constants) for number, constants in classes.items()}


def _erri(vertical: float, lateral: float, gauge: float) -> dict[str, Spectrum]:
    return {
        "vertical": Spectrum(vertical * WC**2, 0, (WR, WC)),
        "lateral": Spectrum(lateral * WC**2, 0, (WR, WC)),
        "cross_level": Spectrum(4 * vertical * WC**2, 2, (WR, WC, WS)),
        "gauge_deviation": Spectrum(gauge * WC**2, 2, (WR, WC, WS)),
    }


def _fra(vertical: float, alignment: float, short: float) -> dict[str, Spectrum]:
    factor, cut = 0.25, 0.8245  # k, Wc in rad/m
    square_metres = 1e-4  # per cm^2
    high = factor * vertical * square_metres * cut**2
    side = factor * alignment * square_metres * cut**2
    return {
        "vertical": Spectrum(high, 0, (0.0, cut)),
        "lateral": Spectrum(side, 0, (0.0, cut)),
        "cross_level": Spectrum(4 * high, 0, (cut, short)),
        "gauge_deviation": Spectrum(4 * high, 0, (cut, short)),
    }
