"""Linear elements between two bodies, to second order in the rotations (compiled)."""

from railsim.compiled import inlined
from railsim.dynamics.moving_frame import pose

STRETCH, SPEED, APPLIED = 72, 78, 84
"""Where an element's elongations, their rates and the force on its upper body begin in its work, six numbers each, in
the axes midway between both bodies' orientations.
"""


@inlined
def body_coordinates(plant, b, s, velocity, q, rate, here, coordinates, rates):
    """Fill coordinates (6,) and rates (6,) of a body; held ones are zero but for the chord's yaw."""
    for k in range(6):
        j = plant.core.coordinate[b, k]
        coordinates[k] = q[j] if j >= 0 else 0.0
        rates[k] = rate[j] if j >= 0 else 0.0
    if plant.core.curved and b == plant.core.chord_body:
        pose(plant, 0, s, here)
        coordinates[5], rates[5] = here[5], velocity * here[11]


@inlined
def cross(a, b, out):
    """out = a x b."""
    out[0], out[1], out[2] = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def turned_arm(rotation, arm, spare, out):
    """out = rotation x arm + 1/2 rotation x (rotation x arm): how a point of a body moves by its rotation."""
    cross(rotation, arm, spare)
    cross(rotation, spare, out)
    for k in range(3):
        out[k] = spare[k] + 0.5 * out[k]


@inlined
def lever_moment(rotation, arm, applied, work, out):
    """out = generalised moment of a force at a body's point: the gradient of `turned_arm` times the force."""
    first, second, spare = work[0:3], work[3:6], work[6:9]
    cross(rotation, arm, spare)
    cross(spare, applied, first)
    cross(applied, rotation, spare)
    cross(arm, spare, second)
    cross(arm, applied, out)
    for k in range(3):
        out[k] += 0.5 * (first[k] + second[k])


@inlined
def stretch_of(position_u, rate_u, position_l, rate_l, arm_u, arm_l, work):
    """Fill the elongations and their rates of an element between points of an upper and a lower body, from both
    bodies' coordinates in one frame; work (96,).
    """
    moved_u, moved_l, stretch, speed = work[24:27], work[27:30], work[30:36], work[36:42]
    middle, spare, turned = work[42:45], work[45:48], work[48:51]
    turned_arm(position_u[3:], arm_u, spare, moved_u)
    turned_arm(position_l[3:], arm_l, spare, moved_l)
    cross(rate_u[3:], arm_u, spare)
    cross(rate_l[3:], arm_l, turned)
    for k in range(3):
        middle[k] = 0.5 * (position_u[3 + k] + position_l[3 + k])
        stretch[k] = position_u[k] + moved_u[k] - position_l[k] - moved_l[k]
        stretch[3 + k] = position_u[3 + k] - position_l[3 + k]
        speed[k] = rate_u[k] + spare[k] - rate_l[k] - turned[k]
        speed[3 + k] = rate_u[3 + k] - rate_l[3 + k]
    cross(middle, stretch, spare)
    cross(middle, speed, turned)
    for k in range(3):
        work[72 + k], work[75 + k] = stretch[k] - spare[k], stretch[3 + k]
        work[78 + k], work[81 + k] = speed[k] - turned[k], speed[3 + k]


@inlined
def linear_force(plant, e, work):
    """Fill the force of linear element e on its upper body, in its own axes."""
    for i in range(6):
        total = 0.0
        for j in range(6):
            total += (
                plant.core.finite_stiffness[e, i, j] * work[72 + j] + plant.core.finite_damping[e, i, j] * work[78 + j]
            )
        work[84 + i] = -total
    for k in range(3):
        work[84 + k] += plant.core.finite_preload[e, k]


@inlined
def moments_of(position_u, position_l, arm_u, arm_l, work):
    """Turn the force of an element into the frame of both bodies' coordinates: the force on the upper body,
    work[51:54]; the moments of its levers on the upper and the lower one, work[24:30]; and twice what the turning of
    the axes adds, work[48:51].
    """
    moved_u, moved_l, stretch = work[24:27], work[27:30], work[30:36]
    middle, spare, turned, joint_force = work[42:45], work[45:48], work[48:51], work[51:54]
    cross(middle, work[84:87], spare)
    for k in range(3):
        joint_force[k] = work[84 + k] + spare[k]
    cross(stretch, work[84:87], turned)  # the axes turn with both bodies
    lever_moment(position_u[3:], arm_u, joint_force, work[60:72], moved_u)
    lever_moment(position_l[3:], arm_l, joint_force, work[60:72], moved_l)


@inlined
def finite_element(plant, e, s, velocity, q, rate, force, work):
    """Linear element with its axes midway between both bodies' orientations, to second order in the rotations.

    Forces are the gradient of the element's energy in that stretch, so it conserves energy; work (96,).
    """
    upper, lower = plant.core.finite_bodies[e, 0], plant.core.finite_bodies[e, 1]
    arms = plant.core.finite_arms[e]
    position_u, rate_u, position_l, rate_l = work[0:6], work[6:12], work[12:18], work[18:24]
    body_coordinates(plant, upper, s, velocity, q, rate, work[60:72], position_u, rate_u)
    body_coordinates(plant, lower, s, velocity, q, rate, work[60:72], position_l, rate_l)
    stretch_of(position_u, rate_u, position_l, rate_l, arms[0], arms[1], work)
    linear_force(plant, e, work)
    moments_of(position_u, position_l, arms[0], arms[1], work)
    moment_u, moment_l, turned, joint_force = work[24:27], work[27:30], work[48:51], work[51:54]
    for k in range(3):
        i, j = plant.core.coordinate[upper, k], plant.core.coordinate[lower, k]
        if i >= 0:
            force[i] += joint_force[k]
        if j >= 0:
            force[j] -= joint_force[k]
        i, j = plant.core.coordinate[upper, 3 + k], plant.core.coordinate[lower, 3 + k]
        if i >= 0:
            force[i] += moment_u[k] - 0.5 * turned[k] + work[87 + k]
        if j >= 0:
            force[j] -= moment_l[k] + 0.5 * turned[k] + work[87 + k]
