"""Rolling radius and contact angle of both wheels over the lateral shift of the wheelset relative to the rails."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from railsim.errors import InputError
from railsim.wheelset.parameters import WheelsetParameters

RADIUS = 0
"""Rolling radius, m."""
ANGLE = 1
"""Contact angle relative to the axle, rad, positive where the radius grows towards the flange."""


class RollingTable(NamedTuple):
    """Tables of both wheels that the compiled equations read.

    start : first shift, m. spacing : width of a cell, m. cells : their number.
    coefficients : (2, cells, 2, 4): side (left, right), cell, RADIUS or ANGLE, powers of the distance into it in m.

    Both wheels are tabled as left ones: the argument is the shift towards the wheel's own flange, y - d on the left,
    d - y on the right. So a table with equal sides is symmetric to the last bit.
    """

    start: float
    spacing: float
    cells: int
    coefficients: np.ndarray

    @property
    def reach(self) -> float:
        """Largest shift to either side, m, that the table knows."""
        return min(-self.start, self.start + self.spacing * self.cells)


def conical(conicity: float, wheel_radius: float, reach: float = 0.1) -> RollingTable:
    """Contact of equation (1) of Ward et al. 2011: (r_L - r_R) / 2 = lambda (y - d), (delta_L + delta_R) / 2 = lambda.

    Parameters
    ----------
    conicity : lambda, change of radius by the lateral shift of the wheelset's centre (-).
    wheel_radius : r0 in m.
    reach : largest shift in m.
    """
    coefficients = np.zeros((2, 1, 2, 4))
    coefficients[:, 0, RADIUS, :2] = wheel_radius - conicity * reach, conicity
    coefficients[:, 0, ANGLE, 0] = conicity
    return RollingTable(-reach, 2 * reach, 1, coefficients)


def cone_conicity(slope: float, parameters: WheelsetParameters) -> float:
    """Conicity lambda over the centre's shift, of wheels that are cones of that `slope`.

    The roll phi moves the contact along the axle by r0 phi, so the radii differ by 2 slope (y + r0 phi), and l phi is
    half of that: lambda = slope / (1 - slope r0 / l) (Wickens 2003, Fundamentals of Rail Vehicle Dynamics). With this
    lambda, rolling without slip in equations (11) and (12) has exactly Klingel's wavelength 2 pi sqrt(r0 l / slope).
    With the slope in the place of lambda it is longer by the square root of 1 + r0 lambda / l.
    """
    return slope / (1.0 - slope * parameters.wheel_radius / parameters.half_width)


def cone(slope: float, parameters: WheelsetParameters, reach: float = 0.1) -> RollingTable:
    """Contact of wheels that are cones of the given `slope` (-)."""
    return conical(cone_conicity(slope, parameters), parameters.wheel_radius, reach)


def rolling_table(
    shift: ArrayLike,
    radius: ArrayLike,
    angle: ArrayLike,
    right_radius: ArrayLike | None = None,
    right_angle: ArrayLike | None = None,
) -> RollingTable:
    """Table of cubic splines through given contact functions.

    Parameters
    ----------
    shift : lateral shifts in m towards the wheel's own flange, uniform, at least four, on both sides of zero.
    radius, angle : rolling radius in m and contact angle in rad of the left wheel at `shift`.
    right_radius, right_angle : the same of the right wheel, over its own shift towards its flange; equal to the
        left's when omitted.

    Raises
    ------
    InputError : shifts that are not uniform, too few, or do not enclose zero; arrays of another length; values not
        finite.
    """
    u = np.asarray(shift, dtype=float)
    if u.ndim != 1 or u.size < 4 or not np.allclose(np.diff(u), (u[-1] - u[0]) / (u.size - 1), rtol=1e-6, atol=0):
        raise InputError(
            "contact functions: the shifts must be at least four, increasing and equally spaced; resample them"
        )
    if not u[0] < 0 < u[-1]:
        raise InputError("contact functions: the shifts must enclose zero; give both directions from the centred place")
    left = (radius, angle)
    right = (radius if right_radius is None else right_radius, angle if right_angle is None else right_angle)
    values = [np.asarray(column, dtype=float) for column in (*left, *right)]
    if any(column.shape != u.shape or not np.isfinite(column).all() for column in values):
        raise InputError("contact functions: radius and angle need one finite value for each shift; mend the table")
    spacing = (u[-1] - u[0]) / (u.size - 1)
    splines = CubicSpline(u, np.stack(values, axis=-1)).c[::-1]
    coefficients = np.transpose(splines, (2, 1, 0)).reshape(2, 2, u.size - 1, 4).transpose(0, 2, 1, 3)
    return RollingTable(float(u[0]), float(spacing), u.size - 1, np.ascontiguousarray(coefficients))
