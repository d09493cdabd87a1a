"""Elements between bodies whose coordinates refer to different track frames (compiled).

A joint is a pair of such bodies. The upper one's coordinates are carried into the lower one's frame, all elements of
the pair are evaluated there, and their sum is carried back: once a pair, however many elements it has. The frame of
the upper body stands in that of the lower one at P(s), turned by the rotation vector theta(s); a point r of the upper
body is at P + r + theta x r + 1/2 theta x (theta x r), and rotations follow one another as a + b + 1/2 a x b (Baker,
Campbell and Hausdorff), all to second order. Forces go back by the transposed of these maps, so that they do the same
work in both frames.
"""

from railsim.compiled import inlined
from railsim.dynamics.elements import (
    APPLIED,
    SPEED,
    STRETCH,
    body_coordinates,
    cross,
    linear_force,
    moments_of,
    stretch_of,
)
from railsim.dynamics.laws import element_force
from railsim.dynamics.moving_frame import pose
from railsim.dynamics.workspace import JOINT

# of a joint: coordinates of the upper body in the lower one's frame, their rates, sum of force and moment on it, and
# the pose of its frame
POSITION, RATE, WRENCH, HERE = 0, 6, 12, 18


@inlined
def open_joints(plant, s, velocity, q, rate, joints, work):
    """Carry the coordinates of the upper bodies of all joints into the frames of the lower ones."""
    for j in range(plant.core.joints):
        own = joints[JOINT * j : JOINT * (j + 1)]
        position, speed = own[POSITION:RATE], own[RATE:WRENCH]
        own[WRENCH:HERE] = 0.0
        upper, lower = plant.core.joint_bodies[j, 0], plant.core.joint_bodies[j, 1]
        body_coordinates(plant, upper, s, velocity, q, rate, work[60:72], position, speed)
        if plant.core.curved:
            _carry(plant, j, upper, lower, s, velocity, own, work)


@inlined
def _carry(plant, j, upper, lower, s, velocity, own, work):
    position, speed, here = own[POSITION:RATE], own[RATE:WRENCH], own[HERE:JOINT]
    at, turn, turning, first, second, third = work[0:3], work[3:6], work[6:9], work[9:12], work[12:15], work[15:18]
    pose(plant, plant.core.joint_pose[j], s + plant.core.frame_offset[plant.core.body_frame[lower]], here)
    for k in range(3):
        at[k] = plant.core.local[upper, k] + position[k]
        turn[k], turning[k] = here[3 + k], velocity * here[9 + k]
    cross(turning, at, first)
    cross(turn, first, second)
    cross(turn, at, third)
    cross(turning, third, at)
    for k in range(3):
        second[k] = velocity * here[6 + k] + first[k] + 0.5 * (second[k] + at[k])
    cross(turn, third, at)
    cross(turn, speed[0:3], first)
    for k in range(3):
        position[k] += here[k] + third[k] + 0.5 * at[k]
    cross(turn, first, third)
    for k in range(3):
        speed[k] += second[k] + first[k] + 0.5 * third[k]
    cross(turn, position[3:6], first)
    cross(turning, position[3:6], second)
    cross(turn, speed[3:6], third)
    for k in range(3):
        position[3 + k] += turn[k] + 0.5 * first[k]
        speed[3 + k] += turning[k] + 0.5 * (second[k] + third[k])


@inlined
def close_joints(plant, force, joints, work):
    """Carry the forces on the upper bodies back into their own frames; return the sum along the track on those that
    are held there [N].
    """
    held = 0.0
    first, second = work[0:3], work[3:6]
    for j in range(plant.core.joints):
        own = joints[JOINT * j : JOINT * (j + 1)]
        wrench, turn = own[WRENCH:HERE], own[HERE + 3 : HERE + 6]
        if plant.core.curved:
            cross(turn, wrench[0:3], first)
            cross(turn, first, second)
            for k in range(3):
                wrench[k] += 0.5 * second[k] - first[k]
            cross(turn, wrench[3:6], first)
            for k in range(3):
                wrench[3 + k] -= 0.5 * first[k]
        index = plant.core.coordinate[plant.core.joint_bodies[j, 0]]
        for k in range(6):
            if index[k] >= 0:
                force[index[k]] += wrench[k]
        if index[0] < 0:
            held += wrench[0]
    return held


@inlined
def _lower(plant, lower, q, rate, work):
    """Coordinates and rates of the lower body, work[12:24]."""
    for k in range(6):
        j = plant.core.coordinate[lower, k]
        work[12 + k] = q[j] if j >= 0 else 0.0
        work[18 + k] = rate[j] if j >= 0 else 0.0


@inlined
def _apply(plant, lower, own, force, work):
    """Add what `moments_of` gave to the joint's sum, and to the forces on the lower body."""
    moment_u, moment_l, turned, joint_force = work[24:27], work[27:30], work[48:51], work[51:54]
    for k in range(3):
        own[WRENCH + k] += joint_force[k]
        own[WRENCH + 3 + k] += moment_u[k] - 0.5 * turned[k] + work[87 + k]
        j = plant.core.coordinate[lower, k]
        if j >= 0:
            force[j] -= joint_force[k]
        j = plant.core.coordinate[lower, 3 + k]
        if j >= 0:
            force[j] -= moment_l[k] + 0.5 * turned[k] + work[87 + k]


@inlined
def element_of_joint(plant, e, q, rate, force, joints, work):
    """Linear element e of a joint, as `finite_element`."""
    j, lower, arms = plant.core.finite_joint[e], plant.core.finite_bodies[e, 1], plant.core.finite_arms[e]
    own = joints[JOINT * j : JOINT * (j + 1)]
    _lower(plant, lower, q, rate, work)
    stretch_of(own[POSITION:RATE], own[RATE:WRENCH], work[12:18], work[18:24], arms[0], arms[1], work)
    linear_force(plant, e, work)
    moments_of(own[POSITION:RATE], work[12:18], arms[0], arms[1], work)
    _apply(plant, lower, own, force, work)


@inlined
def law_of_joint(plant, e, t, q, rate, x, force, out, joints, work):
    """Nonlinear element e of a joint: its law along one axis midway between both bodies' orientations."""
    j, arms, axis = plant.core.element_joint[e], plant.core.element_arms[e], plant.core.element_axis[e]
    lower = plant.core.joint_bodies[j, 1]
    own = joints[JOINT * j : JOINT * (j + 1)]
    _lower(plant, lower, q, rate, work)
    stretch_of(own[POSITION:RATE], own[RATE:WRENCH], work[12:18], work[18:24], arms[0], arms[1], work)
    resisting = element_force(plant, e, t, work[STRETCH + axis], work[SPEED + axis], x, out)
    if resisting != 0.0:
        work[APPLIED : APPLIED + 6] = 0.0
        work[APPLIED + axis] = -resisting
        moments_of(own[POSITION:RATE], work[12:18], arms[0], arms[1], work)
        _apply(plant, lower, own, force, work)
