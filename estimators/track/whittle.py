"""Levels of the track's spectra, and how much the vehicle is disturbed otherwise, by Whittle's likelihood (1953).

With Y the readings' Fourier coefficients at wavenumber W, their covariance is S = H S_track H' + S_noise and the same
with what each unknown of the model changes in H (to first order, as if they were drawn anew at every wavenumber);
-log L = sum over W of log det S + Y' S^-1 Y. Neighbouring wavenumbers share one S.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.signal import get_window

from estimators.filters.information import Information
from estimators.signals.bands import stretches
from estimators.speed.odometry import Odometry
from estimators.track.observations import Observation

FITTED = (2.5, 60.0)  # m; wavelengths that are looked at
SLOWER = 0.6  # of the usual speed; slower, readings are scaled up by so much that their noise looks like track
SHORTEST = 256  # steps of the grid
BINS = 120  # equal in the logarithm of the wavenumber
LEVELS = (-22.0, -9.0)  # natural logarithm of the level in m rad: 3e-10 to 1e-4; ERRI's lie at -15
BEGIN, SIZES = 0.02, (-8.0, 5.0)  # disturbances: first guess; natural logarithms of the least and the largest


class Spectra(NamedTuple):
    """Averaged cross periodograms of the readings in bins.

    Attributes
    ----------
    wavenumber : rad/m, shape (b,). number : coefficients in each bin, shape (b,).
    density : one-sided, shape (b, m, m).
    """

    wavenumber: np.ndarray
    number: np.ndarray
    density: np.ndarray


def fit(
    observations: Sequence[Observation],
    odometry: Odometry,
    speed: float,
    model: Information,
    disturbances: np.ndarray,
    start: Sequence[float],
    where: np.ndarray,
    fixed: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Levels of the quantities, and sizes of the disturbances.

    Parameters
    ----------
    model : at that speed (m/s) for tracks of level 1, with the readings' noise.
    disturbances : spectra of the readings by each, at the model's wavenumbers, for size 1 and level 1 of each quantity,
        shape (quantities, disturbances, k, m, m).
    start : levels to begin with, and to stay with where too little was measured; sizes then are `BEGIN`.
    where : places that are looked at, shape (n,).
    fixed : the levels are known already.
    """
    seen = spectra(observations, odometry, speed, where)
    q, extra = len(start), disturbances.shape[1]
    if seen is None:
        return np.array(start), np.full(extra, BEGIN)
    H, tracks, noise = (_at(seen.wavenumber, model.wavenumber, one) for one in (model.H, model.tracks, model.noise))
    signals = np.einsum("bmq,bq,blq->qbml", H, tracks, H.conj())
    for one in model.wrong:  # what the model may have wrong counts as seen too
        off = _at(seen.wavenumber, model.wavenumber, one)
        signals += np.einsum("bmq,bq,blq->qbml", off, tracks, off.conj())
    by = np.moveaxis(_at(seen.wavenumber, model.wavenumber, np.moveaxis(disturbances, 2, 0)), 0, 2)

    def unlikely(logarithms: np.ndarray) -> float:
        levels, sizes = np.exp(logarithms[:q]), np.exp(2.0 * logarithms[q:])
        S = np.einsum("q,qbml->bml", levels, signals) + noise + np.einsum("q,j,qjbml->bml", levels, sizes, by)
        size = np.sqrt(np.einsum("bmm->bm", S).real)
        both = size[:, :, None] * size[:, None, :]
        misfit = np.einsum("bml,blm->b", np.linalg.inv(S / both), seen.density / both).real
        logs = np.linalg.slogdet(S / both)[1] + 2.0 * np.log(size).sum(axis=1)
        return float(np.sum(seen.number * (logs + misfit)) / seen.number.sum())

    first = np.log(start) + (0.0 if fixed else _too_high(seen, signals, start))
    begin = np.concatenate([first, np.full(extra, np.log(BEGIN))])
    bounds = ([(one, one) for one in first] if fixed else [LEVELS] * q) + [SIZES] * extra
    found: Any = minimize(unlikely, begin, method="L-BFGS-B", bounds=bounds, options={"ftol": 1e-7})
    return np.exp(found.x[:q]), np.exp(found.x[q:])


def _too_high(seen: Spectra, signals: np.ndarray, start: Sequence[float]) -> float:
    """Logarithm of what was seen over what the first levels make of it, median over the readings."""
    expected = np.einsum("q,qbmm->m", start, signals).real
    return float(np.median(np.log(np.einsum("bmm->m", seen.density).real / expected)))


def spectra(observations: Sequence[Observation], odometry: Odometry, speed: float, where: np.ndarray) -> Spectra | None:
    """Of the longest stretch that all readings have; None where that is too short. They are scaled to `speed`."""
    values = np.stack([one.values for one in observations], axis=1)
    known = where & np.isfinite(values).all(axis=1)
    known &= odometry.speed > SLOWER * speed
    ends = max(stretches(known), key=lambda ends: ends[1] - ends[0], default=(0, 0))
    if ends[1] - ends[0] < SHORTEST:
        return None
    piece = slice(*ends)
    speed_ratio = speed / odometry.speed[piece]
    values = values[piece] * np.stack(
        [speed_ratio if one.output.kind == "rate" else speed_ratio**2 for one in observations], axis=1
    )
    window = np.asarray(get_window("hann", len(values)))
    spectrum = np.fft.rfft((values - values.mean(axis=0)) * window[:, None], axis=0)
    k = 2 * np.pi * np.fft.rfftfreq(len(values), odometry.spacing)
    edges = np.geomspace(2 * np.pi / FITTED[1], 2 * np.pi / FITTED[0], BINS + 1)
    bin_of = np.searchsorted(edges, k) - 1
    inside = (bin_of >= 0) & (bin_of < BINS)
    used, bin_of = np.unique(bin_of[inside], return_inverse=True)
    count = np.bincount(bin_of).astype(float)
    density = np.zeros((len(used), values.shape[1], values.shape[1]), dtype=complex)
    np.add.at(density, bin_of, np.einsum("km,kl->kml", spectrum[inside], spectrum[inside].conj()))
    middle = np.bincount(bin_of, k[inside]) / count
    scale = odometry.spacing / np.sum(window**2) / np.pi
    return Spectra(middle, count, density * (scale / count)[:, None, None])


def _at(wavenumber: np.ndarray, nodes: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values between nodes, linear."""
    cell = np.clip(np.searchsorted(nodes, wavenumber) - 1, 0, len(nodes) - 2)
    share = (wavenumber - nodes[cell]) / (nodes[cell + 1] - nodes[cell])
    share = share.reshape(-1, *(1 for _ in values.shape[1:]))
    return values[cell] + share * (values[cell + 1] - values[cell])
