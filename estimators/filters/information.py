"""What a set of sensors can tell of the track at all: posterior spectrum of the linear model (Cramer-Rao bound).

For stationary Gaussian signals no estimator has less error at wavenumber W than the diagonal of
    S_post(W) = [S_track(W)^-1 + H(W)' S_noise(W)^-1 H(W)]^-1
with one row and column for each quantity of the track, which the smoother reaches (Wiener 1949; for processes the
bound is van Trees', with the prior in it). What the model says wrongly comes on top: with the best gains
G = S_post H' S_noise^-1, an error dH of the responses leaves G dH times the track.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import fft
from scipy.ndimage import uniform_filter1d

from estimators.filters.track_spectrum import Noise, TrackSpectrum
from estimators.signals.bands import Band, response
from estimators.vehicle.state_space import System

SHORTEST, LONGEST, POINTS = 0.5, 1e4, 600  # m, m, -: wavelengths of the integrals
BEYOND = 3.0  # of its edges: what a band's filter leaves farther out (1e-4) is not looked at


def wavenumbers() -> np.ndarray:
    """Angular wavenumbers for integrals, rad/m, equally spaced in the logarithm."""
    return np.geomspace(2 * np.pi / LONGEST, 2 * np.pi / SHORTEST, POINTS)


def band_rms(k: np.ndarray, density: np.ndarray, band: Band | None = None) -> float:
    """Root of the integral of a density over wavenumbers k (rad/m), over a band by the response of the band filters."""
    weight = 1.0 if band is None else response(k, band) ** 2
    return float(np.sqrt(np.trapezoid(density * weight * k, np.log(k))))


@dataclass(frozen=True)
class Information:
    """Spectra of what is known of the quantities of the track, all one-sided over the wavenumber in rad/m.

    Attributes
    ----------
    wavenumber : rad/m, shape (k,).
    tracks : prior densities, m^2/(rad/m), shape (k, q).
    H : responses of the readings to the quantities, shape (k, m, q).
    noise : covariance spectrum of the readings' noise, shape (k, m, m).
    wrong : deviations of H, each by one unknown, shape (unknowns, k, m, q).
    """

    wavenumber: np.ndarray
    tracks: np.ndarray
    H: np.ndarray
    noise: np.ndarray
    wrong: np.ndarray

    @cached_property
    def weighed(self) -> np.ndarray:
        """H' S^-1, shape (k, q, m)."""
        return np.swapaxes(np.linalg.solve(self.noise, self.H).conj(), 1, 2)

    @cached_property
    def posterior(self) -> np.ndarray:
        """Posterior densities, shape (k, q, q); computed for quantities of unit prior, which may differ in size."""
        size = np.sqrt(self.tracks)
        seen = size[:, :, None] * (self.weighed @ self.H) * size[:, None, :]
        return size[:, :, None] * np.linalg.inv(np.eye(self.tracks.shape[1]) + seen) * size[:, None, :]

    @cached_property
    def bound(self) -> np.ndarray:
        """Posterior density of each quantity, m^2/(rad/m), shape (k, q)."""
        return np.real(np.diagonal(self.posterior, axis1=1, axis2=2))

    @cached_property
    def with_model_error(self) -> np.ndarray:
        """The bound and what the unknowns in the model leave, m^2/(rad/m), shape (k, q)."""
        return self.bound + np.einsum("ukab,kb->ka", np.abs(self.left) ** 2, self.tracks)

    @cached_property
    def left(self) -> np.ndarray:
        """What the smoother makes of each unknown, of one quantity (third axis) per metre of another (last axis)."""
        return (self.posterior @ self.weighed)[None] @ self.wrong

    @cached_property
    def readings(self) -> np.ndarray:
        """Density of each reading by the track, shape (k, m)."""
        return np.einsum("kmq,kq->km", np.abs(self.H) ** 2, self.tracks)

    def local(self, values: np.ndarray, spacing: float, band: Band) -> np.ndarray:
        """Variance that the unknowns leave in a band of each quantity, m^2, along the track as it was found (n, q).

        To first order the error is the sum over the unknowns of z G dH * irregularity with z of unit variance, so that
        its size goes with what the track really has where the model is unsure, not with a smooth spectrum. It is
        averaged over the longest wave.
        """
        reach = round(band.longest / spacing)
        padded = np.pad(values, ((min(reach, len(values) - 1),) * 2, (0, 0)), mode="reflect")
        size = int(fft.next_fast_len(len(padded), real=True) or len(padded))
        k = 2 * np.pi * fft.rfftfreq(size, spacing)
        inside = slice(*np.searchsorted(k, [2 * np.pi / (BEYOND * band.longest), 2 * np.pi * BEYOND / band.shortest]))
        spectrum = (np.asarray(fft.rfft(padded, size, axis=0)) * response(k, band)[:, None])[inside]
        total, error = np.zeros(padded.shape), np.zeros((len(k), values.shape[1]), dtype=complex)
        cell, share = _between(k[inside], self.wavenumber)
        for one in self.left:
            gain = one[cell] + share[:, None, None] * (one[cell + 1] - one[cell])
            error[inside] = np.einsum("kab,kb->ka", gain, spectrum)
            total += np.asarray(fft.irfft(error, size, axis=0))[: len(padded)] ** 2
        first = (len(padded) - len(values)) // 2
        return uniform_filter1d(total, max(1, reach), axis=0, mode="nearest")[first : first + len(values)]

    def mistaken(self, values: np.ndarray, spacing: float, unknown: int) -> np.ndarray:
        """What one unknown, by one standard deviation, makes the smoother find beside the track, m, shape (n, q).

        `values` : the track, shape (n, q), on a grid of `spacing` m.
        """
        size = int(fft.next_fast_len(2 * len(values), real=True) or 2 * len(values))
        k = 2 * np.pi * fft.rfftfreq(size, spacing)
        inside = slice(*np.searchsorted(k, self.wavenumber[[0, -1]]))
        cell, share = _between(k[inside], self.wavenumber)
        left = self.left[unknown]
        gain = left[cell] + share[:, None, None] * (left[cell + 1] - left[cell])
        error = np.zeros((len(k), values.shape[1]), dtype=complex)
        error[inside] = np.einsum("kab,kb->ka", gain, np.asarray(fft.rfft(values, size, axis=0))[inside])
        return np.asarray(fft.irfft(error, size, axis=0))[: len(values)]

    def rms(self, density: np.ndarray, band: Band | None = None) -> float:
        """Root of the integral of a density, over a band by the response of the band filters, m."""
        return band_rms(self.wavenumber, density, band)


def information(
    systems: Sequence[System],
    priors: Sequence[TrackSpectrum],
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
    priors : of the quantities of the track.
    speed, wheelbase : m/s, m.
    scales : standard deviations of the readings' scale factors, shape (m,).
    distance_error : relative standard deviation of distance and speed (the odometer's wheel radius).
    """
    H, wrong = responses(systems, speed, wheelbase, scales, distance_error)
    return spectra(H, wrong, priors, noise, speed)


def responses(
    systems: Sequence[System], speed: float, wheelbase: float, scales: np.ndarray, distance_error: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """`H` and `wrong` of `Information`; arguments as of `information`."""
    k = wavenumbers()

    def response_of(system: System, base: float) -> np.ndarray:
        lead, trail = np.split(system.response(k * speed), 2, axis=2)
        return lead + trail * np.exp(-1j * k * base)[:, None, None]

    H = response_of(systems[0], wheelbase)
    others = [response_of(one, wheelbase) for one in systems[1:]]
    others.append(response_of(systems[0], wheelbase * (1 + distance_error)))
    return H, np.stack([other - H for other in others] + [H * one[:, None] for one in np.diag(scales)])


def spectra(
    H: np.ndarray, wrong: np.ndarray, priors: Sequence[TrackSpectrum], noise: Noise, speed: float
) -> Information:
    """Spectra at one speed from the responses; other arguments as of `information`."""
    k = wavenumbers()
    tracks = np.stack([one.density(k) for one in priors], axis=1).reshape(len(k), len(priors))
    return Information(k, tracks, H, sensor_noise(k, noise, speed), wrong)


def sensor_noise(k: np.ndarray, noise: Noise, speed: float) -> np.ndarray:
    """Covariance spectrum of the readings' white and drifting noise at wavenumbers, one-sided, shape (k, m, m)."""
    time = noise.drift_time
    drift = 4 * noise.drift**2 * time / (1 + (np.outer(k, time) * speed) ** 2)
    white = (noise.density**2 + drift) * speed / (2 * np.pi)
    return np.einsum("km,ml->kml", white, np.eye(len(noise.density))).astype(complex)


def _between(k: np.ndarray, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cell of each wavenumber between nodes, and how far in it."""
    cell = np.clip(np.searchsorted(nodes, k) - 1, 0, len(nodes) - 2)
    return cell, (k - nodes[cell]) / (nodes[cell + 1] - nodes[cell])


def deviations(
    system: Callable[[dict[str, float]], System], vehicle: dict[str, float], changes: Sequence[Mapping[str, float]]
) -> list[System]:
    """The plane with the given parameters, then with each set of changes: of the logarithms of the parameters."""
    return [system(one) for one in (vehicle, *(changed(vehicle, change) for change in changes))]


def changed(vehicle: dict[str, float], change: Mapping[str, float]) -> dict[str, float]:
    """Parameters with changed logarithms; what is not given is 1."""
    return vehicle | {name: vehicle.get(name, 1.0) * float(np.exp(by)) for name, by in change.items()}
