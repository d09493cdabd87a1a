"""Linear equations (16) to (18) of Ward et al. 2011, Appendix 2, as matrices.

Two things of the printed equations:

- (17) and (18) print the steering moment as 2 l^2 f11 lambda y / r0: a force times a squared length. The term of (12)
  with the radii of (1) is 2 l f11 lambda y / r0, and only this has Klingel's wavelength. The matrices have 2 l;
  `as_printed=True` gives the other.
- The track's displacement d is not written in them. It enters as in the nonlinear ones: y - d where a term comes from
  rolling radius or roll (and dy/dt - dd/dt in the roll rate), absolute y elsewhere.

The contact angles in these equations are those of a cone, constant over y.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import root_scalar

from railsim.errors import InputError
from railsim.wheelset.equations import MASS_Y, MASS_Y_RATE, STATES, Y_RATE, YAW, YAW_RATE, Y
from railsim.wheelset.parameters import Coefficients, WheelsetParameters


@dataclass(frozen=True)
class LinearWheelset:
    """dx/dt = state_matrix x + track_matrix (d, dd/dt).

    Attributes
    ----------
    state_matrix : (6, 6), states as in `railsim.wheelset.equations`.
    track_matrix : (6, 2), for the mean lateral displacement of the rails in m and its rate in m/s.
    roll_by_shift : roll angle by y - d, lambda / l, in rad/m.
    """

    state_matrix: np.ndarray
    track_matrix: np.ndarray
    roll_by_shift: float

    def eigenvalues(self) -> np.ndarray:
        """Eigenvalues in 1/s, the least damped first."""
        values = np.linalg.eigvals(self.state_matrix)
        return values[np.argsort(-values.real, kind="stable")]


def full_linear(
    parameters: WheelsetParameters, conicity: float, speed: float, as_printed: bool = False
) -> LinearWheelset:
    """Equations (13) to (17).

    Parameters
    ----------
    conicity : lambda of equation (1) (-).
    speed : V in m/s.
    as_printed : take 2 l^2 for 2 l in the steering moment of (17).

    Raises
    ------
    InputError : the speed is not positive.
    """
    c = parameters.coefficients()
    by_shift, by_shift_rate, by_state = _lateral(c, conicity, _checked(speed))
    yaw_by_shift = -_steering(c, conicity, as_printed)
    yaw_by_shift_rate = -c.I_wy * speed * conicity / (c.r0 * c.l) + 2 * c.f23 * c.r0 * conicity / (speed * c.l)
    yaw_by_state = _yaw_suspension(c)
    yaw_by_state[Y_RATE] += 2 * c.f23 / speed
    yaw_by_state[YAW] += -2 * c.f23 + c.l * c.W * conicity
    yaw_by_state[YAW_RATE] += -2 * (c.l**2 * c.f11 + c.f33) / speed
    return _assemble(c, conicity, (by_shift, by_shift_rate, by_state), (yaw_by_shift, yaw_by_shift_rate, yaw_by_state))


def simplified_linear(
    parameters: WheelsetParameters, conicity: float, speed: float, as_printed: bool = False
) -> LinearWheelset:
    """Equation (18) for the yaw, with (13) to (16) for the rest; parameters as in `full_linear`."""
    c = parameters.coefficients()
    yaw_by_state = _yaw_suspension(c)
    yaw_by_state[YAW_RATE] += -2 * c.l**2 * c.f11 / _checked(speed)
    return _assemble(
        c, conicity, _lateral(c, conicity, speed), (-_steering(c, conicity, as_printed), 0.0, yaw_by_state)
    )


def critical_speed(
    parameters: WheelsetParameters, conicity: float, low: float = 1.0, high: float = 200.0
) -> float | None:
    """Lowest speed in m/s between `low` and `high` above which a motion of (13) to (17) grows; None without one.

    Raises
    ------
    InputError : already unstable at `low`.
    """

    def growth(speed: float) -> float:
        return float(full_linear(parameters, conicity, speed).eigenvalues()[0].real)

    if growth(low) > 0:
        raise InputError(
            f"the wheelset is already unstable at {low:g} m/s; start the search lower or give it stiffness"
        )
    speeds = np.geomspace(low, high, 200)
    above = next((index for index, speed in enumerate(speeds) if growth(speed) > 0), None)
    if above is None:
        return None
    return float(root_scalar(growth, bracket=(speeds[above - 1], speeds[above]), xtol=1e-10).root)


Row = tuple[float, float, np.ndarray]
"""Force or moment by y - d, by its rate (contact geometry only), and by the state."""


def _lateral(c: Coefficients, conicity: float, speed: float) -> Row:
    """Right-hand side of (16) without m."""
    by_state = np.zeros(STATES)
    by_state[[Y, Y_RATE, MASS_Y, MASS_Y_RATE]] = -c.k_y, -c.f_y - 2 * c.f22 / speed, c.k_y, c.f_y
    by_state[[YAW, YAW_RATE]] = 2 * c.f22, -2 * c.f23 / speed
    return -c.W * conicity / c.l, -2 * c.f22 * c.r0 * conicity / (speed * c.l), by_state


def _yaw_suspension(c: Coefficients) -> np.ndarray:
    by_state = np.zeros(STATES)
    by_state[[YAW, YAW_RATE]] = -c.k_psi, -c.f_psi
    return by_state


def _steering(c: Coefficients, conicity: float, as_printed: bool) -> float:
    return 2 * (c.l**2 if as_printed else c.l) * c.f11 * conicity / c.r0


def _assemble(c: Coefficients, conicity: float, lateral: Row, turning: Row) -> LinearWheelset:
    a, b = np.zeros((STATES, STATES)), np.zeros((STATES, 2))
    for place, rate in ((Y, Y_RATE), (YAW, YAW_RATE), (MASS_Y, MASS_Y_RATE)):
        a[place, rate] = 1.0
    for row, inertia, (by_shift, by_shift_rate, by_state) in ((Y_RATE, c.m, lateral), (YAW_RATE, c.I, turning)):
        a[row] = by_state / inertia
        a[row, [Y, Y_RATE]] += by_shift / inertia, by_shift_rate / inertia
        b[row] = -by_shift / inertia, -by_shift_rate / inertia
    a[MASS_Y_RATE, [Y, Y_RATE, MASS_Y, MASS_Y_RATE]] = np.array([c.k_y, c.f_y, -c.k_y, -c.f_y]) / c.m_m
    return LinearWheelset(a, b, conicity / c.l)


def _checked(speed: float) -> float:
    if not speed > 0:
        raise InputError(f"speed {speed:g} m/s: the creepages need a positive speed; give one")
    return speed
