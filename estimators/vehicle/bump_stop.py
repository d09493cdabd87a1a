"""The lateral bump stop of the secondary suspension where cant does not balance the curve: body leaning on the stop.

Beyond its gap the stop's force is k (x - gap) + c (x - gap)^3 (Iwnicki 1998, Manchester benchmarks). The body rests at
the x0 where springs and stop carry its share of the unbalanced acceleration; it sways about it. For the linear model
the stop is a spring of the mean slope over that sway (statistical linearisation: Booton 1954, Caughey 1963); how much
the slope changes within the sway is the model's error there.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from estimators.vehicle.linear_model import Kinematics, reduce
from estimators.vehicle.suspension import body_above_springs, half_vehicle_bogies, heights, masses, roll_springs

SWAY = 0.0025  # m; standard deviation of the sway; tuned on curve_r400 and unseen_curve_r700 (2 to 3 mm)
LEFT_OUT = 1.4  # of the slope's deviation: what a spring of one slope leaves out; tuned likewise
FARTHEST = 0.1  # m
STEPS = (0.1, 0.4, 0.8, 1.6, 3.2, 6.4)  # slopes over that of the springs between which one serves


def slope(vehicle: Mapping[str, Any], unbalanced: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean slope of the stop's force, and how far it may be off, N/m, shapes (n,).

    Parameters
    ----------
    vehicle : nominal parameters. unbalanced : lateral acceleration that cant does not balance, m/s2, shape (n,).
    """
    p = vehicle
    gap, linear, cubic = (float(p.get(f"bump_stop_{name}", 0.0)) for name in ("gap", "stiffness", "cubic"))
    if not gap > 0.0:
        return np.zeros(len(unbalanced)), np.zeros(len(unbalanced))
    force = p["body_mass"] * np.abs(unbalanced) * leaning(p)
    x = np.linspace(0.0, FARTHEST, 2001)
    beyond = np.maximum(x - gap, 0.0)
    rest = np.interp(force, 2.0 * p["secondary_lateral_stiffness"] * x + linear * beyond + cubic * beyond**3, x)
    nodes, weights = np.polynomial.hermite_e.hermegauss(9)
    pressed = rest[:, None] + SWAY * nodes - gap
    slopes = np.where(pressed > 0.0, linear + 3.0 * cubic * pressed**2, 0.0)
    mean = slopes @ (weights / weights.sum())
    return mean, LEFT_OUT * np.sqrt(np.maximum((slopes - mean[:, None]) ** 2 @ (weights / weights.sum()), 0.0))


def leaning(p: Mapping[str, float]) -> float:
    """How many times further a body leans quasi-statically because its own weight tips it, the bogie held."""
    roll, bogies = ("body.roll",), half_vehicle_bogies(p)
    springs, weight = roll_springs(p, bogies), body_above_springs(p, bogies, heights(p))
    upright, tipped = (
        float(reduce(elements, masses(p, bogies, roll), Kinematics(roll)).stiffness[0, 0])
        for elements in (springs, springs + weight)
    )
    return upright / tipped


def steps(vehicle: Mapping[str, Any], unbalanced: np.ndarray) -> np.ndarray:
    """Number of the step of `STEPS` that each place belongs to, 0 where the stop does not count, shape (n,)."""
    mean, _ = slope(vehicle, unbalanced)
    return np.searchsorted(STEPS, mean / (2.0 * vehicle["secondary_lateral_stiffness"]))
