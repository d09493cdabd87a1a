"""Verdicts on components from the mean and standard deviation of their parameters."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from estimators.vehicle.affine import PARAMETERS

SURE = 2.0  # standard deviations that a verdict keeps from its limit
WORN, FAILED = 0.75, 0.25  # of the nominal damping (illustrative)
BLUNT = 0.3  # of the nominal damping: a wider standard deviation tells nothing
HOLLOW = 0.4  # conicity above which wheels are due (illustrative)
COMPONENTS = ("secondary lateral dampers", "secondary yaw dampers", "wheel profiles")


def verdicts(mean: np.ndarray, std: np.ndarray, nominal: np.ndarray) -> list[dict[str, Any]]:
    """One entry a component, in the order of `PARAMETERS`.

    Parameters
    ----------
    mean, std, nominal : of C_sy, C_spsi and conicity, SI units, shape (3,).
    """
    entries = []
    for i, (component, parameter) in enumerate(zip(COMPONENTS, PARAMETERS, strict=True)):
        unit = parameter.partition(" [")[2].rstrip("]")
        what = damper(mean[i], std[i], nominal[i]) if i < 2 else profiles(mean[i], std[i])
        entries.append(
            {"component": component, "verdict": what, "value": float(mean[i]), "unit": unit, "std": float(std[i])}
        )
    return entries


def damper(value: float, std: float, nominal: float) -> str:
    """Healthy, degraded, failed or unknown; in doubt the better, so that a healthy damper is not called degraded. Not
    there, where the vehicle is built without.
    """
    if nominal <= 0.0:
        return "not there"
    if not np.isfinite(value) or std > BLUNT * nominal:
        return "unknown"
    if value + SURE * std < FAILED * nominal:
        return "failed"
    return "degraded" if value + SURE * std < WORN * nominal else "healthy"


def profiles(value: float, std: float) -> str:
    """Healthy, degraded (above the limit) or unknown."""
    if not np.isfinite(value) or std > HOLLOW / 2.0:
        return "unknown"
    return "degraded" if value - SURE * std > HOLLOW else "healthy"


def alarms(series: Mapping[str, Any], nominal: np.ndarray, after: float) -> np.ndarray:
    """Instants (s) at which one of the dampers was called degraded or failed, for a series of an estimate."""
    time = np.asarray(series["time [s]"], dtype=float)
    wrong = np.zeros(len(time), dtype=bool)
    for name, whole in zip(PARAMETERS[:2], nominal[:2], strict=True):
        mean, std = np.asarray(series[name], dtype=float), np.asarray(series[std_name(name)], dtype=float)
        wrong |= [damper(m, s, whole) in ("degraded", "failed") for m, s in zip(mean, std, strict=True)]
    return time[wrong & (time >= after)]


def std_name(name: str) -> str:
    """Name of the column that holds the standard deviation of the column `name`."""
    quantity, _, unit = name.partition(" [")
    return f"{quantity}_std [{unit}"
