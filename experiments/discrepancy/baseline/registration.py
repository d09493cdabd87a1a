"""Registration: where the recording began and how far off its speed is, from the lag between model and measurement."""

from itertools import islice

import numpy as np
from scipy.signal import butter, correlate, sosfiltfilt

from experiments.discrepancy.baseline.evidence import Evidence
from experiments.discrepancy.baseline.forward import Registration, forward_over
from railsim.errors import InputError

WINDOW = 6.0  # s
FARTHEST = 0.6  # s of lag that is searched to each side
BAND = (0.8, 12.0)  # Hz
ALIKE = 0.5  # correlation from which a window counts
PREFERRED = ("acceleration_z", "rate_pitch", "displacement", "rate_roll", "acceleration_y", "rate_yaw")
MOST = 3  # channels that count: the first of these that follow the track at all


def register(evidence: Evidence, tries: int = 3) -> Registration:
    """Start and scale of the speed by which the model's motion fits the measured one in time.

    Raises
    ------
    InputError : model and measurement have nothing in common in any window, so the track or the start is wrong.
    """
    registration = Registration(evidence.scenario.start)
    forward = forward_over(evidence, registration)
    z = np.zeros(len(forward.nuisances))
    for number in range(tries):
        prediction = forward.but(registration=registration).predict(z)
        time, lag, weight = _lags(evidence, prediction)
        if not len(time):
            raise InputError(
                "nothing in the recording follows the measured track; check the track file and 'start', "
                "or take a rougher section"
            )
        along = np.interp(time, *evidence.speed[:2]) * lag  # m that the model is behind
        travelled = np.interp(time, evidence.speed[0], _distance(*evidence.speed[:2]))
        offset, slope = robust_line(travelled, along, weight)
        registration = Registration(registration.start - offset, registration.scale * (1.0 - slope))
        if number and abs(offset) < 0.02 and abs(slope) < 1e-4:
            break
    return registration


def _distance(time: np.ndarray, speed: np.ndarray) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])


def _lags(evidence: Evidence, prediction: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middle of each window, how much later the measurement is than the model [s], and a weight, over channels."""
    ranked = [name for quantity in PREFERRED for name in evidence.channels if f".{quantity}" in name]
    following = (windows for name in ranked if (windows := _of_channel(evidence, prediction, name)))
    table = np.array([window for windows in islice(following, MOST) for window in windows]).reshape(-1, 3)
    return table[:, 0], table[:, 1], table[:, 2]


def _of_channel(evidence: Evidence, prediction: dict[str, np.ndarray], name: str) -> list[tuple[float, float, float]]:
    rate = evidence.rates[name]
    high = min(BAND[1], 0.4 * rate)
    sections = butter(2, (BAND[0], high), "bandpass", fs=rate, output="sos")
    measured, modelled = evidence.samples[name], prediction[name]
    count = min(len(measured), len(modelled))
    lost = ~np.isfinite(measured[:count])
    filled = np.where(lost, np.nanmean(measured), measured[:count])
    pair = [sosfiltfilt(sections, one - one.mean()) for one in (filled, modelled[:count])]
    size, reach = int(WINDOW * rate), int(FARTHEST * rate)
    out = []
    for first in range(int(rate), count - size, size // 2):
        here = slice(first, first + size)
        a, b = pair[0][here], pair[1][here]
        scale = np.sqrt(float(a @ a) * float(b @ b))
        if lost[here].mean() > 0.1 or scale <= 0.0:
            continue
        curve = correlate(a, b, mode="same")[size // 2 - reach : size // 2 + reach + 1] / scale
        peak = int(np.argmax(curve))
        if curve[peak] < ALIKE or not 0 < peak < 2 * reach:
            continue
        left, top, right = curve[peak - 1 : peak + 2]
        shift = peak - reach + 0.5 * (left - right) / (left - 2.0 * top + right)
        out.append(((first + size / 2) / rate, shift / rate, float(curve[peak]) ** 2))
    return out


def robust_line(x: np.ndarray, y: np.ndarray, weight: np.ndarray) -> tuple[float, float]:
    """Offset and slope of y over x, outliers weighted down (Tukey's biweight on iterated least squares).

    The slope is taken as small: a ridge of one metre per kilometre keeps few windows from inventing one.
    """
    design = np.column_stack([np.ones_like(x), x])
    value = np.array([float(np.median(y)), 0.0])
    ridge = np.diag([1e-6, 1e-4 * max(float(np.ptp(x)), 1.0) ** 2 / 1e2])
    for _ in range(12):
        away = y - design @ value
        spread = 1.48 * float(np.median(np.abs(away))) + 0.02
        kept = weight * np.clip(1.0 - (away / (4.0 * spread)) ** 2, 0.0, None) ** 2
        normal = design.T @ (kept[:, None] * design) + ridge
        value = np.linalg.solve(normal, design.T @ (kept * y))
    return float(value[0]), float(value[1])
