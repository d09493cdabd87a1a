"""Recordings of a single wheelset with ideal sensors, from the closed equations of `railsim.wheelset`."""

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline

from railsim.measurements import Measurements
from railsim.track import Track
from railsim.vehicles.wheelset import WheelsetVehicle
from railsim.wheelset import RollingTable, WheelsetParameters, simulate_wheelset

RATE = 256.0
START = 40.0


def recording(contact: RollingTable, track: Track, speed: float, duration: float) -> tuple[Measurements, pd.DataFrame]:
    """Measurements and the table of the run; the tachometer reads the true speed, the survey is exact."""
    run = simulate_wheelset(WheelsetParameters(), contact, track, speed, duration, rate=RATE, start=START)
    time = run["time [s]"].to_numpy()
    columns = {
        "time [s]": time,
        "wheelset1.rate_yaw [rad/s]": run["wheelset.yaw_rate [rad/s]"].to_numpy(),
        "wheelset1.rate_roll [rad/s]": CubicSpline(time, run["wheelset.roll [rad]"])(time, 1),
        "body.acceleration_y [m/s2]": run["suspended_mass.y_acceleration [m/s2]"].to_numpy(),
        "suspension.displacement [m]": (run["suspended_mass.y [m]"] - run["wheelset.y [m]"]).to_numpy(),
        "wheelset1.speed [m/s]": np.full(len(time), speed),
    }
    vehicle = {"name": "wheelset", **WheelsetVehicle().nominal()}
    survey = pd.DataFrame({"s [m]": track.s, **{f"{key} [m]": value for key, value in track.columns().items()}})
    return Measurements({"origin": "test", "vehicle": vehicle, "sensors": []}, {RATE: columns}, survey), run


def waves(length: float, gauge: float = 0.0, seed: int = 3) -> Track:
    """Lateral irregularity of a dozen waves from 6 to 60 m and 2 mm, and as much gauge deviation as told (m)."""
    rng = np.random.default_rng(seed)
    s = np.arange(0.0, length, 0.2)
    columns = {}
    for name, size in (("lateral", 2e-3), ("gauge_deviation", gauge)):
        wavelength, phase = np.geomspace(6.0, 60.0, 12), rng.uniform(0.0, 2.0 * np.pi, 12)
        total = np.sum(np.sin(2.0 * np.pi * s[:, None] / wavelength + phase), axis=1)
        columns[name] = size * total / np.std(total)
    return Track(s, columns, "waves", [])
