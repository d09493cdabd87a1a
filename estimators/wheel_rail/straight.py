"""Where a wheelset ran through a curve: estimators of its contact hold on straight track."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from estimators.interface import Estimate
from estimators.signals.curves import CURVED
from estimators.wheel_rail.wheelset_motion import YAW, wheelset_speed
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements

SLOWEST = 1.0  # m/s
LONG = 60.0  # m, over which curvature is averaged: irregularities of D2 have gone; its filters remember as far


def told_of_curves(estimate: Estimate, measurements: Measurements) -> Estimate:
    """The estimate, not valid where the wheelset ran through a curve, and a warning that names the stretches.

    In a curve the wheelset runs beside the middle of the track, which the models leave out. Where the gyro's bias is
    larger than its data sheet says, straight track looks like a curve; the warning tells of both.
    """
    time, curve = curves(measurements)
    if not curve.any():
        return estimate
    places = estimate.series["time [s]"].to_numpy(dtype=float)
    beside = np.interp(places, time, curve.astype(float)) > 0.0
    valid = estimate.series["valid [-]"].to_numpy() if "valid [-]" in estimate.series else np.ones(len(places))
    series = estimate.series.assign(**{"valid [-]": np.where(beside, 0.0, valid)})
    first, last = time[curve][[0, -1]]
    text = (
        f"a curve between {first:.0f} and {last:.0f} s ({curve.mean():.0%} of the record), or a yaw gyro whose bias is"
        " beyond its data sheet: wheel and rail are estimated for straight track only; use a straight section"
    )
    warnings = [*estimate.about.get("warnings", []), text]
    return replace(estimate, series=series, about={**estimate.about, "warnings": warnings})


def curves(measurements: Measurements) -> tuple[np.ndarray, np.ndarray]:
    """Times of the yaw gyro, s, and where the track is curved, shapes (n,)."""
    time, rate = measurements.time(YAW), measurements[YAW]
    speed = wheelset_speed(measurements, time)
    moving = speed > SLOWEST
    if not moving.any():
        return time, np.zeros(len(time), dtype=bool)
    turning = np.where(moving & np.isfinite(rate), rate, 0.0) / np.maximum(speed, SLOWEST)
    typical = float(np.median(speed[moving]))
    count = max(1, round(LONG / typical * measurements.rate(YAW)))
    bias = data_sheet(measurements.about, YAW).error("bias_std")
    sharp = np.abs(uniform_filter1d(turning, count)) > CURVED + 2.0 * bias / np.maximum(speed, SLOWEST)
    return time, maximum_filter1d(sharp & moving, count)
