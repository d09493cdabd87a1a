"""Relations of the rigid body over time, and what all of them say of one channel."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from railsim.measurements import Measurements
from railsim.quality._rigid import Relation, window_of
from railsim.quality._signals import limit

COARSE = 64.0  # Hz, of the relations over time


@dataclass(frozen=True)
class Balance:
    """A relation over time, noise by the data sheets made white.

    Attributes
    ----------
    parts : what each channel adds to the sum, by name, shape (n,). total : the sum, shape (n,).
    noise : variance of each part by its channel's noise, shape (n,).
    tolerance : energy that data sheets allow. freedom : independent values.
    """

    parts: Mapping[str, np.ndarray]
    total: np.ndarray
    noise: Mapping[str, np.ndarray]
    tolerance: float
    freedom: int


def exact(relation: Relation) -> bool:
    """Whether a relation holds in the whole band; those that hold at low frequencies only are approximate."""
    return all(np.all(weight != 0.0) for weight in relation.weights.values())


def balance(
    relation: Relation,
    measured: Measurements,
    frequency: np.ndarray,
    spectra: Mapping[str, np.ndarray],
    seconds: float,
    taper: float | None = None,
) -> Balance:
    """A relation over time, from spectra over `frequency` (Hz) of a record of `seconds`; `taper` as they were made."""
    count = round(seconds * COARSE)
    at = np.rint(frequency * seconds).astype(int)
    white = whitening(relation, measured, frequency)

    def over_time(values: np.ndarray) -> np.ndarray:
        whole = np.zeros(count // 2 + 1, dtype=complex)
        whole[at] = values * white
        return np.fft.irfft(whole, count) * math.sqrt(count / 2)

    parts = {name: over_time(weight * spectra[name]) for name, weight in relation.weights.items()}
    sizes = [float(one @ one) for one in parts.values()]
    plain = [float(np.sum(np.abs(weight * spectra[name]) ** 2)) for name, weight in relation.weights.items()]
    window = window_of(measured, list(spectra), seconds, taper)[:count] ** 2 / (2.0 * seconds * count)
    own = {
        name: float(np.sum(np.abs(weight * white) ** 2)) * density(measured, name) ** 2 * window
        for name, weight in relation.weights.items()
    }
    tolerance = relation.tolerance * sum(sizes) / max(sum(plain), 1e-30)
    return Balance(parts, np.sum(list(parts.values()), axis=0), own, tolerance, 2 * at.size)


def whitening(relation: Relation, measured: Measurements, frequency: np.ndarray) -> np.ndarray:
    """Filter that makes the noise of a relation's sum white by the data sheets, over frequency (Hz), shape (k,)."""
    noise = sum(np.abs(weight) ** 2 * density(measured, name) ** 2 for name, weight in relation.weights.items())
    return 1.0 / np.sqrt(np.maximum(noise, 1e-30) / np.mean(noise)) if np.any(noise) else np.ones(frequency.size)


def density(measured: Measurements, name: str) -> float:
    """Noise density of a channel by its data sheet, with the rounding, unit of the channel / sqrt(Hz)."""
    rounding = limit(measured, name, "resolution") / math.sqrt(6.0 * measured.rate(name))
    return math.hypot(limit(measured, name, "noise_density"), rounding)
