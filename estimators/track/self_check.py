"""The fused estimate checks itself: its readings against its model, and its bands against a plain estimate.

Three things are found out. Where the whitened readings are larger than chance lets them be (chi-square), deviations are
widened by their ratio. Where a plain estimate from the same sensors contradicts the fused one, the plain one is given.
Where the readings contradict the model and no other estimate is at hand, the band is withheld.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import chi2

from estimators.filters.information import band_rms, wavenumbers
from estimators.filters.track_spectrum import TrackSpectrum
from estimators.interface import Estimate
from estimators.signals.bands import BANDS, Band
from estimators.track.plane_fit import Misfit
from railsim.track.spectra import names, spectra

BEYOND_CHANCE = 3.7  # standard deviations that chance exceeds once in 10 000 (normal distribution, one side)
UNEXPLAINED = 1.5
"""Mean square over what is expected, from which on widening is no longer taken to be enough. A choice, made with two
recordings in view: a healthy whole vehicle (1.1) and one without yaw dampers (2.0, error seven times as stated).
"""
CONTRADICTED = 1e-3  # chance of the difference of two estimates below which they contradict each other


@dataclass(frozen=True)
class Opinion:
    """A plain estimate of the same quantity, with a column for each band and its deviation."""

    estimate: Estimate

    def band(self, name: str, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A band and its standard deviation at places, m; NaN where it says nothing.

        `name` : of the column without unit.
        """
        series = self.estimate.series
        s, valid = series["s [m]"].to_numpy(), series["valid [-]"].to_numpy() > 0.5
        values, std = (series[f"{one} [m]"].to_numpy() for one in (name, f"{name}_std"))
        known = np.isfinite(values) & np.isfinite(std) & valid
        if known.sum() < 2:
            return _unknown(places)
        near = np.interp(places, s, known.astype(float)) > 0.999
        found, spread = (np.where(near, np.interp(places, s[known], one[known]), np.nan) for one in (values, std))
        return found, spread


def checked(
    series: pd.DataFrame, quantity: str, misfit: Mapping[str, Misfit], opinion: Opinion | None
) -> tuple[dict[str, np.ndarray], list[str]]:
    """Columns of a quantity's bands that change, and what there is to say of them, in words.

    Parameters
    ----------
    series : of the estimate, with a column for each band and its deviation. misfit : of the plane, by band.
    """
    columns, words = dict[str, np.ndarray](), list[str]()
    places = series["s [m]"].to_numpy()
    for band, (ratio, deviations) in misfit.items():
        name, title = f"{quantity}_{band}", f"{quantity.replace('_', ' ')} {band.upper()}"
        value, std = series[f"{name} [m]"].to_numpy(), series[f"{name}_std [m]"].to_numpy()
        if ratio > 1.0:
            std = std * np.sqrt(ratio)
            columns[f"{name}_std [m]"] = std
        other, spread = _unknown(places) if opinion is None else opinion.band(name, places)
        both = np.isfinite(value) & np.isfinite(other)
        if opinion is not None and both.any():
            apart = float(np.sqrt(np.mean((value - other)[both] ** 2)))
            expected = float(np.sqrt(np.mean((std**2 + spread**2)[both])))
            if _contradict(apart, expected, both.sum() * _step(places), BANDS[band]):
                columns |= {f"{name} [m]": other, f"{name}_std [m]": spread}
                words.append(
                    f"{title}: fused estimate and {opinion.estimate.name} differ by {1e3 * apart:.2g} mm, more than "
                    f"their deviations allow; the values of {opinion.estimate.name} are given"
                )
        elif deviations > BEYOND_CHANCE and ratio > UNEXPLAINED:
            columns[f"{name} [m]"] = np.full(len(places), np.nan)
            words.append(
                f"{title} withheld: the readings are {np.sqrt(ratio):.2g} times as far from the vehicle's model as "
                "noise and known errors explain, and no other estimate of these sensors can tell which is right"
            )
    return columns, words


def _unknown(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nothing said at places."""
    return np.full(len(places), np.nan), np.full(len(places), np.nan)


def _step(places: np.ndarray) -> float:
    return float(np.median(np.diff(places)))


def _contradict(apart: float, expected: float, length: float, band: Band) -> bool:
    """Whether a difference is larger than chance lets it be; over L metres a band has 2 L (1/shortest - 1/longest)
    independent values.
    """
    freedom = max(1.0, 2.0 * length * (1.0 / band.shortest - 1.0 / band.longest))
    return apart**2 > expected**2 * float(chi2.isf(CONTRADICTED, freedom)) / freedom


@cache
def gauge_over_vertical(band: str) -> float:
    """Gauge deviation over vertical alignment, rms over the spectra of ERRI B176 and of the FRA's classes."""
    k, ratios = wavenumbers(), []
    for name in names():
        of = spectra(name)
        gauge, vertical = (
            band_rms(k, of[quantity].density(k), BANDS[band]) for quantity in ("gauge_deviation", "vertical")
        )
        ratios.append(gauge / vertical)
    return float(np.sqrt(np.mean(np.square(ratios))))


def sinking(vehicle: Mapping[str, Any], prior: TrackSpectrum) -> dict[str, float]:
    """Standard deviation of a wheelset's height over the rails in each band, m.

    Where gauge widens by g, both wheels run g / 2 further out on treads of slope delta and sink by delta g / 2. Sensors
    of the vertical plane show the wheelsets' height and nothing of the gauge.
    """
    slope = float(vehicle.get("design_contact_angle", vehicle.get("design_conicity", 0.0)))
    k = wavenumbers()
    heights = prior.density(k)
    return {name: 0.5 * slope * gauge_over_vertical(name) * band_rms(k, heights, band) for name, band in BANDS.items()}
