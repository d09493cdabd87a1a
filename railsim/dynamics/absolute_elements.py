"""Nonlinear elements between bodies in absolute coordinates (compiled).

Between bodies of one track frame, elongations are those of the small displacements there. Between bodies of two track
frames they are those of the two points in space, without any small angle.
"""

import math

from railsim.compiled import inlined, kernel
from railsim.dynamics.absolute_frames import add_moment, add_wrench, angular_velocity, vehicle_coordinates
from railsim.dynamics.elements import cross
from railsim.dynamics.laws import law_force
from railsim.dynamics.moving_frame import general
from railsim.dynamics.workspace import BODY_ROTATION, CHORD, COORDINATES, ORIGIN_FRAME, POINTS, WRENCH

ROTATIONS = 3  # the first axis about which elements act


@kernel
def elements(plant, t, q, v, work, out):
    """Add the forces of all nonlinear elements."""
    n = plant.core.mass.shape[0]
    spare = work[work.shape[0] - 1]
    chord = spare[CHORD]
    q_free, v_free = spare[COORDINATES : COORDINATES + n], spare[COORDINATES + n : COORDINATES + 2 * n]
    vehicle_coordinates(plant, q, v, work, q_free, v_free)
    for e in range(plant.core.elements):
        if general(plant) and plant.core.element_joint[e] >= 0:
            _between_frames(plant, e, t, q, v, work, out)
            continue
        elongation = plant.core.chord_direction[e] * chord[0]
        stretching = plant.core.chord_direction[e] * chord[1]
        for j in range(n):
            elongation += plant.core.direction[e, j] * q_free[j]
            stretching += plant.core.direction[e, j] * v_free[j]
        resisting = _force(plant, e, t, elongation, stretching, v, out)
        if resisting != 0.0:
            _push(plant, e, resisting, q, work, out)


@kernel
def _force(plant, e, t, elongation, stretching, v, out):
    """Force of a law; the rate of its own state goes to `out`."""
    own = plant.core.element_state[e]
    at = 6 * plant.core.body_mass.shape[0] + plant.core.radius.shape[0] + own
    resisting, change = law_force(
        plant.core.law_code[e], plant.core.parameters[e], plant.tables, t, elongation, stretching,
        v[at] if own >= 0 else 0.0,
    )  # fmt: skip
    if own >= 0:
        out[at] = change
    return resisting


@kernel
def _push(plant, e, resisting, q, work, out):
    """Forces of an element on the bodies of one track frame."""
    d = work[work.shape[0] - 1, WRENCH]
    for b in range(plant.core.body_mass.shape[0]):
        for k in range(6):
            j = plant.core.coordinate[b, k]
            d[k] = -resisting * plant.core.direction[e, j] if j >= 0 else 0.0
        f = work[plant.core.body_frame[b], ORIGIN_FRAME]
        add_wrench(f, q[6 * b : 6 * b + 6], d[0], d[1], d[2], d[3], d[4], d[5], out[6 * b : 6 * b + 6])


@inlined
def _point(b, arm, q, v, work, at, speed, turning):
    """Fill arm (global axes), velocity and angular velocity of a body's point; return nothing."""
    matrix = work[b, BODY_ROTATION]
    for k in range(3):
        at[k] = matrix[3 * k] * arm[0] + matrix[3 * k + 1] * arm[1] + matrix[3 * k + 2] * arm[2]
    turning[0], turning[1], turning[2] = angular_velocity(q[6 * b : 6 * b + 6], v[6 * b : 6 * b + 6])
    cross(turning, at, speed)
    for k in range(3):
        speed[k] += v[6 * b + k]


@kernel
def _between_frames(plant, e, t, q, v, work, out):
    """An element along, or about, the mean of both bodies' axes, between two points in space; its force acts midway
    between them.
    """
    joint, axis = plant.core.element_joint[e], plant.core.element_axis[e]
    u, w = plant.core.joint_bodies[joint, 0], plant.core.joint_bodies[joint, 1]
    spare = work[work.shape[0] - 1, POINTS].reshape(9, 3)
    arm_u, speed_u, turning_u, arm_l, speed_l, turning_l = spare[0], spare[1], spare[2], spare[3], spare[4], spare[5]
    direction, apart, moment = spare[6], spare[7], spare[8]
    _point(u, plant.core.element_arms[e, 0], q, v, work, arm_u, speed_u, turning_u)
    _point(w, plant.core.element_arms[e, 1], q, v, work, arm_l, speed_l, turning_l)
    upper, lower = work[u, BODY_ROTATION], work[w, BODY_ROTATION]
    column, size = axis % ROTATIONS, 0.0
    for k in range(3):
        direction[k] = upper[3 * k + column] + lower[3 * k + column]
        size += direction[k] * direction[k]
        apart[k] = q[6 * u + k] + arm_u[k] - q[6 * w + k] - arm_l[k]
    size = math.sqrt(size)
    for k in range(3):
        direction[k] /= size
    elongation, stretching = 0.0, 0.0
    if axis < ROTATIONS:
        cross(direction, apart, moment)
        for k in range(3):
            elongation += apart[k] * direction[k]
            stretching += (speed_u[k] - speed_l[k]) * direction[k]
            stretching += 0.5 * (turning_u[k] + turning_l[k]) * moment[k]
    else:
        # relative rotation about the axis, from the two axes across it
        a, b = (column + 1) % 3, (column + 2) % 3
        sine, cosine = 0.0, 0.0
        for k in range(3):
            sine += 0.5 * (lower[3 * k + b] * upper[3 * k + a] - lower[3 * k + a] * upper[3 * k + b])
            cosine += 0.5 * (lower[3 * k + a] * upper[3 * k + a] + lower[3 * k + b] * upper[3 * k + b])
            stretching += (turning_u[k] - turning_l[k]) * direction[k]
        elongation = math.atan2(sine, cosine)
    resisting = _force(plant, e, t, elongation, stretching, v, out)
    if resisting == 0.0:
        return
    for k in range(3):
        direction[k] *= -resisting
    mine, other = out[6 * u : 6 * u + 6], out[6 * w : 6 * w + 6]
    own_u, own_l = q[6 * u : 6 * u + 6], q[6 * w : 6 * w + 6]
    if axis >= ROTATIONS:
        add_moment(own_u, direction[0], direction[1], direction[2], mine)
        add_moment(own_l, -direction[0], -direction[1], -direction[2], other)
        return
    for k in range(3):
        mine[k] += direction[k]
        other[k] -= direction[k]
        arm_u[k] -= 0.5 * apart[k]
        arm_l[k] += 0.5 * apart[k]
    cross(arm_u, direction, moment)
    add_moment(own_u, moment[0], moment[1], moment[2], mine)
    cross(arm_l, direction, moment)
    add_moment(own_l, -moment[0], -moment[1], -moment[2], other)
