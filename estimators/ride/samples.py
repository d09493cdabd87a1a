"""Samples of a channel on an even grid."""

import numpy as np

from railsim.measurements import Measurements


def on_grid(measurements: Measurements, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Samples of a channel on the grid of its rate from its first time on, bridged where lost; which were measured.

    Shapes (n,).
    """
    time, rate = measurements.time(name), measurements.rate(name)
    rows = np.round((time - time[0]) * rate).astype(int)
    known = np.isfinite(measurements[name])
    good = np.zeros(rows[-1] + 1, dtype=bool)
    good[rows] = known
    at = np.arange(rows[-1] + 1)
    return (np.interp(at, rows[known], measurements[name][known]) if known.any() else np.zeros(len(at))), good
