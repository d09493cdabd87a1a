"""Where the calibration of the adhesion level does not hold: curves, and a wheelset that slides.

It knows straight track and wheels that roll. In a curve of radius R a wheelset stands aside by u = l r / (lambda R) to
roll freely; where that is as much as straight track makes it move, the creep forces are those of the curve. A wheel
that slides uses up its creep force along the track, and what is left across it is little. Both look like less adhesion
than there is.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from estimators.adhesion.bogie_place import places
from estimators.adhesion.channels import RATE, YAW
from estimators.adhesion.creep_model import ROLL_BODIES
from estimators.signals.channel_health import Health
from railsim.measurements import Measurements

ASIDE = 1e-3
"""Shift that a curve may ask for, m (illustrative: what good straight track does)."""
OVER = 2.0
"""Seconds over which the path's curvature is a mean."""
HARSH = 2.0
"""Change of the wheel's speed that no train makes, m/s2 (emergency brakes reach 1.2 to 1.5)."""
WITHIN = 0.5
"""Seconds over which that change is a mean."""


class Gate(NamedTuple):
    """What shuts windows out.

    Attributes
    ----------
    reason, help : in words. closed : samples that a window must not hold, (n,).
    """

    reason: str
    help: str
    closed: np.ndarray


def gates(
    measurements: Measurements, health: Health, time: np.ndarray, speed: np.ndarray, p: Mapping[str, float]
) -> tuple[Gate, ...]:
    """Curves and slides on a grid of `time` (s, uniform) with the wheel's speed (m/s)."""
    curve = np.abs(_curvature(measurements, health, time, speed)) * p["half_gauge"] * p["wheel_radius"]
    return (
        Gate("a curve", "straight track", curve > ASIDE * p["design_conicity"]),
        Gate("a wheelset that slides", "a stretch on which nothing slides", _slides(speed)),
    )


def _curvature(measurements: Measurements, health: Health, time: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Of the path, 1/m: what most yaw gyros agree on, so that the bias of one does not make a curve."""
    names = {
        name
        for place in places(measurements.vehicle)
        for body in ROLL_BODIES
        for name in place.channels(measurements, body, YAW)
        if body == "body" or name in health.good
    }
    rates = []
    for name in sorted(names):
        values = np.asarray(measurements[name], dtype=float)
        good = np.isfinite(values)
        if name in health.good:
            good &= health.good[name]
        if good.any():
            rates.append(_mean(np.interp(time, measurements.time(name)[good], values[good]), OVER))
    if not rates:
        return np.zeros(len(time))
    return np.median(rates, axis=0) / np.maximum(np.nan_to_num(speed), 1.0)


def _slides(speed: np.ndarray) -> np.ndarray:
    """From where the wheel slows down faster than a train to where it has its speed again, or the record ends."""
    change = np.gradient(_mean(np.nan_to_num(speed, nan=float(np.nanmean(speed))), WITHIN)) * RATE
    closed = np.abs(change) > HARSH
    begins = np.flatnonzero(change < -HARSH)
    if len(begins):
        regained = np.flatnonzero(change > HARSH)
        last = regained[-1] if len(regained) and regained[-1] > begins[0] else len(speed) - 1
        closed[begins[0] : last + 1] = True
    return closed


def _mean(values: np.ndarray, seconds: float) -> np.ndarray:
    return uniform_filter1d(values, max(1, round(seconds * RATE)), mode="nearest")
