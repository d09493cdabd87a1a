"""Forces of one wheel on its rail: penetration with a potential, creepages, creep law. Compiled; everything in the
local track frame.

The vertical penetration of wheel and rail is a function of the wheelset's coordinates relative to the track,

    p = H(u) + w - z - phi * arm + psi^2 / 2 * (r0 H'^2 - side H' b),   u = y + r0 phi - d,   arm = side b(u) + d - y,

with H the lift and b the half distance of the contact functions, d and w the rail's lateral and vertical deviation,
side = +1 left and -1 right. It is exact to first order in the roll angle (its derivative by phi is the contact's
lateral place) and second order in yaw, so that a cone gives the gravitational stiffnesses W lambda / l and -l W
lambda of Ward et al. (2011), eqs. (16) and (17). The normal penetration is p_n = p cos(delta), N = C p_n^1.5, and
the generalised forces are -N dp_n/dq: the contact conserves energy as long as damping and creep are off. Where the
angle changes within the depth (flange root), their resultant is smaller than N and less steep than H' at u: it acts
where wheel and rail are nearest along the normal. Creepages and creep law are evaluated there and with that resultant,
which is also the normal force that is returned (with creep off: N itself).
"""

import math
from typing import NamedTuple

import numpy as np

from railsim.compiled import inlined, kernel
from railsim.contact.fastsim import fastsim_force
from railsim.contact.linear import linear_force
from railsim.contact.polach import friction_coefficient, polach_force

SPEED_FLOOR = 0.1  # m/s; creepage = slip velocity / sqrt(V^2 + SPEED_FLOOR^2), finite at standstill


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
    place = (shift - start) / spacing
    cell = min(max(int(place), 0), cells.shape[0] - 1)
    x = place - cell
    lift_row, half_row = cells[cell, 0], cells[cell, 2]
    if x < 0.0 or x > 1.0:  # beyond the table: straight on
        edge = 0.0 if x < 0.0 else 1.0
        lift_1 = (lift_row[1] + edge * (2.0 * lift_row[2] + 3.0 * edge * lift_row[3])) / spacing
        lift_2 = 0.0
        lift = _cubic(lift_row, edge) + lift_1 * (x - edge) * spacing
        half = _cubic(half_row, edge)
        half_1 = 0.0
        x = edge
    else:
        lift = _cubic(lift_row, x)
        lift_1 = (lift_row[1] + x * (2.0 * lift_row[2] + 3.0 * x * lift_row[3])) / spacing
        lift_2 = (2.0 * lift_row[2] + 6.0 * x * lift_row[3]) / (spacing * spacing)
        half = _cubic(half_row, x)
        half_1 = (half_row[1] + x * (2.0 * half_row[2] + 3.0 * x * half_row[3])) / spacing
    arm = side * half + rail_y - y
    yaw_square = 0.5 * yaw * yaw
    yaw_factor = lift_1 * (r0 * lift_1 - side * half)
    p = lift + rail_z - z - roll * arm + yaw_square * yaw_factor
    if p <= 0.0:
        return WheelForces(
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, math.atan(lift_1 + roll),
            _cubic(cells[cell, 1], x), shift, friction,
        )  # fmt: skip
    p_u = (
        lift_1
        - side * half_1 * roll
        + yaw_square * (lift_2 * (2.0 * r0 * lift_1 - side * half) - side * lift_1 * half_1)
    )
    p_y = p_u + roll
    p_roll = r0 * p_u - arm
    p_yaw = yaw * yaw_factor
    cosine = 1.0 / math.sqrt(1.0 + lift_1 * lift_1)
    cosine_u = -lift_1 * lift_2 * cosine * cosine * cosine
    p_normal = p * cosine
    rate = cosine * (p_y * (y_rate - rail_y_rate) - z_rate + p_roll * roll_rate + p_yaw * yaw_rate + rail_z_rate)
    normal = max(stiffness * p_normal * math.sqrt(p_normal) * (1.0 + law[DAMPING] * rate), 0.0)
    elastic_y = -normal * (cosine * p_y + p * cosine_u)
    elastic_roll = -normal * (cosine * p_roll + p * cosine_u * r0)
    elastic_z = normal * cosine
    elastic_yaw = -normal * cosine * p_yaw

    # creepages and creep law see the pressure's own direction and size, at the place where wheel and rail are nearest
    # along it: short of u, where the lift is read, by the depth's lateral part
    p_y += p * cosine_u / cosine
    angle = math.atan(p_y)
    cos_angle = 1.0 / math.sqrt(1.0 + p_y * p_y)
    sin_angle = p_y * cos_angle
    pressure = elastic_z / cos_angle
    shift -= p * lift_1 * cosine * cosine
    place = (shift - start) / spacing
    cell = min(max(int(place), 0), cells.shape[0] - 1)
    x = min(max(place - cell, 0.0), 1.0)
    arm = side * _cubic(cells[cell, 2], x) + rail_y - y
    radius = _cubic(cells[cell, 1], x)
    reference = 1.0 / math.sqrt(speed * speed + SPEED_FLOOR * SPEED_FLOOR)
    along = speed * (1.0 - curvature * (y + arm)) - arm * yaw_rate
    across = y_rate + radius * roll_rate
    slip_x = along * (1.0 - yaw_square) + across * yaw - radius * spin
    slip_y = (across * (1.0 - yaw_square) - along * yaw) / cos_angle
    turning = (speed * curvature + yaw_rate) * cos_angle - spin * (sin_angle - roll * cos_angle)
    creep_x, creep_y, spin_creep = slip_x * reference, slip_y * reference, turning * reference
    if law[CREEP] == 0.0:
        return WheelForces(
            0.0, elastic_y, elastic_z, elastic_roll, 0.0, elastic_yaw, normal, 0.0, 0.0, creep_x, creep_y, spin_creep,
            angle, radius, shift, friction,
        )  # fmt: skip
    scale = np.cbrt(pressure)
    slip_speed = math.sqrt(slip_x * slip_x + slip_y * slip_y)
    mu = friction_coefficient(friction, law[RATIO], law[DECAY], slip_speed)
    a, b = _cubic(cells[cell, 3], x) * scale, _cubic(cells[cell, 4], x) * scale
    c11, c22, c23 = _cubic(cells[cell, 5], x), _cubic(cells[cell, 6], x), _cubic(cells[cell, 7], x)
    creep_force_x, creep_force_y = creep_force(
        law[LAW], creep_x, creep_y, spin_creep, a, b, c11, c22, c23, pressure, mu, law[K_ADHESION], law[K_SLIP]
    )
    level = creep_force_y * cos_angle
    lever_x = radius * p_y * yaw
    force_y = creep_force_x * yaw + level * (1.0 - yaw_square)
    force_z = creep_force_y * sin_angle
    return WheelForces(
        creep_force_x * (1.0 - yaw_square) - level * yaw,
        elastic_y + force_y,
        elastic_z + force_z,
        elastic_roll + arm * force_z + radius * force_y,
        -radius * creep_force_x,
        elastic_yaw + lever_x * level - arm * creep_force_x,
        pressure, creep_force_x, creep_force_y, creep_x, creep_y, spin_creep, angle, radius, shift, mu,
    )  # fmt: skip
