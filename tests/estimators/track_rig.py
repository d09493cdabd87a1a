"""A rigid bogie on a made-up track, for tests of track geometry: closed forms, no dynamics."""

from collections.abc import Callable

import numpy as np

from railsim.measurements import Measurements

ARM = 1.28  # m, semi wheelbase
RATE, SLOW = 256.0, 64.0
VEHICLE: dict[str, float] = {
    "body_mass": 16_000.0,
    "bogie_mass": 2_615.0,
    "bogie_pitch_inertia": 1e-3,  # follows at once
    "primary_vertical_stiffness": 1.22e6,
    "primary_vertical_damping": 4e3,
    "secondary_vertical_stiffness": 430e3,
    "secondary_vertical_damping": 20e3,
    "primary_half_spacing": 1.0,
    "semi_wheelbase": ARM,
    "wheel_radius": 0.46,
}
Shape = Callable[[np.ndarray], np.ndarray]


def wave(length: float, size: float = 2e-3) -> Shape:
    """A sine of that wavelength and amplitude, m."""
    return lambda s: size * np.sin(2 * np.pi * s / length)


def flat(s: np.ndarray) -> np.ndarray:
    """Nothing."""
    return np.zeros_like(s)


def ride(
    speed: np.ndarray,
    vertical: Shape = flat,
    lateral: Shape = flat,
    cross_level: Shape = flat,
    place: float = 0.0,
    bias: float = 0.0,
) -> Measurements:
    """What sensors on a rigid bogie feel whose wheelsets follow the track exactly.

    Parameters
    ----------
    speed : m/s at 256 Hz. vertical, lateral, cross_level : of the track over distance, m. place : of the accelerometer
    before the bogie's centre, m. bias : of the gyros, rad/s.
    """
    time = np.arange(len(speed)) / RATE
    s = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 / RATE)])

    def rate(values: np.ndarray) -> np.ndarray:
        return np.gradient(values, time)

    height = (vertical(s + ARM) + vertical(s - ARM)) / 2
    pitch = -(vertical(s + ARM) - vertical(s - ARM)) / (2 * ARM)
    yaw = (lateral(s + ARM) - lateral(s - ARM)) / (2 * ARM)
    roll = -(cross_level(s + ARM) + cross_level(s - ARM)) / 2 / 1.5
    sensed = {
        "bogie.acceleration_z [m/s2]": 9.81 + rate(rate(height - place * pitch)),
        "bogie.rate_roll [rad/s]": rate(roll) + bias,
        "bogie.rate_pitch [rad/s]": rate(pitch) + bias,
        "bogie.rate_yaw [rad/s]": rate(yaw) + bias,
    }
    every = round(RATE / SLOW)
    mean = np.diff(s[::every], prepend=-speed[0] / SLOW) * SLOW
    tables = {RATE: {"time [s]": time, **sensed}, SLOW: {"time [s]": time[::every], "wheelset1.speed [m/s]": mean}}
    sheet = {"name": "bogie", "channels": list(sensed)[:1], "position": [place, 0.0, 0.0], "errors": {}}
    return Measurements({"origin": "track_rig", "vehicle": VEHICLE, "sensors": [sheet]}, tables)
