"""Verdicts on components from the mean and standard deviation of their parameters.

A damper's damping C counts as normally distributed, not below zero. It is called where the odds that it is below a
limit are above 100, and healthy where they are below 1 in 100; between these, nothing is said.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.stats import norm

from estimators.vehicle.affine import PARAMETERS

ODDS = 100.0  # that a verdict needs ("decisive", Jeffreys 1961)
WORN, FAILED = 0.75, 0.25  # of the nominal damping (illustrative)
HOLLOW = 0.4  # conicity above which wheels are due (illustrative)
COMPONENTS = ("secondary lateral dampers", "secondary yaw dampers", "wheel profiles")
HEALTHY, DEGRADED, BROKEN, CANNOT_TELL, NOT_THERE = "healthy", "degraded", "failed", "cannot tell", "not there"
BAD = (DEGRADED, BROKEN)
WIDE = "its stated deviation is too wide for a verdict"


def verdicts(mean: np.ndarray, std: np.ndarray, nominal: np.ndarray, doubt: str = "") -> list[dict[str, Any]]:
    """One entry a component, in the order of `PARAMETERS`; with a "reason" where nothing can be told.

    Parameters
    ----------
    mean, std, nominal : of C_sy, C_spsi and conicity, SI units, shape (3,).
    doubt : why the model does not hold here, in words; no verdict is given then, but that a component is not there.
    """
    entries = []
    for i, (component, parameter) in enumerate(zip(COMPONENTS, PARAMETERS, strict=True)):
        unit = parameter.partition(" [")[2].rstrip("]")
        what = damper(mean[i], std[i], nominal[i]) if i < 2 else profiles(mean[i], std[i])
        if doubt and what != NOT_THERE:
            what = CANNOT_TELL
        value, spread = (float(one) if np.isfinite(one) else None for one in (mean[i], std[i]))
        entry = {"component": component, "verdict": what, "value": value, "unit": unit, "std": spread}
        entries.append(entry | ({"reason": doubt or WIDE} if what == CANNOT_TELL else {}))
    return entries


def below(value: float, std: float, limit: float) -> float:
    """Probability that a damping is below a limit; all in one unit."""
    if std <= 0.0:
        return float(value < limit)
    positive = norm.sf(-value / std)
    return float((norm.cdf((limit - value) / std) - norm.cdf(-value / std)) / positive) if positive > 0.0 else 1.0


def damper(value: float, std: float, nominal: float) -> str:
    """Healthy, degraded, failed or cannot tell; not there, where the vehicle is built without."""
    if nominal <= 0.0:
        return NOT_THERE
    if not np.isfinite(value) or not np.isfinite(std):
        return CANNOT_TELL
    sure = ODDS / (1.0 + ODDS)
    worn = below(value, std, WORN * nominal)
    if worn > sure:
        return BROKEN if below(value, std, FAILED * nominal) > sure else DEGRADED
    return HEALTHY if worn < 1.0 - sure else CANNOT_TELL


def profiles(value: float, std: float) -> str:
    """Healthy, degraded (above the limit) or cannot tell."""
    if not np.isfinite(value) or not np.isfinite(std):
        return CANNOT_TELL
    sure = ODDS / (1.0 + ODDS)
    hollow = 1.0 - below(value, std, HOLLOW)
    return DEGRADED if hollow > sure else HEALTHY if hollow < 1.0 - sure else CANNOT_TELL


def alarms(series: Mapping[str, Any], nominal: np.ndarray, after: float) -> np.ndarray:
    """Instants (s) at which one of the dampers was called degraded or failed, for a series of an estimate."""
    time = np.asarray(series["time [s]"], dtype=float)
    wrong = np.zeros(len(time), dtype=bool)
    for which in (0, 1):
        wrong |= np.array([one in BAD for one in said(series, which, float(nominal[which]))])
    return time[wrong & (time >= after)]


def said(series: Mapping[str, Any], which: int, nominal: float) -> list[str]:
    """Verdicts on the lateral (0) or yaw (1) dampers at each row of a series; where that is not valid, none."""
    mean, std = (np.asarray(series[one], dtype=float) for one in (PARAMETERS[which], std_name(PARAMETERS[which])))
    valid = np.asarray(series["valid [-]"], dtype=float) > 0.5 if "valid [-]" in series else np.ones(len(mean))
    return [
        damper(m, s, nominal) if ok or nominal <= 0.0 else CANNOT_TELL
        for m, s, ok in zip(mean, std, valid, strict=True)
    ]


def std_name(name: str) -> str:
    """Name of the column that holds the standard deviation of the column `name`."""
    quantity, _, unit = name.partition(" [")
    return f"{quantity}_std [{unit}"
