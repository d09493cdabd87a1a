"""Cramér-Rao bound of the conicity for a filter that knows the track's spectrum and not the track.

The linear model of `conicity_ekf_track` at constant speed makes stationary signals; their spectral matrix S(f) depends
on the conicity and on the levels of track and gauge, and Whittle's form of the Fisher information of a record of T
seconds is J_ij = T times the integral of tr(S^-1 dS_i S^-1 dS_j) over the frequencies from 0 to half the sample rate.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from estimators.vehicle.single_wheelset import (
    MASS_Y,
    MASS_Y_RATE,
    STATES,
    Y_RATE,
    YAW_RATE,
    Y,
    coefficients,
    linear,
    wheelset_model,
)
from estimators.wheel_rail.conicity_ekf_track import ConicityEkfTrack
from estimators.wheel_rail.contact_filter import APART, LATERAL, MASS, YAW_GYRO, Settings

CHANNELS = (LATERAL, MASS, YAW_GYRO, APART)
FREQUENCIES = 2000
STEP = 1e-3  # of a parameter's logarithm


def conicity_bound(
    about: Mapping[str, Any], conicity: float, speed: float, duration: float, rate: float = 256.0
) -> float:
    """Smallest standard deviation (-) of an unbiased estimate of a constant conicity, track and gauge unknown in level.

    Parameters
    ----------
    about : of the recording: vehicle and data sheets. conicity : true (-). speed : m/s. duration : s. rate : Hz.
    """
    estimator = ConicityEkfTrack()
    settings = estimator.online(about, rate).settings
    frequencies = (np.arange(FREQUENCIES) + 0.5) * rate / 2.0 / FREQUENCIES
    model = wheelset_model(about["vehicle"], estimator.creep)

    def spectrum(logs: np.ndarray) -> np.ndarray:
        level = np.exp(logs)
        return channel_spectrum(model, settings, speed, rate, frequencies, level[0] * conicity, level[1:])

    inverse = np.linalg.inv(spectrum(np.zeros(3)))
    changes = [inverse @ (spectrum(STEP * unit) - spectrum(-STEP * unit)) / (2.0 * STEP) for unit in np.eye(3)]
    per_second = rate / 2.0 / FREQUENCIES
    information = [
        [per_second * float(np.einsum("fij,fji->", one, other).real) for other in changes] for one in changes
    ]
    return conicity * float(np.sqrt(np.linalg.inv(duration * np.array(information))[0, 0]))


def channel_spectrum(
    model: Any,
    settings: Settings,
    speed: float,
    rate: float,
    frequencies: np.ndarray,
    conicity: float,
    levels: np.ndarray,
) -> np.ndarray:
    """Two-sided spectral matrices (frequencies, channels, channels); `levels`: factors of track and gauge (std)."""
    a, b = linear(model, conicity, speed)
    _, _, of_radii, _ = coefficients(model, speed)
    s = 2j * np.pi * frequencies
    track = b[:, :1] + s[:, None, None] * b[:, 1:]
    gauge, pushes = np.zeros((STATES, 1)), np.zeros((STATES, 2))
    gauge[[Y_RATE, YAW_RATE], 0] = of_radii * conicity
    pushes[Y_RATE, 0] = pushes[YAW_RATE, 1] = 1.0
    shape = (len(s), STATES, 1)
    inputs = np.concatenate(
        [track, np.broadcast_to(gauge, shape), np.broadcast_to(pushes, (len(s), STATES, 2))], axis=2
    )
    states = np.linalg.solve(s[:, None, None] * np.eye(STATES) - a, inputs)
    rows = {LATERAL: s[:, None] * states[:, Y_RATE], MASS: s[:, None] * states[:, MASS_Y_RATE]}
    rows |= {YAW_GYRO: states[:, YAW_RATE], APART: states[:, MASS_Y] - states[:, Y]}
    response = np.stack([rows[channel] for channel in CHANNELS], axis=1)
    low, high, own = settings.poles * speed
    density = np.empty((len(s), 4))
    density[:, 0] = 2.0 * low * high * (low + high) / np.abs((s + low) * (s + high)) ** 2
    density[:, 0] *= settings.drive[0] * levels[0] ** 2
    density[:, 1] = 2.0 * own / np.abs(s + own) ** 2 * settings.drive[1] * levels[1] ** 2
    density[:, 2:] = settings.noise**2 * settings.step
    noise = np.diag(settings.readings[list(CHANNELS)] / rate)
    return np.einsum("fci,fi,fdi->fcd", response, density, response.conj(), optimize=True) + noise
