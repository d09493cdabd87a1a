"""What a set of sensors can tell of the track at all: posterior spectrum of the linear model (Cramer-Rao bound).

For stationary Gaussian signals no estimator has less error at wavenumber W than
    1 / S_post(W) = 1 / S_track(W) + sum over sensors |H_j(W)|^2 / S_noise,j(W),
which the smoother reaches (Wiener 1949; for processes the bound is van Trees', with the prior in it). What the model
says wrongly comes on top: with the best gains W_j, an error dH_j of the responses leaves |sum W_j dH_j|^2 S_track.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import fft
from scipy.ndimage import uniform_filter1d

from estimators._bands import Band, response
from estimators._planes import System
from estimators._shaping import Noise, Prior

SHORTEST, LONGEST, POINTS = 0.5, 1e4, 600  # m, m, -: wavelengths of the integrals


def wavenumbers() -> np.ndarray:
    """Angular wavenumbers for integrals, rad/m, equally spaced in the logarithm."""
    return np.geomspace(2 * np.pi / LONGEST, 2 * np.pi / SHORTEST, POINTS)


@dataclass(frozen=True)
class Information:
    """Spectra of what is known of one quantity of the track, all one-sided over the wavenumber in rad/m.

    Attributes
    ----------
    wavenumber : rad/m, shape (k,).
    track : prior density, m^2/(rad/m), shape (k,).
    H : responses of the readings, shape (k, m).
    noise : covariance spectrum of the readings' noise, shape (k, m, m).
    wrong : deviations of H, each by one unknown, shape (unknowns, k, m).
    """

    wavenumber: np.ndarray
    track: np.ndarray
    H: np.ndarray
    noise: np.ndarray
    wrong: np.ndarray

    @cached_property
    def weighed(self) -> np.ndarray:
        """H' S^-1, shape (k, m)."""
        return np.linalg.solve(self.noise.conj(), self.H[..., None].conj())[..., 0]

    @cached_property
    def bound(self) -> np.ndarray:
        """Posterior density, m^2/(rad/m)."""
        return 1.0 / (1.0 / self.track + np.einsum("km,km->k", self.weighed, self.H).real)

    @cached_property
    def with_model_error(self) -> np.ndarray:
        """The bound and what the unknowns in the model leave, m^2/(rad/m)."""
        return self.bound + self.track * np.sum(np.abs(self.left) ** 2, axis=0)

    @cached_property
    def left(self) -> np.ndarray:
        """What the smoother makes of each unknown per metre of irregularity, W dH, shape (unknowns, k)."""
        gains = self.bound[:, None] * self.weighed
        return np.einsum("km,ukm->uk", gains, self.wrong)

    def local(self, values: np.ndarray, spacing: float, band: Band) -> np.ndarray:
        """Variance that the unknowns leave in a band of an irregularity, m^2, along it, mean over the longest wave.

        To first order the error is the sum over the unknowns of z W dH * irregularity with z of unit variance, so that
        its size goes with what the track really has where the model is unsure, not with a smooth spectrum.
        """
        reach = round(band.longest / spacing)
        padded = np.pad(values, min(reach, len(values) - 1), mode="reflect")
        size = int(fft.next_fast_len(len(padded), real=True) or len(padded))
        k = 2 * np.pi * fft.rfftfreq(size, spacing)
        spectrum = np.asarray(fft.rfft(padded, size)) * response(k, band)
        total = np.zeros(len(padded))
        for one in self.left:
            error = np.asarray(fft.irfft(spectrum * np.interp(k, self.wavenumber, one), size))
            total += error[: len(padded)] ** 2
        first = (len(padded) - len(values)) // 2
        return uniform_filter1d(total, max(1, reach), mode="nearest")[first : first + len(values)]

    def rms(self, density: np.ndarray, band: Band | None = None) -> float:
        """Root of the integral of a density, over a band by the response of the band filters, m."""
        weight = 1.0 if band is None else response(self.wavenumber, band) ** 2
        return float(np.sqrt(np.trapezoid(density * weight * self.wavenumber, np.log(self.wavenumber))))


def information(
    systems: Sequence[System],
    prior: Prior,
    noise: Noise,
    speed: float,
    wheelbase: float,
    scales: np.ndarray,
    distance_error: float = 0.0,
) -> Information:
    """Spectra at one speed.

    Parameters
    ----------
    systems : the plane as it is taken to be, then with each unknown of the vehicle off by one standard deviation.
    speed, wheelbase : m/s, m.
    scales : standard deviations of the readings' scale factors, shape (m,).
    distance_error : relative standard deviation of distance and speed (the odometer's wheel radius).
    """
    k = wavenumbers()
    apart = [wheelbase] * len(systems) + [wheelbase * (1 + distance_error)]
    responses = [
        np.einsum("kmi,ki->km", one.response(k * speed), np.stack([np.ones_like(k), np.exp(-1j * k * base)], axis=1))
        for one, base in zip([*systems, systems[0]], apart, strict=True)
    ]
    H = responses[0]
    wrong = [other - H for other in responses[1:]] + [H * one for one in np.diag(scales)]
    time = noise.drift_time
    drift = 4 * noise.drift**2 * time / (1 + (np.outer(k, time) * speed) ** 2)
    white = (noise.density**2 + drift) * speed / (2 * np.pi)
    covariance = np.einsum("km,ml->kml", white, np.eye(len(noise.density))).astype(complex)
    if noise.drive.any():
        inside = systems[0].from_states(k * speed)
        covariance += np.einsum("kmn,n,kln->kml", inside, 2 * noise.drive * speed / (2 * np.pi), inside.conj())
    return Information(k, prior.density(k), H, covariance, np.stack(wrong))


def deviations(
    system: Callable[[dict[str, float]], System], vehicle: dict[str, float], unknown: dict[str, float]
) -> list[System]:
    """The plane with nominal parameters, then with each unknown off by its relative standard deviation."""
    varied = [vehicle | {name: vehicle[name] * (1 + share)} for name, share in unknown.items()]
    return [system(vehicle), *(system(one) for one in varied)]
