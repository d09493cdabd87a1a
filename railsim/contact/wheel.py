"""Forces of one wheel on its rail: penetration with a potential, creepages, creep law. Compiled; everything in the
local track frame.

The vertical penetration of wheel and rail is a function of the wheelset's coordinates relative to the track,

    p = H(u) + w - z - phi * arm + psi^2 / 2 * (r0 H'^2 - side H' b),   u = y + r0 phi - d,   arm = side b(u) + d - y,

with H the lift and b the half distance of the contact functions, d and w the rail's lateral and vertical deviation,
side = +1 left and -1 right. It is exact to first order in the roll angle (its derivative by phi is the contact's
lateral place) and second order in yaw, so that a cone gives the gravitational stiffnesses W lambda / l and -l W
lambda of Ward et al. (2011), eqs. (16) and (17). The depth p_n is the distance to the place where wheel and rail are
nearest: the wheelset moved by -sigma across the track would just touch there if it were lifted by p(sigma), so that

    p_n^2 = sigma^2 + p(sigma)^2   with   sigma = p(sigma) p_y(sigma),

which is p cos(delta) where the contact angle does not change within the depth. N = C p_n^1.5, and the generalised
forces are -N dp_n/dq: the contact conserves energy as long as damping and creep are off, and its force is normal to
the profiles where they are nearest. Creepages and creep law are evaluated there.
"""

import math
from typing import NamedTuple

import numpy as np

from railsim.compiled import inlined, kernel
from railsim.contact.fastsim import fastsim_force
from railsim.contact.linear import linear_force
from railsim.contact.polach import friction_coefficient, polach_force

NEAREST = 1e-8  # m; last step of the search for the place where wheel and rail are nearest; its square is the error
NEAREST_STEPS = 8  # of Newton's method at most; one or two do on the tread
SLOWEST = 0.5  # m/s; creepage = slip velocity / (V^4 + SLOWEST^4)^(1/4), finite at standstill


class ContactLaw(NamedTuple):
    """Parameters of the creep law and of the contact's damping: plain floats for the kernels."""

    friction: float  # mu0 [-], where the track states none
    friction_ratio: float  # A of Polach 2005 [-]
    friction_decay: float  # B of Polach 2005 [s/m]
    k_adhesion: float  # kA [-]
    k_slip: float  # kS [-]
    damping: float  # D in N = C p^1.5 (1 + D dp/dt) [s/m]
    creep: float  # 1 = creep forces on, 0 = off
    law: float = 0.0  # which creep law: place in `CREEP_LAWS`


CREEP_LAWS = ("polach", "fastsim", "linear")
"""Names of the creep laws, in the order of their codes in `ContactLaw.law`."""

POLACH, FASTSIM, LINEAR = range(len(CREEP_LAWS))
FRICTION, RATIO, DECAY, K_ADHESION, K_SLIP, DAMPING, CREEP, LAW = range(len(ContactLaw._fields))  # as kernels index it


class WheelForces(NamedTuple):
    """Resultant on the wheelset at its centre [N, N m] in the local track frame, and what happens in the contact."""

    force_x: float
    force_y: float
    force_z: float
    moment_x: float
    moment_spin: float
    moment_z: float
    normal: float
    creep_force_x: float
    creep_force_y: float
    creepage_x: float
    creepage_y: float
    spin_creepage: float
    angle: float
    radius: float
    shift: float
    friction: float


@inlined
def _cubic(row, x):
    return row[0] + x * (row[1] + x * (row[2] + x * row[3]))


@inlined
def _profile(start, spacing, cells, u):
    """Lift, its first and second derivative; half distance and its derivative; cell and fraction. Straight beyond the
    table.
    """
    place = (u - start) / spacing
    cell = min(max(int(place), 0), cells.shape[0] - 1)
    x = place - cell
    edge = min(max(x, 0.0), 1.0)
    lift_row, half_row = cells[cell, 0], cells[cell, 2]
    lift_1 = (lift_row[1] + edge * (2.0 * lift_row[2] + 3.0 * edge * lift_row[3])) / spacing
    lift = _cubic(lift_row, edge) + lift_1 * (x - edge) * spacing
    half = _cubic(half_row, edge)
    if x != edge:
        return lift, lift_1, 0.0, half, 0.0, cell, edge
    lift_2 = (2.0 * lift_row[2] + 6.0 * x * lift_row[3]) / (spacing * spacing)
    half_1 = (half_row[1] + x * (2.0 * half_row[2] + 3.0 * x * half_row[3])) / spacing
    return lift, lift_1, lift_2, half, half_1, cell, x


@inlined
def _slope(side, r0, roll, yaw_square, lift_1, lift_2, half, half_1):
    """dp/du."""
    turned = lift_2 * (2.0 * r0 * lift_1 - side * half) - side * lift_1 * half_1
    return lift_1 - side * half_1 * roll + yaw_square * turned


@kernel
def creep_force(law, creep_x, creep_y, spin, a, b, c11, c22, c23, normal, friction, k_adhesion, k_slip):
    """Creep force by the law of that code [N]: arguments and signs of `polach_force`.

    The linear law has no limit: its force may exceed mu N, and friction plays no part in it. kA and kS lower its slope
    to (kA + kS) / 2 of Kalker's, the slope at vanishing creepage that the other two laws have for the same kA and kS.
    """
    if law == POLACH:
        return polach_force(creep_x, creep_y, spin, a, b, c11, c22, c23, normal, friction, k_adhesion, k_slip)
    if law == FASTSIM:
        return fastsim_force(creep_x, creep_y, spin, a, b, c11, c22, c23, normal, friction, k_adhesion, k_slip)
    share = 0.5 * (k_adhesion + k_slip)
    force_x, force_y = linear_force(creep_x, creep_y, spin, a, b, c11, c22, c23)
    return share * force_x, share * force_y


@inlined
def wheel_forces(
    start, spacing, cells, stiffness, side, r0, law, friction,
    y, z, roll, yaw, y_rate, z_rate, roll_rate, yaw_rate,
    speed, curvature, spin, rail_y, rail_y_rate, rail_z, rail_z_rate,
):  # fmt: skip
    """Forces of one wheel; lengths m, angles rad, rates per second; `cells` (cells, channels, 4) of `ContactTable`;
    `law` as an array.

    `friction` is mu0 at this place. All coordinates are relative to the track frame at the wheelset; `curvature` is
    the track's.
    """
    shift = y + r0 * roll - rail_y
    yaw_square = 0.5 * yaw * yaw
    lift, lift_1, lift_2, half, half_1, cell, x = _profile(start, spacing, cells, shift)
    arm = side * half + rail_y - y
    yaw_factor = lift_1 * (r0 * lift_1 - side * half)
    p = lift + rail_z - z - roll * arm + yaw_square * yaw_factor
    if p <= 0.0:
        return WheelForces(
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, math.atan(lift_1 + roll),
            _cubic(cells[cell, 1], x), shift, friction,
        )  # fmt: skip
    p_u = _slope(side, r0, roll, yaw_square, lift_1, lift_2, half, half_1)
    p_y = p_u + roll
    sigma = p * p_y / (1.0 + p_y * p_y + max(p * lift_2, -0.5))
    for _ in range(NEAREST_STEPS):
        lift, lift_1, lift_2, half, half_1, cell, x = _profile(start, spacing, cells, shift - sigma)
        arm = side * half + rail_y - y
        yaw_factor = lift_1 * (r0 * lift_1 - side * half)
        p = lift + rail_z - z - roll * (arm + sigma) + yaw_square * yaw_factor
        p_u = _slope(side, r0, roll, yaw_square, lift_1, lift_2, half, half_1)
        p_y = p_u + roll
        step = (p * p_y - sigma) / (1.0 + p_y * p_y + max(p * lift_2, -0.5))
        sigma += step
        if abs(step) < NEAREST:  # the rest of the way along the tangent
            p -= p_y * step
            p_u -= lift_2 * step
            p_y -= lift_2 * step
            break
    cosine = 1.0 / math.sqrt(1.0 + p_y * p_y)
    sine = p_y * cosine
    p_normal = math.sqrt(p * p + sigma * sigma)
    p_roll = cosine * (r0 * p_u - arm - sigma)
    p_yaw = cosine * yaw * yaw_factor
    rate = sine * (y_rate - rail_y_rate) + cosine * (rail_z_rate - z_rate) + p_roll * roll_rate + p_yaw * yaw_rate
    normal = max(stiffness * p_normal * math.sqrt(p_normal) * (1.0 + law[DAMPING] * rate), 0.0)
    elastic_y, elastic_z = -normal * sine, normal * cosine
    elastic_roll, elastic_yaw = -normal * p_roll, -normal * p_yaw

    shift -= sigma
    angle = math.atan(p_y)
    radius = _cubic(cells[cell, 1], x)
    reference = 1.0 / math.sqrt(math.sqrt(speed**4 + SLOWEST**4))
    along = speed * (1.0 - curvature * (y + arm)) - arm * yaw_rate
    across = y_rate + radius * roll_rate
    slip_x = along * (1.0 - yaw_square) + across * yaw - radius * spin
    slip_y = (across * (1.0 - yaw_square) - along * yaw) / cosine
    turning = (speed * curvature + yaw_rate) * cosine - spin * (sine - roll * cosine)
    creep_x, creep_y, spin_creep = slip_x * reference, slip_y * reference, turning * reference
    if law[CREEP] == 0.0:
        return WheelForces(
            0.0, elastic_y, elastic_z, elastic_roll, 0.0, elastic_yaw, normal, 0.0, 0.0, creep_x, creep_y, spin_creep,
            angle, radius, shift, friction,
        )  # fmt: skip
    scale = np.cbrt(normal)
    slip_speed = math.sqrt(slip_x * slip_x + slip_y * slip_y)
    mu = friction_coefficient(friction, law[RATIO], law[DECAY], slip_speed)
    a, b = _cubic(cells[cell, 3], x) * scale, _cubic(cells[cell, 4], x) * scale
    c11, c22, c23 = _cubic(cells[cell, 5], x), _cubic(cells[cell, 6], x), _cubic(cells[cell, 7], x)
    creep_force_x, creep_force_y = creep_force(
        law[LAW], creep_x, creep_y, spin_creep, a, b, c11, c22, c23, normal, mu, law[K_ADHESION], law[K_SLIP]
    )
    level = creep_force_y * cosine
    lever_x = radius * p_y * yaw
    force_y = creep_force_x * yaw + level * (1.0 - yaw_square)
    force_z = creep_force_y * sine
    return WheelForces(
        creep_force_x * (1.0 - yaw_square) - level * yaw,
        elastic_y + force_y,
        elastic_z + force_z,
        elastic_roll + arm * force_z + radius * force_y,
        -radius * creep_force_x,
        elastic_yaw + lever_x * level - arm * creep_force_x,
        normal, creep_force_x, creep_force_y, creep_x, creep_y, spin_creep, angle, radius, shift, mu,
    )  # fmt: skip
