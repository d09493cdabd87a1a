"""Made-up estimates of passes over one track: known irregularities, errors as stated, odometers that differ."""

from typing import Any

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from estimators.signals.bands import BANDS, band_pass

SPACING = 0.125  # m
LENGTH = 1200.0  # m


def track(seed: int = 5) -> tuple[np.ndarray, np.ndarray]:
    """(places, D1 of 1 mm rms), m."""
    s = np.arange(0.0, LENGTH + 40.0, SPACING)
    rough = np.random.default_rng(seed).standard_normal(s.size)
    d1 = band_pass(rough, SPACING, BANDS["d1"])
    return s, 1e-3 * d1 / d1.std()


def ride(
    *,
    seed: int,
    error: float = 1e-4,
    scale: float = 0.0,
    dip: float = 0.0,
    at: float = 550.0,
    rough: float = 1.0,
    speed: float = 30.0,
    **more: Any,
) -> Estimate:
    """One pass.

    Parameters
    ----------
    seed : of its errors.
    error : their standard deviation in D1, m, and what the pass states.
    scale : share by which its odometer is wrong.
    dip : depth of a dip at `at`, m. rough : factor of the irregularities from 800 m on.
    """
    places, d1 = track()
    d1 = np.where(places >= 800.0, rough, 1.0) * d1 - dip * np.exp(-(((places - at) / 2.5) ** 2))
    s = np.arange(0.0, LENGTH, SPACING)
    noise = band_pass(np.random.default_rng(seed).standard_normal(s.size), SPACING, BANDS["d1"])
    values = np.interp(s * (1.0 + scale), places, d1) + error * noise / noise.std()
    columns = {
        "s [m]": s,
        "time [s]": s / speed,
        "vertical_d1 [m]": values,
        "vertical_d1_std [m]": np.full(s.size, error),
    }
    return Estimate("mine", pd.DataFrame({**columns, "valid [-]": np.ones(s.size), **more}))
