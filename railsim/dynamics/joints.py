"""Elements between bodies whose coordinates refer to different track frames (compiled).

A joint is a pair of such bodies. A place of the upper one, near the elements that join them, is carried into the lower
one's frame, all elements of the pair are evaluated there, and their sum is carried back: once a pair, however many
elements it has. The frame of the upper body stands in that of the lower one at P(s), turned by the rotation vector
theta(s); a point r of the upper frame is at P + r + a theta x r + b theta x (theta x r) with a = sin(theta) / theta and
b = (1 - cos(theta)) / theta^2 (Rodrigues), here to fifth order. Rotations follow one another as
theta + phi + 1/2 theta x phi + 1/12 theta x (theta x phi) (Baker, Campbell and Hausdorff), to first order in phi.
Forces go back by the transposed of these maps, so that they do the same work in both frames.

The place is near the elements because these may be far from the centre of gravity: over that distance only the frame's
rotation may be large, and that is exact.
"""

from railsim.branches import vanishes
from railsim.compiled import inlined
from railsim.dynamics.elements import (
    APPLIED,
    SPEED,
    STRETCH,
    body_coordinates,
    cross,
    lever_moment,
    linear_force,
    moments_of,
    stretch_of,
    turned_arm,
)
from railsim.dynamics.laws import element_force
from railsim.dynamics.moving_frame import pose
from railsim.dynamics.workspace import JOINT

# of a joint: coordinates of the upper body's place in the lower one's frame, their rates, sum of force and moment on
# it, and the pose of the upper body's frame
POSITION, RATE, WRENCH, HERE = 0, 6, 12, 18


@inlined
def open_joints(plant, s, velocity, q, rate, joints, work):
    """Carry the upper bodies' places of all joints into the frames of the lower ones."""
    for j in range(plant.core.joints):
        own = joints[JOINT * j : JOINT * (j + 1)]
        position, speed = own[POSITION:RATE], own[RATE:WRENCH]
        own[WRENCH:HERE] = 0.0
        upper, lower, arm = plant.core.joint_bodies[j, 0], plant.core.joint_bodies[j, 1], plant.core.joint_arm[j]
        body_coordinates(plant, upper, s, velocity, q, rate, work[60:72], position, speed)
        first, second, third = work[9:12], work[12:15], work[15:18]
        turned_arm(position[3:6], arm, first, second)
        cross(speed[3:6], arm, third)
        for k in range(3):
            position[k] += second[k]
            speed[k] += third[k]
        if plant.core.curved:
            _carry(plant, j, upper, lower, s, velocity, own, work)


@inlined
def _carry(plant, j, upper, lower, s, velocity, own, work):
    position, speed, here = own[POSITION:RATE], own[RATE:WRENCH], own[HERE:JOINT]
    at, turn, turning, first, second, third = work[0:3], work[3:6], work[6:9], work[9:12], work[12:15], work[15:18]
    pose(plant, plant.core.joint_pose[j], s + plant.core.frame_offset[plant.core.body_frame[lower]], here)
    for k in range(3):
        at[k] = plant.core.local[upper, k] + plant.core.joint_arm[j, k] + position[k]
        turn[k], turning[k] = here[3 + k], velocity * here[9 + k]
    a, b = _rodrigues(turn)
    change = turn[0] * turning[0] + turn[1] * turning[1] + turn[2] * turning[2]
    cross(turn, at, first)
    cross(turn, first, second)
    for k in range(3):
        position[k] += here[k] + a * first[k] + b * second[k]
    cross(turning, first, third)
    for k in range(3):  # the moving frame's part of the velocity, and what its angle does to a and b
        third[k] = velocity * here[6 + k] + b * third[k] - change * (first[k] / 3.0 + second[k] / 12.0)
    cross(turning, at, first)
    for k in range(3):
        third[k] += a * first[k]
        first[k] = b * first[k] + a * speed[k]  # under one more turn
    cross(turn, first, second)
    for k in range(3):
        third[k] += second[k]
    cross(turn, speed[0:3], first)
    cross(turn, first, second)
    for k in range(3):
        speed[k] += third[k] + b * second[k]
    cross(turn, position[3:6], first)
    cross(turn, first, second)
    cross(turning, position[3:6], third)
    for k in range(3):
        position[3 + k] += turn[k] + 0.5 * first[k] + second[k] / 12.0
        at[k] = 0.5 * third[k]
    cross(turn, speed[3:6], first)
    cross(turn, first, second)
    for k in range(3):
        speed[3 + k] += turning[k] + at[k] + 0.5 * first[k] + second[k] / 12.0


@inlined
def _rodrigues(turn):
    """sin(theta) / theta and (1 - cos(theta)) / theta^2 of a rotation vector, to fifth order."""
    square = turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]
    return 1.0 - square / 6.0 * (1.0 - square / 20.0), 0.5 - square / 24.0 * (1.0 - square / 30.0)


@inlined
def close_joints(plant, q, force, joints, work):
    """Carry the forces on the upper bodies back into their own frames; return the sum along the track on those that
    are held there [N].
    """
    held = 0.0
    first, second, rotation, moment = work[0:3], work[3:6], work[12:15], work[15:18]
    for j in range(plant.core.joints):
        own = joints[JOINT * j : JOINT * (j + 1)]
        wrench, turn = own[WRENCH:HERE], own[HERE + 3 : HERE + 6]
        if plant.core.curved:
            a, b = _rodrigues(turn)
            cross(turn, wrench[0:3], first)
            cross(turn, first, second)
            for k in range(3):
                wrench[k] += b * second[k] - a * first[k]
            cross(turn, wrench[3:6], first)
            cross(turn, first, second)
            for k in range(3):
                wrench[3 + k] += second[k] / 12.0 - 0.5 * first[k]
        index = plant.core.coordinate[plant.core.joint_bodies[j, 0]]
        for k in range(3):
            rotation[k] = q[index[3 + k]] if index[3 + k] >= 0 else 0.0
        lever_moment(rotation, plant.core.joint_arm[j], wrench[0:3], work[18:30], moment)
        for k in range(3):
            wrench[3 + k] += moment[k]
        for k in range(6):
            if index[k] >= 0:
                force[index[k]] += wrench[k]
        if index[0] < 0:
            held += wrench[0]
    return held


@inlined
def _upper_arm(plant, j, arm, work):
    """From the joint's place to an element [m], work[54:57]."""
    for k in range(3):
        work[54 + k] = arm[k] - plant.core.joint_arm[j, k]


@inlined
def _lower(plant, lower, q, rate, work):
    """Coordinates and rates of the lower body, work[12:24]."""
    for k in range(6):
        j = plant.core.coordinate[lower, k]
        work[12 + k] = q[j] if j >= 0 else 0.0
        work[18 + k] = rate[j] if j >= 0 else 0.0


@inlined
def _relative_rotation(own, work):
    """Turn the differences of both bodies' rotation vectors into the vector of the rotation between them, to second
    order: in a curve the upper one's holds the turn of the track between both frames, which is not small.
    """
    turned_u, turned_l, spare = own[POSITION + 3 : RATE], work[15:18], work[6:9]
    cross(turned_u, turned_l, spare)
    for k in range(3):
        work[STRETCH + 3 + k] += 0.5 * spare[k]
    cross(own[RATE + 3 : WRENCH], turned_l, spare)
    for k in range(3):
        work[SPEED + 3 + k] += 0.5 * spare[k]
    cross(turned_u, work[21:24], spare)
    for k in range(3):
        work[SPEED + 3 + k] += 0.5 * spare[k]


@inlined
def _apply(plant, lower, own, force, work):
    """Add what `moments_of` gave to the joint's sum, and to the forces on the lower body; moments by the gradient of
    the elongations of `_relative_rotation`.
    """
    moment_u, moment_l, turned, joint_force = work[24:27], work[27:30], work[48:51], work[51:54]
    couple, by_lower, by_upper = work[APPLIED + 3 : APPLIED + 6], work[0:3], work[3:6]
    by_lower[:] = 0.0
    by_upper[:] = 0.0
    if plant.core.curved:
        cross(work[15:18], couple, by_lower)
        cross(own[POSITION + 3 : RATE], couple, by_upper)
    for k in range(3):
        own[WRENCH + k] += joint_force[k]
        own[WRENCH + 3 + k] += moment_u[k] - 0.5 * turned[k] + couple[k] + 0.5 * by_lower[k]
        j = plant.core.coordinate[lower, k]
        if j >= 0:
            force[j] -= joint_force[k]
        j = plant.core.coordinate[lower, 3 + k]
        if j >= 0:
            force[j] -= moment_l[k] + 0.5 * turned[k] + couple[k] + 0.5 * by_upper[k]


@inlined
def element_of_joint(plant, e, q, rate, force, joints, work):
    """Linear element e of a joint, as `finite_element`."""
    j, lower, arms = plant.core.finite_joint[e], plant.core.finite_bodies[e, 1], plant.core.finite_arms[e]
    own = joints[JOINT * j : JOINT * (j + 1)]
    _lower(plant, lower, q, rate, work)
    _upper_arm(plant, j, arms[0], work)
    stretch_of(own[POSITION:RATE], own[RATE:WRENCH], work[12:18], work[18:24], work[54:57], arms[1], work)
    if plant.core.curved:
        _relative_rotation(own, work)
    linear_force(plant, e, work)
    moments_of(own[POSITION:RATE], work[12:18], work[54:57], arms[1], work)
    _apply(plant, lower, own, force, work)


@inlined
def law_of_joint(plant, e, t, q, rate, x, force, out, joints, work):
    """Nonlinear element e of a joint: its law along one axis midway between both bodies' orientations."""
    j, arms, axis = plant.core.element_joint[e], plant.core.element_arms[e], plant.core.element_axis[e]
    lower = plant.core.joint_bodies[j, 1]
    own = joints[JOINT * j : JOINT * (j + 1)]
    _lower(plant, lower, q, rate, work)
    _upper_arm(plant, j, arms[0], work)
    stretch_of(own[POSITION:RATE], own[RATE:WRENCH], work[12:18], work[18:24], work[54:57], arms[1], work)
    if plant.core.curved:
        _relative_rotation(own, work)
    resisting = element_force(plant, e, t, work[STRETCH + axis], work[SPEED + axis], x, out)
    if vanishes(resisting):
        return
    work[APPLIED : APPLIED + 6] = 0.0
    work[APPLIED + axis] = -resisting
    moments_of(own[POSITION:RATE], work[12:18], work[54:57], arms[1], work)
    _apply(plant, lower, own, force, work)
