"""Samples of a channel on an even grid."""

import numpy as np

from estimators.signals.bands import stretches
from estimators.speed.odometry import LONGEST_STEP
from railsim.measurements import Measurements


def on_grid(measurements: Measurements, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Samples of a channel on the grid of its rate from its first time on, bridged where lost, and which may be used:
    those that were measured, and short gaps. Shapes (n,).
    """
    time, rate = measurements.time(name), measurements.rate(name)
    rows = np.round((time - time[0]) * rate).astype(int)
    known = np.isfinite(measurements[name])
    good = np.zeros(rows[-1] + 1, dtype=bool)
    good[rows] = known
    for first, last in stretches(~good):
        good[first:last] = (last - first + 1) / rate <= LONGEST_STEP
    at = np.arange(rows[-1] + 1)
    return (np.interp(at, rows[known], measurements[name][known]) if known.any() else np.zeros(len(at))), good
