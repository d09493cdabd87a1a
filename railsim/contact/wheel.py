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
from typing import Any, NamedTuple

from railsim.branches import where
from railsim.compiled import inlined, kernel
from railsim.contact.elementary import cube_root, cubic
from railsim.contact.fastsim import fastsim_force
from railsim.contact.functions import AXIS_A, AXIS_B, BY_TURN, C11, C22, C23, HALF_DISTANCE, LIFT, RADIUS
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


class WheelState(NamedTuple):
    """A wheel and the rail under it, relative to the track frame at the wheelset's own place [m, rad, 1/s]."""

    y: float  # of the wheelset
    z: float
    roll: float
    yaw: float
    y_rate: float
    z_rate: float
    roll_rate: float
    yaw_rate: float
    speed: float  # along the track [m/s]
    spin: float
    friction: float  # mu0 of the rail here [-]
    rail_y: float
    rail_y_rate: float
    rail_z: float
    rail_z_rate: float
    curvature: float  # of the track [1/m]


@inlined
def raised(state: WheelState, rail_z, rail_z_rate):
    """The state with the rail at another height [m] and rate [m/s]."""
    return WheelState(
        state.y, state.z, state.roll, state.yaw, state.y_rate, state.z_rate, state.roll_rate, state.yaw_rate,
        state.speed, state.spin, state.friction, state.rail_y, state.rail_y_rate, rail_z, rail_z_rate, state.curvature,
    )  # fmt: skip


class WheelOnRail(NamedTuple):
    """Constants of one wheel and its rail."""

    start: float  # first lateral shift of the contact functions [m]
    spacing: float  # of the contact functions [m]
    cells: Any  # (cells, channels, 4) of `ContactTable`
    stiffness: float  # Hertz stiffness [N/m^1.5]
    side: float  # +1 left, -1 right
    radius: float  # nominal [m]
    middle: float = 0.0  # rolling radius in the middle of the tread [m]
    steeper: float = 0.0  # radii differ from `middle` by 1 + this times what the table says [-]


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
    tangent: float  # of the contact angle
    radius: float
    shift: float
    friction: float
    beside: float  # vertical part of a second contact's normal force, of which the resultant is the sum [N]


@inlined
def cell_of(start, per_metre, last, u):
    """Cell of the contact functions at shift u [m], of which `last` is the last one, and the place in it: below 0 or
    above 1 beyond the table.
    """
    place = (u - start) * per_metre
    cell = min(max(math.floor(place), 0.0), last)
    return cell, place - cell


class Gap(NamedTuple):
    """How far wheel and rail reach into each other at one place, and how that changes."""

    depth: float  # p [m]
    across: float  # dp/dy [-]
    along: float  # dp/du [-]
    slope: float  # dH/du [-]
    bend: float  # d2H/du2 [1/m]
    arm: float  # lateral lever about the wheelset's centre, before sigma [m]
    yaw_factor: float  # second derivative of p by the yaw angle [m]
    x: float  # fraction of the cell


@inlined
def gap(lift_row, half_row, x, per_metre, side, r0, y, z, roll, yaw, rail_y, rail_z, sigma):
    """`Gap` of a wheel moved across by -sigma [m], with the coefficients of lift and half distance in its cell and the
    place x in that; beyond the table the profile goes on straight.
    """
    edge = min(max(x, 0.0), 1.0)
    inside, yaw_square = x == edge, 0.5 * yaw * yaw
    rise = lift_row[1] + edge * (2.0 * lift_row[2] + 3.0 * edge * lift_row[3])
    lift = cubic(lift_row, edge) + rise * (x - edge)
    lift_1 = rise * per_metre
    half = cubic(half_row, edge)
    lift_2 = where(inside, (2.0 * lift_row[2] + 6.0 * x * lift_row[3]) * per_metre * per_metre, 0.0)
    half_1 = where(inside, (half_row[1] + x * (2.0 * half_row[2] + 3.0 * x * half_row[3])) * per_metre, 0.0)
    arm = side * half + rail_y - y
    yaw_factor = lift_1 * (r0 * lift_1 - side * half)
    p = lift + rail_z - z - roll * (arm + sigma) + yaw_square * yaw_factor
    turned = lift_2 * (2.0 * r0 * lift_1 - side * half) - side * lift_1 * half_1
    p_u = lift_1 - side * half_1 * roll + yaw_square * turned
    return Gap(p, p_u + roll, p_u, lift_1, lift_2, arm, yaw_factor, edge)


@inlined
def nearer(there: Gap, sigma):
    """Step of Newton's method from sigma towards the place where wheel and rail are nearest [m]."""
    p, p_y = there.depth, there.across
    return (p * p_y - sigma) / (1.0 + p_y * p_y + max(p * there.bend, -0.5))


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


class ContactPoint(NamedTuple):
    """Where wheel and rail are nearest."""

    depth: float  # p there [m]; 0 = they do not touch
    across: float  # dp/dy there: tangent of the contact angle against the horizontal [-]
    along: float  # dp/du there [-]
    aside: float  # sigma [m]
    arm: float  # lateral lever of the contact about the wheelset's centre, before sigma [m]
    yaw_factor: float  # second derivative of p by the yaw angle [m]
    shift: float  # u there [m]
    cell: int  # of the contact functions
    x: float  # fraction of the cell


@inlined
def _gap_at(wheel: WheelOnRail, state: WheelState, rail_z, shift, sigma):
    """`Gap` of a wheel at `shift` [m] moved across by -sigma [m], and its cell."""
    place, x = cell_of(wheel.start, 1.0 / wheel.spacing, wheel.cells.shape[0] - 1.0, shift - sigma)
    cell = int(place) if place == place else 0
    row = wheel.cells[cell]
    return gap(
        row[LIFT], row[HALF_DISTANCE], x, 1.0 / wheel.spacing, wheel.side, wheel.radius,
        state.y, state.z, state.roll, state.yaw, state.rail_y, rail_z, sigma,
    ), cell  # fmt: skip


@inlined
def nearest(wheel: WheelOnRail, state: WheelState, rail_z):
    """`ContactPoint` of one wheel on a rail at height `rail_z` [m], which need not be the state's."""
    shift = state.y + wheel.radius * state.roll - state.rail_y
    here, cell = _gap_at(wheel, state, rail_z, shift, 0.0)
    p, p_y, p_u = here.depth, here.across, here.along
    if p <= 0.0:
        return ContactPoint(
            0.0, here.slope + state.roll, here.slope, 0.0, here.arm, here.yaw_factor, shift, cell, here.x
        )
    sigma = nearer(here, 0.0)
    for _ in range(NEAREST_STEPS):
        here, cell = _gap_at(wheel, state, rail_z, shift, sigma)
        p, p_y, p_u = here.depth, here.across, here.along
        step = nearer(here, sigma)
        sigma += step
        if abs(step) < NEAREST:  # the rest of the way along the tangent
            p -= p_y * step
            p_u -= here.bend * step
            p_y -= here.bend * step
            break
    return ContactPoint(p, p_y, p_u, sigma, here.arm, here.yaw_factor, shift - sigma, cell, here.x)


@inlined
def rolling_radius(wheel: WheelOnRail, point: ContactPoint, roll):
    """Of the wheel where it touches [m], with the wheelset's roll [rad]."""
    row = wheel.cells[point.cell]
    radius = cubic(row[RADIUS], point.x) + wheel.side * roll * cubic(row[BY_TURN], point.x)
    return radius + wheel.steeper * (radius - wheel.middle)


@inlined
def unit_patch(cells, point: ContactPoint):
    """Semi-axes under 1 N [m/N^(1/3)] and Kalker's coefficients C11, C22, C23 where the wheel touches."""
    row, x = cells[point.cell], point.x
    return cubic(row[AXIS_A], x), cubic(row[AXIS_B], x), cubic(row[C11], x), cubic(row[C22], x), cubic(row[C23], x)


class Approach(NamedTuple):
    """Normal force in a contact, and how its depth follows the wheelset's coordinates."""

    normal: float  # [N]
    cosine: float  # of the contact angle against the horizontal
    by_roll: float  # d(p_n)/d(roll) [m]
    by_yaw: float


@inlined
def approach(point: ContactPoint, stiffness, damping, r0, state: WheelState):
    """`Approach` of one wheel; no calls, no branches."""
    p, p_y = point.depth, point.across
    cosine = 1.0 / math.sqrt(1.0 + p_y * p_y)
    p_normal = math.sqrt(p * p + point.aside * point.aside)
    p_roll = cosine * (r0 * point.along - point.arm - point.aside)
    p_yaw = cosine * state.yaw * point.yaw_factor
    across, upward = p_y * cosine * (state.y_rate - state.rail_y_rate), cosine * (state.rail_z_rate - state.z_rate)
    rate = across + upward + p_roll * state.roll_rate + p_yaw * state.yaw_rate
    normal = max(stiffness * p_normal * math.sqrt(p_normal) * (1.0 + damping * rate), 0.0)
    return Approach(normal if p > 0.0 else 0.0, cosine, p_roll, p_yaw)


class NormalContact(NamedTuple):
    """Normal force and slip in a contact, and what of the wheelset's coordinates both depend on."""

    normal: float
    cosine: float  # of the contact angle against the horizontal
    by_roll: float  # d(p_n)/d(roll) [m]
    by_yaw: float
    slip_x: float  # [m/s]
    slip_y: float
    slip_spin: float  # [rad/s]
    reference: float  # 1 / speed of the creepages [s/m]; 0 without contact
    scale: float  # semi-axes to those under 1 N


@inlined
def normal_contact(point: ContactPoint, radius, stiffness, damping, r0, state: WheelState):
    """`NormalContact` of one wheel with rolling radius `radius` [m]; no calls, no branches."""
    normal, cosine, p_roll, p_yaw = approach(point, stiffness, damping, r0, state)
    roll, yaw, yaw_rate, speed, spin = state.roll, state.yaw, state.yaw_rate, state.speed, state.spin
    yaw_square = 0.5 * yaw * yaw
    sine = point.across * cosine
    square = speed * speed
    reference = 1.0 / math.sqrt(math.sqrt(square * square + SLOWEST**4))
    along = speed * (1.0 - state.curvature * (state.y + point.arm)) - point.arm * yaw_rate
    across = state.y_rate + radius * state.roll_rate
    slip_x = along * (1.0 - yaw_square) + across * yaw - radius * spin
    slip_y = (across * (1.0 - yaw_square) - along * yaw) / cosine
    slip_spin = (speed * state.curvature + yaw_rate) * cosine - spin * (sine - roll * cosine)
    reference = reference if point.depth > 0.0 else 0.0
    return NormalContact(normal, cosine, p_roll, p_yaw, slip_x, slip_y, slip_spin, reference, cube_root(normal))


@inlined
def creepages(contact: NormalContact):
    """Longitudinal and lateral creepage [-], spin creepage [1/m]."""
    return contact.slip_x * contact.reference, contact.slip_y * contact.reference, contact.slip_spin * contact.reference


@inlined
def resultant(point: ContactPoint, contact: NormalContact, radius, yaw, force_x, force_y):
    """(6,) forces and moments of one wheel on the wheelset, of which force_x and force_y are the creep force in the
    contact plane [N]: x, y, z, moments about x, of the spin, about z.
    """
    yaw_square = 0.5 * yaw * yaw
    normal, cosine = contact.normal, contact.cosine
    sine = point.across * cosine
    level = force_y * cosine
    side_force = force_x * yaw + level * (1.0 - yaw_square)
    lift = force_y * sine
    return (
        force_x * (1.0 - yaw_square) - level * yaw,
        side_force - normal * sine,
        lift + normal * cosine,
        point.arm * lift + radius * side_force - normal * contact.by_roll,
        -radius * force_x,
        radius * point.across * yaw * level - point.arm * force_x - normal * contact.by_yaw,
    )


@inlined
def wheel_forces(wheel: WheelOnRail, law, state: WheelState):
    """Forces of one wheel; `law` is `ContactLaw` as an array, of which the rail's own friction replaces mu0."""
    return forces_at(wheel, law, state, nearest(wheel, state, state.rail_z))


@inlined
def forces_at(wheel: WheelOnRail, law, state: WheelState, point: ContactPoint):
    """Forces of one wheel with its contact at `point`."""
    radius = rolling_radius(wheel, point, state.roll)
    contact = normal_contact(point, radius, wheel.stiffness, law[DAMPING], wheel.radius, state)
    creep_x, creep_y, creep_spin = creepages(contact)
    friction, force_x, force_y = state.friction, 0.0, 0.0
    if law[CREEP] != 0.0 and point.depth > 0.0:
        slip_speed = math.sqrt(contact.slip_x * contact.slip_x + contact.slip_y * contact.slip_y)
        friction = friction_coefficient(friction, law[RATIO], law[DECAY], slip_speed)
        a, b, c11, c22, c23 = unit_patch(wheel.cells, point)
        force_x, force_y = creep_force(
            law[LAW], creep_x, creep_y, creep_spin, a * contact.scale, b * contact.scale, c11, c22, c23,
            contact.normal, friction, law[K_ADHESION], law[K_SLIP],
        )  # fmt: skip
    forces = resultant(point, contact, radius, state.yaw, force_x, force_y)
    return WheelForces(
        forces[0], forces[1], forces[2], forces[3], forces[4], forces[5], contact.normal, force_x, force_y,
        creep_x, creep_y, creep_spin, point.across, radius, point.shift, friction, 0.0,
    )  # fmt: skip


@inlined
def upward(forces: WheelForces):
    """Vertical part of the normal forces [N]."""
    return forces.normal / math.sqrt(1.0 + forces.tangent * forces.tangent) + forces.beside


@inlined
def second_forces(wheel: WheelOnRail, law, state: WheelState):
    """`wheel_forces` of a second contact, which mostly is not there; `shift` is its lateral place in the track frame
    [m], and what stands `beside` is its own.
    """
    point = nearest(wheel, state, state.rail_z)
    place = state.y + point.arm + point.aside
    if point.depth <= 0.0:
        radius = rolling_radius(wheel, point, state.roll)
        return WheelForces(
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, point.across, radius, place, state.friction, 0.0
        )
    f = forces_at(wheel, law, state, point)
    return WheelForces(
        f.force_x, f.force_y, f.force_z, f.moment_x, f.moment_spin, f.moment_z, f.normal, f.creep_force_x,
        f.creep_force_y, f.creepage_x, f.creepage_y, f.spin_creepage, f.tangent, f.radius, place, f.friction, upward(f),
    )  # fmt: skip


@inlined
def both(first: WheelForces, second: WheelForces):
    """The resultant of two contacts of one wheel; all else is that of the first one."""
    return WheelForces(
        first.force_x + second.force_x, first.force_y + second.force_y, first.force_z + second.force_z,
        first.moment_x + second.moment_x, first.moment_spin + second.moment_spin, first.moment_z + second.moment_z,
        first.normal, first.creep_force_x, first.creep_force_y, first.creepage_x, first.creepage_y,
        first.spin_creepage, first.tangent, first.radius, first.shift, first.friction, second.beside,
    )  # fmt: skip
