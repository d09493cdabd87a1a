"""What checks share: runs of samples, data sheets, whitened channels, places at rest."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.ndimage import maximum_filter1d
from scipy.signal import lfilter

from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements

NORMAL = 1.4826
"""Standard deviation over median absolute deviation, normal distribution."""
_ORDER = 32
BLOCK = 0.5  # s, of the local scale of the innovations


def runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """First and one past the last index of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return [(int(first), int(last)) for first, last in zip(edges[::2], edges[1::2], strict=True)]


def sheet(measured: Measurements, channel: str) -> Mapping[str, Any]:
    """Data sheet of the sensor of a channel; empty where none is stated."""
    return data_sheet(measured.about, channel).stated


def limit(measured: Measurements, channel: str, name: str) -> float:
    """A number from the errors of a data sheet; 0 where it is not stated."""
    return data_sheet(measured.about, channel).error(name)


def kind_of(measured: Measurements, channel: str) -> str:
    """Kind of the sensor of a channel; "" where it is not stated."""
    return data_sheet(measured.about, channel).kind


def filled(values: np.ndarray) -> np.ndarray:
    """Lost samples interpolated, shape (n,); zeros where there is no sample at all."""
    lost = np.isnan(values)
    if not lost.any():
        return np.asarray(values)
    if lost.all():
        return np.zeros(values.size)
    at = np.arange(values.size)
    return np.interp(at, at[~lost], values[~lost])


@dataclass(frozen=True)
class Whitened:
    """A channel as its autoregressive model sees it.

    Attributes
    ----------
    filter : prediction-error filter, shape (p + 1,), first value 1.
    innovations : what the model does not predict over its local scale, shape (n,); 0 next to lost samples.
    scale : local standard deviation of the innovations by their median, shape (n,).
    """

    filter: np.ndarray
    innovations: np.ndarray
    scale: np.ndarray


def whitened(values: np.ndarray, rate: float) -> Whitened | None:
    """Autoregressive model by the Yule-Walker equations; None for a channel that is too short or does not change."""
    known = filled(values)
    centred = known - np.median(known)
    order = min(_ORDER, values.size // 20)
    spread = NORMAL * float(np.median(np.abs(centred)))
    if order < 1 or spread == 0.0:
        return None
    tame = np.clip(centred, -8 * spread, 8 * spread)
    size = 1 << (2 * tame.size - 1).bit_length()
    covariance = np.fft.irfft(np.abs(np.fft.rfft(tame, size)) ** 2)[: order + 1]
    covariance[0] *= 1 + 1e-9
    taps = np.concatenate([[1.0], -solve_toeplitz(covariance[:-1], covariance[1:])])
    error = np.asarray(lfilter(taps, [1.0], centred))
    near = np.convolve(np.isnan(values), np.ones(order + 1))[: values.size] > 0.5
    error[:order] = 0.0
    error[near] = 0.0
    scale = local_scale(error, max(4, round(BLOCK * rate)))
    return Whitened(taps, error / scale, scale)


def local_scale(error: np.ndarray, block: int) -> np.ndarray:
    """Largest of the robust scales of a block and its neighbours, never below half of the record's."""
    count = max(1, error.size // block)
    parts = np.array_split(np.abs(error), count)
    whole = NORMAL * float(np.median(np.abs(error[error != 0.0]))) if error.any() else 1.0
    each = np.array([NORMAL * float(np.median(part)) for part in parts])
    each = np.maximum(maximum_filter1d(each, 3), 0.5 * whole)
    return np.repeat(each, [part.size for part in parts])


def standing(measured: Measurements) -> np.ndarray | None:
    """Times [s] at which the vehicle stands by its tachometers or receiver, all that there are; None where none is."""
    common = None
    for name in measured:
        if name.endswith(".speed [m/s]"):
            time, slow = measured.time(name), np.abs(measured[name]) < (0.02 if "gnss" not in name else 0.3)
            also = True if common is None else np.interp(common[0], time, slow) > 0.5
            common = (time, slow) if common is None else (common[0], common[1] & also)
    return None if common is None else common[0][common[1]]


def chance(count: int, tests: float = 1.0, rate: float = 1e-6) -> float:
    """Normal deviate that none of `count` independent values in `tests` channels exceeds, but for the chance `rate`."""
    return math.sqrt(2.0 * math.log(max(2.0, count * tests / rate)))
