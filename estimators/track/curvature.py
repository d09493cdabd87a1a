"""Curvature and roll of the track as a bogie's gyros and accelerometer give them, with the primary suspension undone.

Pitch and bounce of the bogie give the motion of the line through the wheelsets and of their mean height (Ward et al.
2011, section 5.1; `vehicle.vertical`), roll of the bogie their mean roll (`vehicle.roll_plane`). The inverses act on
the rates over time, so they hold at any speed; a Gaussian low-pass keeps the noise down.

Over distance, wave number k, the rails' mean vertical u shows in the line through the wheelsets, 2 b apart, and in
their mean: curvature sin(kb) / (kb) u'' from the pitch rate and cos(kb) u'' from the acceleration over speed squared.
Each has waves that it cannot see, the wheelbase and its fractions among them; together they see all.
"""

from collections.abc import Callable, Mapping
from typing import Any, Literal

import numpy as np
import scipy.fft

from estimators.signals.bands import transform
from estimators.speed.bogie_channels import accelerometer_offset
from estimators.speed.odometry import Odometry
from estimators.track.dips import welch
from estimators.vehicle import roll_plane
from estimators.vehicle.roll_plane import parameters, roll_response
from estimators.vehicle.vertical import NEEDED, NEEDED_IN_PITCH, bounce_inverse, pitch_inverse
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements

BOUNCE = "bogie.acceleration_z [m/s2]"
PITCH = "bogie.rate_pitch [rad/s]"
ROLL = "bogie.rate_roll [rad/s]"
MEMORY = 1.0
"""Over which the inverse remembers, s: ten times the decay of the bogie's pitch."""

MISMATCH = 0.05
"""Relative error of the inverses, added to the sensors' noise when pitch and bounce are weighed (illustrative)."""
ROLL_ERROR = 0.1
"""Error of the bogie's roll over the wheelsets' (compiled engine against `vehicle.roll_plane`: to 0.2 around 14 Hz)."""
FAINT = 0.05
"""Least response that is divided by."""
ROLL_GRID = np.concatenate([np.linspace(0, 40, 401), np.geomspace(40.5, 4000, 40)])
"""Frequencies at which the response is computed, Hz."""
_SEGMENT = 512

Gain = Callable[[np.ndarray], np.ndarray]


def roll_inverse(vehicle: Mapping[str, Any]) -> tuple[Gain, Gain]:
    """Response from the bogie's roll rate to the wheelsets' mean one, over rad/s, at most 1 / `FAINT`; and how far it
    is to be trusted, 0 to 1: less where hardly any roll is left.
    """
    coarse = 2 * np.pi * ROLL_GRID
    response = roll_response(parameters(vehicle), coarse)

    def follows(omega: np.ndarray) -> np.ndarray:
        return np.interp(omega, coarse, np.real(response)) + 1j * np.interp(omega, coarse, np.imag(response))

    def gain(omega: np.ndarray) -> np.ndarray:
        seen = follows(omega)
        return np.conj(seen) / np.maximum(np.abs(seen), FAINT) ** 2

    def trust(omega: np.ndarray) -> np.ndarray:
        seen = np.abs(follows(omega)) ** 2
        return np.sqrt(seen / (seen + ROLL_ERROR**2))

    return gain, trust


def needed_parameters(measurements: Measurements) -> tuple[str, ...]:
    """The vehicle's parameters that are needed for the channels that are there."""
    upright = NEEDED if BOUNCE in measurements else NEEDED_IN_PITCH
    return tuple(dict.fromkeys((*upright, *(roll_plane.NEEDED if ROLL in measurements else ()))))


def over_distance(
    measurements: Measurements, odometry: Odometry, name: str, inverse: Gain, cut_off: float, power: int = 1
) -> tuple[np.ndarray, np.ndarray]:
    """A channel through its inverse and a Gaussian low-pass (standard deviation `cut_off` Hz), over speed ^ `power`.

    Returns
    -------
    Values on the grid, shape (n,), 0 where not valid, and where they are valid.
    """
    sheet = data_sheet(measurements.about, name)
    time = measurements.time(name) - sheet.error("latency")
    step = 1 / measurements.rate(name)
    values = np.where(np.isfinite(measurements[name]), measurements[name], np.nan)
    missing = ~np.isfinite(values)
    missing[1:] |= np.diff(time) > 2.5 * step

    def gain(omega: np.ndarray) -> np.ndarray:
        return inverse(omega) / sheet.low_pass(omega) * np.exp(-((omega / (2 * np.pi * cut_off)) ** 2) / 2)

    undone = transform(np.where(missing, np.nan, values), step, gain, MEMORY, detrend=False)
    rate, valid = odometry.resample(time, undone)
    return np.where(valid, rate / odometry.speed**power, 0.0), valid


def chord_rotation(measurements: Measurements, odometry: Odometry, cut_off: float) -> tuple[np.ndarray, np.ndarray]:
    """Rotation in pitch of the line through both wheelsets over the distance, rad/m, from the pitch rate.

    Returns
    -------
    Values on the grid, shape (n,), 0 where not valid, and where they are valid.
    """
    return over_distance(measurements, odometry, PITCH, pitch_inverse(measurements.vehicle).whole, cut_off)


def vertical(
    measurements: Measurements, odometry: Odometry, cut_off: float
) -> tuple[np.ndarray, np.ndarray, Literal["chord", "rail"]]:
    """Vertical curvature on the grid, 1/m, hollow +, shape (n,), where it is valid, and what it is.

    "rail": of the rails' mean under the bogie's centre, from pitch rate and vertical acceleration; "chord": of the line
    through both wheelsets, where there is no accelerometer.
    """
    pitch, valid = chord_rotation(measurements, odometry, cut_off)
    chord = -pitch
    if BOUNCE not in measurements:
        return chord, valid, "chord"
    bounce, both = _bounce(measurements, odometry, cut_off)
    valid = valid & both
    speed = float(np.median(odometry.speed[valid])) if valid.any() else 1.0
    size = scipy.fft.next_fast_len(len(chord), real=True) or len(chord)
    k = 2 * np.pi * np.fft.rfftfreq(size, odometry.spacing)
    arm = float(measurements.vehicle["semi_wheelbase"]) * k
    gain = pitch_inverse(measurements.vehicle).whole
    spread = _noise(measurements, PITCH, gain, k, speed, 1) + MISMATCH**2 * _power(chord, odometry.spacing, k)
    inverse = bounce_inverse(measurements.vehicle).whole
    other = _noise(measurements, BOUNCE, inverse, k, speed, 2) + MISMATCH**2 * _power(bounce, odometry.spacing, k)
    first, second = np.sinc(arm / np.pi), np.cos(arm)
    joined = first * np.fft.rfft(chord, size) / spread + second * np.fft.rfft(bounce, size) / other
    joined /= first**2 / spread + second**2 / other
    return np.where(valid, np.fft.irfft(joined, size)[: len(chord)], 0.0), valid, "rail"


def _bounce(measurements: Measurements, odometry: Odometry, cut_off: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean of the wheelsets' vertical acceleration over speed squared, 1/m, and where it is valid."""
    inverse = bounce_inverse(measurements.vehicle).whole
    values, valid = over_distance(measurements, odometry, BOUNCE, inverse, cut_off, 0)
    ahead = accelerometer_offset(measurements.about)
    if ahead:
        turned, both = over_distance(measurements, odometry, PITCH, lambda w: 1j * w * ahead * inverse(w), cut_off, 0)
        values, valid = values + turned, valid & both
    mean = float(np.mean(values[valid])) if valid.any() else 0.0
    return np.where(valid, (values - mean) / odometry.speed**2, 0.0), valid


def _noise(measurements: Measurements, name: str, inverse: Gain, k: np.ndarray, speed: float, power: int) -> np.ndarray:
    """Spectral density of a sensor's noise in the curvature, two-sided over wave number / 2 pi, 1/m."""
    density = data_sheet(measurements.about, name).density(measurements.rate(name)) ** 2
    return density / 2 * np.abs(inverse(k * speed)) ** 2 / speed ** (2 * power - 1) + 1e-20


def _power(values: np.ndarray, spacing: float, k: np.ndarray) -> np.ndarray:
    frequency, power = welch(values, spacing, min(_SEGMENT, len(values)))
    return np.interp(k / (2 * np.pi), frequency, power) / 2


def blur(speed: float, cut_off: float) -> float:
    """Standard deviation in m of the Gaussian that the low-pass is in space at `speed` m/s."""
    return speed / (2 * np.pi * cut_off)
