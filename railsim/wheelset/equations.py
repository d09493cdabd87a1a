"""Nonlinear equations (11) to (15) of Ward et al. 2011, Appendix 2, compiled.

State: y, dy/dt, psi, dpsi/dt, y_m, dy_m/dt (m, m/s, rad, rad/s, m, m/s); y to the left and psi to the left positive.

The track's lateral displacement d moves the rails under the wheelset, so the contact geometry (rolling radii, contact
angles, and with the radii the roll angle) is a function of y - d, for each rail its own d. The creepages keep the
absolute dy/dt, because the rail's material is at rest. The roll angle follows from the radii to first order,
phi = (r_L - r_R) / (2 l); so dphi/dt contains dd/dt.

Equation (13) lacks its left-hand side in the copy at hand. The force on the suspended mass is minus the one on the
wheelset: m_m y_m'' = -F_s.
"""

import numpy as np

from railsim.compiled import allocating
from railsim.track.kernel import LEFT_LATERAL, RIGHT_LATERAL, TrackTables, locate, second, slope, value
from railsim.wheelset.contact import ANGLE, RADIUS, RollingTable
from railsim.wheelset.parameters import Coefficients

Y, Y_RATE, YAW, YAW_RATE, MASS_Y, MASS_Y_RATE = range(6)
STATES = 6
LEFT, RIGHT, LEFT_RATE, RIGHT_RATE, LEFT_SECOND, RIGHT_SECOND = range(6)


@allocating
def rails_at(track: TrackTables, distance: float, speed: float, rails: np.ndarray) -> None:
    """Lateral displacement of both rails (m) and its first two derivatives by time (m/s, m/s2) into `rails` (6,)."""
    cell, x = locate(track.s0, track.ds, track.count, distance)
    for side, channel in ((LEFT, LEFT_LATERAL), (RIGHT, RIGHT_LATERAL)):
        rails[side] = value(track.coefficients, cell, channel, x)
        rails[side + LEFT_RATE] = speed * slope(track.coefficients, cell, channel, x)
        rails[side + LEFT_SECOND] = speed * speed * second(track.coefficients, cell, channel, x)


@allocating
def wheel_at(table: RollingTable, side: int, shift: float) -> tuple[float, float, float, float]:
    """Radius (m), its first (-) and second (1/m) derivative by the shift towards the flange, contact angle (rad)."""
    coefficients = table.coefficients[side]
    cell, x = locate(table.start, table.spacing, table.cells, shift)
    radius = value(coefficients, cell, RADIUS, x)
    angle = value(coefficients, cell, ANGLE, x)
    return radius, slope(coefficients, cell, RADIUS, x), second(coefficients, cell, RADIUS, x), angle


@allocating
def state_rates(
    state: np.ndarray, rails: np.ndarray, c: Coefficients, table: RollingTable, speed: float, out: np.ndarray
) -> None:
    """Time derivative of the state into `out` (6,)."""
    y, y_rate, yaw, yaw_rate, mass_y, mass_y_rate = state
    r_L, slope_L, _, delta_L = wheel_at(table, LEFT, y - rails[LEFT])
    r_R, slope_R, _, delta_R = wheel_at(table, RIGHT, rails[RIGHT] - y)
    half_sum = (r_L + r_R) / 2.0
    phi = (r_L - r_R) / (2.0 * c.l)
    phi_rate = (slope_L * (y_rate - rails[LEFT_RATE]) + slope_R * (y_rate - rails[RIGHT_RATE])) / (2.0 * c.l)
    F_s = c.k_y * (mass_y - y) + c.f_y * (mass_y_rate - y_rate)
    M_s = -c.k_psi * yaw - c.f_psi * yaw_rate
    slip = y_rate + half_sum * phi_rate - speed * yaw
    lateral = (
        F_s
        - 2.0 * c.f22 / speed * slip
        - 2.0 * c.f11 * (1.0 - half_sum / c.r0) * yaw
        - 2.0 * c.f23 * (yaw_rate / speed - (delta_L - delta_R) / (2.0 * c.r0))
        - c.W * ((delta_L - delta_R) / 2.0 + phi)
    )
    turning = (
        M_s
        - c.I_wy * speed / c.r0 * phi_rate
        - 2.0 * c.l * c.l * c.f11 / c.r0 * phi
        + 2.0 * c.f23 / speed * slip
        - 2.0 * c.l * c.l * c.f11 / speed * yaw_rate
        + c.f33 * (delta_L - delta_R) / c.r0
        + c.l * c.W * (delta_L + delta_R) / 2.0 * yaw
        - 2.0 * c.f33 / speed * yaw_rate
    )
    out[Y], out[YAW], out[MASS_Y] = y_rate, yaw_rate, mass_y_rate
    out[Y_RATE], out[YAW_RATE], out[MASS_Y_RATE] = lateral / c.m, turning / c.I, -F_s / c.m_m


@allocating
def roll_angle(
    state: np.ndarray, acceleration: float, rails: np.ndarray, half_width: float, table: RollingTable
) -> tuple[float, float]:
    """Roll angle (rad) and its second derivative (rad/s2) for the lateral acceleration (m/s2) of the wheelset."""
    left_rate, right_rate = state[Y_RATE] - rails[LEFT_RATE], state[Y_RATE] - rails[RIGHT_RATE]
    r_L, slope_L, curvature_L, _ = wheel_at(table, LEFT, state[Y] - rails[LEFT])
    r_R, slope_R, curvature_R, _ = wheel_at(table, RIGHT, rails[RIGHT] - state[Y])
    growth_L = slope_L * (acceleration - rails[LEFT_SECOND]) + curvature_L * left_rate * left_rate
    growth_R = slope_R * (acceleration - rails[RIGHT_SECOND]) - curvature_R * right_rate * right_rate
    return (r_L - r_R) / (2.0 * half_width), (growth_L + growth_R) / (2.0 * half_width)
