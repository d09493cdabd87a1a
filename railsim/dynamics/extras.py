"""What a run has only where an effect gives it: loads, wheels that are not round, unbalance, rails that give way
(compiled).
"""

import math

from railsim.compiled import inlined, kernel
from railsim.contact.elementary import cube_root
from railsim.contact.wheel import DAMPING, WheelOnRail, WheelState, approach, nearest, raised
from railsim.track.kernel import COMPLIANCE, locate, value

TURN = 2.0 * math.pi
TRACK_LOSS = 2e-3  # s; damping over stiffness of the track (illustrative: 100 kN s/m on 50 MN/m)
SETTLED = 1e-9  # m; last step of the search for the rail's deflection with the contact at its place
SAME_PLACE = 2e-7  # m; so much deeper or less deep, wheel and rail are nearest at the same place
SETTLING_STEPS = 20  # of Newton's method at most; two or three do
OVER_TIME, OVER_DISTANCE = 0, 1


@kernel
def load_value(plant, k, t, s):
    """Load k [N, N m] at time t or where its body is at distance s."""
    count = plant.core.load_count[k]
    over = s if plant.core.load_over[k] == OVER_DISTANCE else t
    step = min(max((over - plant.core.load_start[k]) / plant.core.load_step[k], 0.0), count - 1.0)
    i = min(int(step), count - 2)
    at = plant.core.load_offset[k] + i
    return plant.tables[at] + (step - i) * (plant.tables[at + 1] - plant.tables[at])


@inlined
def _radii(plant, i, side, angle):
    """Where the spin angle stands between two points of a wheel: fraction, width of the cell [rad], deviations of the
    radius and their slopes times the width at its ends [m].
    """
    points = plant.core.round_points
    position = angle / TURN
    position = (position - math.floor(position)) * points
    k = int(position)
    x = position - k
    k = k % points
    after = (k + 1) % points
    offset = plant.core.round_offset[i, side]
    width = TURN / points
    a, b = plant.tables[offset + 2 * k], plant.tables[offset + 2 * after]
    a_1, b_1 = plant.tables[offset + 2 * k + 1] * width, plant.tables[offset + 2 * after + 1] * width
    return x, width, a, b, a_1, b_1


@kernel
def roundness(plant, i, side, angle):
    """Deviation of the wheel's radius where it touches at spin angle `angle`, and its slope [m, m/rad]: cubic Hermite
    between the points.
    """
    x, width, a, b, a_1, b_1 = _radii(plant, i, side, angle)
    c_2, c_3 = 3.0 * (b - a) - 2.0 * a_1 - b_1, 2.0 * (a - b) + a_1 + b_1
    return a + x * (a_1 + x * (c_2 + x * c_3)), (a_1 + x * (2.0 * c_2 + 3.0 * x * c_3)) / width


@kernel
def roundness_second(plant, i, side, angle):
    """Second derivative of `roundness` by the angle [m/rad2]."""
    x, width, a, b, a_1, b_1 = _radii(plant, i, side, angle)
    rise = b - a
    return (6.0 * rise - 4.0 * a_1 - 2.0 * b_1 + 6.0 * x * (a_1 + b_1 - 2.0 * rise)) / (width * width)


@kernel
def unbalance_force(plant, i, side, angle, spin):
    """Centrifugal force of a wheel's unbalance in the track frame: forward and upward [N]."""
    size = plant.core.unbalance[i, side, 0] * spin * spin
    turned = angle - plant.core.unbalance[i, side, 1]
    return -size * math.sin(turned), -size * math.cos(turned)


@inlined
def wheel_on_rail(plant, i, side):
    """Constants of the wheel on one side (0 left, 1 right) of wheelset i."""
    return WheelOnRail(
        plant.core.contact_start, plant.core.contact_spacing, plant.contact[side], plant.core.contact_stiffness[side],
        1.0 - 2.0 * side, plant.core.radius[i], plant.core.middle_radius[side], plant.core.steeper[i],
    )  # fmt: skip


@inlined
def doubled(plant):
    """Whether a wheel may touch its rail in two places at once; a constant of the compiled kernel."""
    return plant.core.contact_stiffness.shape[0] > 2


@inlined
def second_on_rail(plant, i, side):
    """Constants of the second contact of the wheel on one side (0 left, 1 right) of wheelset i, where there is one."""
    return WheelOnRail(
        plant.core.contact_start, plant.core.contact_spacing, plant.contact[side + 2],
        plant.core.contact_stiffness[side + 2], 1.0 - 2.0 * side, plant.core.radius[i],
        plant.core.middle_radius[side], plant.core.steeper[i],
    )  # fmt: skip


@inlined
def _pressed(wheel: WheelOnRail, damping, state: WheelState, rail_z):
    """Vertical part of a contact's normal force on a rail at height `rail_z`, and what it grows by with it [N, N/m]."""
    point = nearest(wheel, state, rail_z)
    normal, cosine, _, _ = approach(point, wheel.stiffness, damping, wheel.radius, state)
    depth = math.sqrt(point.depth * point.depth + point.aside * point.aside)
    return normal * cosine, 1.5 * normal * cosine * cosine / depth if normal > 0.0 else 0.0


@kernel
def rail_deflection_of_two(plant, i, side, s, state: WheelState):
    """`rail_deflection` under a wheel that may touch in two places: Newton's method on the sum of both forces."""
    c = plant.track
    cell, x = locate(plant.core.s0, plant.core.ds, plant.core.cells, s)
    support = 1.0 / value(c, cell, COMPLIANCE, x)
    first, second, damping = wheel_on_rail(plant, i, side), second_on_rail(plant, i, side), plant.core.law[DAMPING]
    closing = state.rail_z_rate - state.z_rate - plant.core.unbalance[i, side, 2] * state.roll_rate
    d = 0.0
    for _ in range(2 * SETTLING_STEPS):
        rail_z = state.rail_z - d + plant.core.static_deflection
        force, slope = _pressed(first, damping, state, rail_z)
        force_2, slope_2 = _pressed(second, damping, state, rail_z)
        softness = 1.0 / (slope + slope_2 + support)
        lost = TRACK_LOSS * support * closing * (slope + slope_2) * softness
        step = (force + force_2 - support * d - lost) * softness
        d += step
        if abs(step) < SETTLED:
            break
    return d - plant.core.static_deflection


@kernel
def rail_deflection(plant, i, side, s, state: WheelState):
    """How far the rail under a wheel is pressed down below its place under the static load [m].

    A massless rail on the track's stiffness k and damping c = `TRACK_LOSS` k: k d + c d' = N_z(d), without creep.
    Of the speed v at which wheel and ground approach each other the rail takes d' = v k_H / (k_H + k), with k_H the
    contact's own stiffness: true where the contact follows at once. Newton's method with the contact at its place,
    which is then looked for anew; N_z falls with d and is convex.
    """
    c = plant.track
    cell, x = locate(plant.core.s0, plant.core.ds, plant.core.cells, s)
    support = 1.0 / value(c, cell, COMPLIANCE, x)
    wheel = wheel_on_rail(plant, i, side)
    hertz = wheel.stiffness
    closing = state.rail_z_rate - state.z_rate - plant.core.unbalance[i, side, 2] * state.roll_rate
    usual = cube_root(support * plant.core.static_deflection / hertz)
    usual *= usual
    d = 0.0
    for n in range(SETTLING_STEPS):
        point = nearest(wheel, state, state.rail_z - d + plant.core.static_deflection)
        normal, cosine, _, _ = approach(point, hertz, plant.core.law[DAMPING], wheel.radius, state)
        depth = math.sqrt(point.depth * point.depth + point.aside * point.aside)
        stiffness = normal / (depth * math.sqrt(depth)) if normal > 0.0 else 0.0
        slope = 1.5 * cosine * cosine * cube_root(stiffness * hertz * hertz)
        here = d
        if n == 0 and depth > usual:
            d, depth = (depth - usual) / cosine, usual
        for _ in range(SETTLING_STEPS):
            root = math.sqrt(max(depth, 0.0))
            softness = 1.0 / (slope * root + support)
            damping = TRACK_LOSS * support * closing * slope * root * softness
            step = (stiffness * depth * root * cosine - support * d - damping) * softness
            d += step
            depth -= cosine * step
            if abs(step) < SETTLED:
                break
        if abs(d - here) < SAME_PLACE:
            break
    return d - plant.core.static_deflection


@kernel
def uneven(plant, i, side, s, angle, state: WheelState):
    """Height [m] and its rate [m/s] of the rail under a wheel, with what its own radius and the rail's giving way
    add.
    """
    height, rate = state.rail_z, state.rail_z_rate
    if plant.core.round_points > 0:
        bump, rise = roundness(plant, i, side, angle)
        height, rate = height + bump, rate + rise * state.spin
    if plant.core.compliant:
        if doubled(plant):
            height -= rail_deflection_of_two(plant, i, side, s, raised(state, height, rate))
        else:
            height -= rail_deflection(plant, i, side, s, raised(state, height, rate))
    return height, rate


@kernel
def wheel_extras(plant, i, angle, spin, press_left, press_right, extra):
    """Fill extra (5,): forces forward and up, moments about x and z of a wheelset's unbalance; torque on the wheelset
    of the vertical contact forces `press` [N] on wheels whose radius changes along the tread, which keeps energy.
    """
    extra[:] = 0.0
    for side in range(2):
        arm = plant.core.unbalance[i, side, 2]
        push, lift = unbalance_force(plant, i, side, angle, spin)
        extra[0] += push
        extra[1] += lift
        extra[2] += arm * lift
        extra[3] -= arm * push
    if plant.core.round_points > 0:
        extra[4] -= press_left * roundness(plant, i, 0, angle)[1] + press_right * roundness(plant, i, 1, angle)[1]
