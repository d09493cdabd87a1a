"""Wheels on their rails (compiled): coordinates of a wheelset on its own piece of track, forces of one wheel, and those
of the wheels of two wheelsets at once.

The latter take the search for the contacts wheel by wheel and all the rest in a loop over `LANES` wheels that the
compiler turns into instructions for all of them; the formulas are those of `railsim.contact.wheel`.
"""

import math

from railsim.compiled import inlined, kernel
from railsim.contact.polach import friction_coefficient, polach_force
from railsim.contact.wheel import (
    CREEP,
    DAMPING,
    DECAY,
    FRICTION,
    K_ADHESION,
    K_SLIP,
    LAW,
    POLACH,
    RATIO,
    ContactPoint,
    WheelForces,
    WheelState,
    both,
    creep_force,
    creepages,
    nearest,
    normal_contact,
    raised,
    resultant,
    rolling_radius,
    second_forces,
    unit_patch,
    wheel_forces,
)
from railsim.dynamics.extras import doubled, second_on_rail, uneven, wheel_on_rail
from railsim.dynamics.moving_frame import general, pose
from railsim.track.kernel import CURVATURE, LEFT_FRICTION, LEFT_LATERAL, LEFT_VERTICAL, locate, slope, value

RAIL_RIGHT = 1  # offset of the right rail's channels from the left one's
LANES = 4  # wheels: so many numbers an instruction takes
(
    Y, ROLL, YAW, Y_RATE, Z_RATE, ROLL_RATE, YAW_RATE, SPIN, RADIUS_0, SPEED, CURVED, RAIL_Y_RATE, RAIL_Z_RATE,
    STIFFNESS, MU, DEPTH, ACROSS, ALONG, ASIDE, ARM, YAW_FACTOR, SHIFT, RADIUS, AXIS_A, AXIS_B, C11, C22, C23,
    NORMAL, CREEPAGE_X, CREEPAGE_Y, SPIN_CREEPAGE, CREEP_X, CREEP_Y,
    FORCE_X, FORCE_Y, FORCE_Z, MOMENT_X, MOMENT_SPIN, MOMENT_Z,
) = range(0, 40 * LANES, LANES)  # fmt: skip
SECOND, SECOND_COUNT = 40 * LANES, len(WheelForces._fields)  # `WheelForces` of each lane's second contact
WHEELS = SECOND + LANES * SECOND_COUNT
"""Numbers that the wheels need; zeros to begin with, so that lanes without a wheel hold no NaN."""


@inlined
def wheelset_local(plant, i, s, velocity, q, rate, here, local):
    """Fill local (8,): y, z, roll, yaw and rates of wheelset i in the track frame at its own distance; `here` is
    scratch (12,).
    """
    body = plant.core.wheelset_body[i]
    index = plant.core.coordinate[body]
    for k, axis in enumerate((1, 2, 3, 5)):
        j = index[axis]
        local[k] = q[j] if j >= 0 else 0.0
        local[4 + k] = rate[j] if j >= 0 else 0.0
    if not plant.core.curved:
        return
    origin = s + plant.core.frame_offset[plant.core.body_frame[body]] if general(plant) else s
    pose(plant, 1 + i, origin, here)
    height = plant.core.radius[i] + local[1]
    y, z = local[0] - here[1], height - here[2]
    y_rate, z_rate = local[4] - velocity * here[7], local[5] - velocity * here[8]
    sin_r, cos_r, turning = math.sin(here[3]), math.cos(here[3]), velocity * here[9]
    local[0] = y * cos_r + z * sin_r
    local[1] = z * cos_r - y * sin_r - plant.core.radius[i]
    local[4] = y_rate * cos_r + z_rate * sin_r + turning * (z * cos_r - y * sin_r)
    local[5] = z_rate * cos_r - y_rate * sin_r - turning * (y * cos_r + z * sin_r)
    local[2] -= here[3]
    local[3] -= here[5]
    local[6] -= velocity * here[9]
    local[7] -= velocity * here[11]


@inlined
def wheel_state(plant, i, side, s, velocity, spin, angle, local):
    """State of the wheel on one side (0 left, 1 right) of wheelset i whose distance is s, with the wheelset's local
    coordinates, spin and angle of rotation.
    """
    c = plant.track
    cell, x = locate(plant.core.s0, plant.core.ds, plant.core.cells, s)
    vertical, lateral = LEFT_VERTICAL + side * RAIL_RIGHT, LEFT_LATERAL + side * RAIL_RIGHT
    friction = plant.core.law[FRICTION]
    if plant.core.friction_given:
        friction = value(c, cell, LEFT_FRICTION + side * RAIL_RIGHT, x)
    rail_y, rail_y_rate = value(c, cell, lateral, x), velocity * slope(c, cell, lateral, x)
    height, rate = value(c, cell, vertical, x), velocity * slope(c, cell, vertical, x)
    curvature = value(c, cell, CURVATURE, x) if plant.core.curved else 0.0
    state = WheelState(
        local[0], local[1], local[2], local[3], local[4], local[5], local[6], local[7], velocity, spin,
        friction, rail_y, rail_y_rate, height, rate, curvature,
    )  # fmt: skip
    if plant.core.uneven:
        height, rate = uneven(plant, i, side, s, angle, state)
        return raised(state, height, rate)
    return state


@inlined
def forces_of_wheel(plant, i, side, s, velocity, spin, angle, local):
    """Forces of one wheel, the resultant that of all its contacts: arguments of `wheel_state`."""
    state = wheel_state(plant, i, side, s, velocity, spin, angle, local)
    first = wheel_forces(wheel_on_rail(plant, i, side), plant.core.law, state)
    if doubled(plant):
        return both(first, second_forces(second_on_rail(plant, i, side), plant.core.law, state))
    return first


@inlined
def second_of_wheel(plant, i, side, s, velocity, spin, angle, local):
    """Forces of the second contact of one wheel, where a plant has second contacts: arguments of `wheel_state`."""
    state = wheel_state(plant, i, side, s, velocity, spin, angle, local)
    return second_forces(second_on_rail(plant, i, side), plant.core.law, state)


@inlined
def wheel_row(forces: WheelForces, row):
    """What is kept of the contact of one wheel."""
    row[0], row[1], row[2] = forces.normal, forces.creep_force_x, forces.creep_force_y
    row[3], row[4], row[5] = forces.creepage_x, forces.creepage_y, forces.spin_creepage
    row[6], row[7], row[8], row[9] = math.atan(forces.tangent), forces.radius, forces.shift, forces.friction


@inlined
def put(plant, i, side, k, s, velocity, spin, angle, local, v):
    """Lane k gets the wheel on that side of wheelset i: arguments of `wheel_state`."""
    state = wheel_state(plant, i, side, s, velocity, spin, angle, local)
    wheel = wheel_on_rail(plant, i, side)
    point = nearest(wheel, state, state.rail_z)
    v[Y + k], v[ROLL + k], v[YAW + k] = state.y, state.roll, state.yaw
    v[Y_RATE + k], v[Z_RATE + k], v[ROLL_RATE + k], v[YAW_RATE + k] = (
        state.y_rate, state.z_rate, state.roll_rate, state.yaw_rate
    )  # fmt: skip
    v[SPIN + k], v[RADIUS_0 + k], v[SPEED + k], v[CURVED + k] = spin, wheel.radius, velocity, state.curvature
    v[RAIL_Y_RATE + k], v[RAIL_Z_RATE + k] = state.rail_y_rate, state.rail_z_rate
    v[STIFFNESS + k], v[MU + k] = wheel.stiffness, state.friction
    v[DEPTH + k], v[ACROSS + k], v[ALONG + k], v[ASIDE + k] = point.depth, point.across, point.along, point.aside
    v[ARM + k], v[YAW_FACTOR + k], v[SHIFT + k] = point.arm, point.yaw_factor, point.shift
    v[RADIUS + k] = rolling_radius(wheel, point, state.roll)
    v[AXIS_A + k], v[AXIS_B + k], v[C11 + k], v[C22 + k], v[C23 + k] = unit_patch(wheel.cells, point)
    if doubled(plant):
        row = v[SECOND + k * SECOND_COUNT : SECOND + (k + 1) * SECOND_COUNT]
        _store(second_forces(second_on_rail(plant, i, side), plant.core.law, state), row)


@inlined
def _store(forces: WheelForces, row):
    (
        row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8],
        row[9], row[10], row[11], row[12], row[13], row[14], row[15], row[16],
    ) = forces  # fmt: skip


@inlined
def second_in_lane(v, k):
    """`WheelForces` of the second contact in lane k, where a plant has second contacts."""
    row = v[SECOND + k * SECOND_COUNT : SECOND + (k + 1) * SECOND_COUNT]
    return WheelForces(
        row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8],
        row[9], row[10], row[11], row[12], row[13], row[14], row[15], row[16],
    )  # fmt: skip


@inlined
def resultant_in_lane(plant, v, k):
    """`WheelForces` in lane k with the resultant of all contacts."""
    if doubled(plant):
        return both(forces_in_lane(v, k), second_in_lane(v, k))
    return forces_in_lane(v, k)


@inlined
def _contact(v, k, damping):
    """Point and normal contact of the wheel in lane k."""
    point = ContactPoint(
        v[DEPTH + k], v[ACROSS + k], v[ALONG + k], v[ASIDE + k], v[ARM + k], v[YAW_FACTOR + k], v[SHIFT + k], 0, 0.0
    )
    radius, stiffness, r0 = v[RADIUS + k], v[STIFFNESS + k], v[RADIUS_0 + k]
    roll, yaw, y = v[ROLL + k], v[YAW + k], v[Y + k]
    y_rate, z_rate, roll_rate, yaw_rate = v[Y_RATE + k], v[Z_RATE + k], v[ROLL_RATE + k], v[YAW_RATE + k]
    speed, curvature, spin = v[SPEED + k], v[CURVED + k], v[SPIN + k]
    rail_y_rate, rail_z_rate = v[RAIL_Y_RATE + k], v[RAIL_Z_RATE + k]
    state = WheelState(  # heights and the rail's lateral place served to find the point
        y, 0.0, roll, yaw, y_rate, z_rate, roll_rate, yaw_rate,
        speed, spin, 0.0, 0.0, rail_y_rate, 0.0, rail_z_rate, curvature,
    )  # fmt: skip
    return point, normal_contact(point, radius, stiffness, damping, r0, state)


@inlined
def _sliding(v, k, point, contact, ratio, decay):
    """Friction at the slip in lane k, that of the place where the wheel does not touch."""
    slip = math.sqrt(contact.slip_x * contact.slip_x + contact.slip_y * contact.slip_y)
    friction = friction_coefficient(v[MU + k], ratio, decay, slip)
    return friction if point.depth > 0.0 else v[MU + k]


@inlined
def _keep(v, k, point, contact, friction, force_x, force_y):
    """Fill what comes out in lane k."""
    v[NORMAL + k], v[MU + k] = contact.normal, friction
    v[CREEPAGE_X + k], v[CREEPAGE_Y + k], v[SPIN_CREEPAGE + k] = creepages(contact)
    v[CREEP_X + k], v[CREEP_Y + k] = force_x, force_y
    (
        v[FORCE_X + k], v[FORCE_Y + k], v[FORCE_Z + k], v[MOMENT_X + k], v[MOMENT_SPIN + k], v[MOMENT_Z + k]
    ) = resultant(point, contact, v[RADIUS + k], v[YAW + k], force_x, force_y)  # fmt: skip


@inlined
def evaluate(law, v):
    """Fill the forces and what leads to them, of all wheels that were put."""
    if law[CREEP] == 0.0 or law[LAW] != POLACH:
        _one_by_one(law, v)
        return
    damping, ratio, decay, k_adhesion, k_slip = law[DAMPING], law[RATIO], law[DECAY], law[K_ADHESION], law[K_SLIP]
    for k in range(LANES):
        point, contact = _contact(v, k, damping)
        x, y, spin = creepages(contact)
        friction = _sliding(v, k, point, contact, ratio, decay)
        force_x, force_y = polach_force(
            x, y, spin, v[AXIS_A + k] * contact.scale, v[AXIS_B + k] * contact.scale,
            v[C11 + k], v[C22 + k], v[C23 + k], contact.normal, friction, k_adhesion, k_slip,
        )  # fmt: skip
        _keep(v, k, point, contact, friction, force_x, force_y)


@kernel
def _one_by_one(law, v):
    """The same for any creep law, or none."""
    for k in range(LANES):
        point, contact = _contact(v, k, law[DAMPING])
        friction, force_x, force_y = v[MU + k], 0.0, 0.0
        if law[CREEP] != 0.0 and point.depth > 0.0:
            x, y, spin = creepages(contact)
            friction = _sliding(v, k, point, contact, law[RATIO], law[DECAY])
            force_x, force_y = creep_force(
                law[LAW], x, y, spin, v[AXIS_A + k] * contact.scale, v[AXIS_B + k] * contact.scale,
                v[C11 + k], v[C22 + k], v[C23 + k], contact.normal, friction, law[K_ADHESION], law[K_SLIP],
            )  # fmt: skip
        _keep(v, k, point, contact, friction, force_x, force_y)


@inlined
def forces_in_lane(v, k):
    """`WheelForces` in lane k, of its first contact."""
    return WheelForces(
        v[FORCE_X + k], v[FORCE_Y + k], v[FORCE_Z + k], v[MOMENT_X + k], v[MOMENT_SPIN + k], v[MOMENT_Z + k],
        v[NORMAL + k], v[CREEP_X + k], v[CREEP_Y + k], v[CREEPAGE_X + k], v[CREEPAGE_Y + k], v[SPIN_CREEPAGE + k],
        v[ACROSS + k], v[RADIUS + k], v[SHIFT + k], v[MU + k], 0.0,
    )  # fmt: skip
