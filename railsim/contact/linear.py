"""Kalker's linear creep law: what the estimators' models take, and the limit of every other law at small creepage."""

from typing import NamedTuple

from railsim.compiled import kernel
from railsim.contact.hertz import hertz_ellipse
from railsim.contact.kalker import kalker_coefficients
from railsim.contact.polach import SHEAR


class CreepCoefficients(NamedTuple):
    """Fx = -f11 vx, Fy = -f22 vy - f23 phi of one wheel; Kalker's C33 is not in the project's table, so no f33."""

    f11: float  # longitudinal [N]
    f22: float  # lateral [N]
    f23: float  # lateral by spin [N m]


@kernel
def linear_force(creep_x, creep_y, spin, a, b, c11, c22, c23):
    """Creep force on the wheel (x forward, y in the contact plane) [N], without limit (Kalker 1967).

    Parameters
    ----------
    creep_x, creep_y : creepages [-]; spin : spin creepage [1/m].
    a, b : longitudinal and lateral semi-axis [m]; c11, c22, c23 : Kalker's coefficients.
    """
    area = SHEAR * a * b
    return -area * c11 * creep_x, -area * (c22 * creep_y + (a * b) ** 0.5 * c23 * spin)


def creep_coefficients(
    curvature_longitudinal: float, curvature_lateral: float, normal: float, share: float = 1.0
) -> CreepCoefficients:
    """Linear creep coefficients of a Hertzian contact.

    Parameters
    ----------
    curvature_longitudinal, curvature_lateral : sums of both bodies' curvatures [1/m].
    normal : normal force [N].
    share : of Kalker's slope, (kA + kS) / 2 for contaminated rails (Polach 2005).

    Raises
    ------
    ValueError : a sum of curvatures is not positive.
    """
    ellipse = hertz_ellipse(curvature_longitudinal, curvature_lateral)
    a, b = ellipse.longitudinal * normal ** (1.0 / 3.0), ellipse.lateral * normal ** (1.0 / 3.0)
    c11, c22, c23 = kalker_coefficients(a / b)
    area = share * SHEAR * a * b
    return CreepCoefficients(area * c11, area * c22, area * (a * b) ** 0.5 * c23)
