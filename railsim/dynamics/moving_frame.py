"""The moving track frame (compiled): how it moves, how the track lies elsewhere in it, and its inertial forces."""

import math

from railsim.compiled import inlined
from railsim.constants import GRAVITY
from railsim.contact.elementary import cubic
from railsim.track.kernel import CURVATURE, GRADIENT, ROLL, locate, second, slope, value


@inlined
def frame_motion(plant, s, velocity, acceleration, frame):
    """Fill frame (9,): Omega [rad/s], its derivative [rad/s2], upward unit vector, in the track frame at s."""
    frame[:] = 0.0
    frame[8] = 1.0
    if not plant.core.curved:
        return
    c = plant.track
    cell, x = locate(plant.core.s0, plant.core.ds, plant.core.cells, s)
    kappa, kappa_1 = value(c, cell, CURVATURE, x), slope(c, cell, CURVATURE, x)
    roll, roll_1, roll_2 = value(c, cell, ROLL, x), slope(c, cell, ROLL, x), second(c, cell, ROLL, x)
    climb, climb_1, climb_2 = value(c, cell, GRADIENT, x), slope(c, cell, GRADIENT, x), second(c, cell, GRADIENT, x)
    sin_r, cos_r, sin_g, cos_g = math.sin(roll), math.cos(roll), math.sin(climb), math.cos(climb)
    k_x = roll_1 + kappa * sin_g
    k_y = -climb_1 * cos_r + kappa * sin_r * cos_g
    k_z = climb_1 * sin_r + kappa * cos_r * cos_g
    level_1 = kappa_1 * cos_g - kappa * sin_g * climb_1
    k_x1 = roll_2 + kappa_1 * sin_g + kappa * cos_g * climb_1
    k_y1 = -climb_2 * cos_r + level_1 * sin_r + roll_1 * k_z
    k_z1 = climb_2 * sin_r + level_1 * cos_r - roll_1 * k_y
    frame[0], frame[1], frame[2] = velocity * k_x, velocity * k_y, velocity * k_z
    square = velocity * velocity
    frame[3] = square * k_x1 + acceleration * k_x
    frame[4] = square * k_y1 + acceleration * k_y
    frame[5] = square * k_z1 + acceleration * k_z
    frame[6], frame[7], frame[8] = sin_g, cos_g * sin_r, cos_g * cos_r


@inlined
def pose(plant, row, s, out):
    """Fill out (12,): x, y, z, roll, pitch, yaw of pose table `row` at s, then their derivatives by s."""
    if not plant.core.curved:
        out[:] = 0.0
        return
    cell, x = locate(plant.core.s0, plant.core.ds, plant.core.cells, s)
    for channel in range(6):
        c = plant.pose[row, cell, channel]
        out[channel] = cubic(c, x)
        out[6 + channel] = c[1] + x * (2.0 * c[2] + 3.0 * x * c[3])


@inlined
def general(plant):
    """Whether bodies refer to several track frames or move along the track; a constant of the compiled kernel."""
    return plant.core.frame_offset.shape[0] > 1


@inlined
def _inertial(plant, b, local_x, x_rate, velocity, q, rate, force, frame):
    """Gravity and inertial forces of a moving frame on a body so far ahead of its origin; return those along x on a
    unit mass [m/s2] but for the frame's own acceleration.
    """
    index = plant.core.coordinate[b]
    mass = plant.core.body_mass[b]
    o_x, o_y, o_z, a_x, a_y, a_z = frame[0], frame[1], frame[2], frame[3], frame[4], frame[5]
    y = q[index[1]] if index[1] >= 0 else 0.0
    z = q[index[2]] if index[2] >= 0 else 0.0
    y_rate = rate[index[1]] if index[1] >= 0 else 0.0
    z_rate = rate[index[2]] if index[2] >= 0 else 0.0
    p_x, p_y, p_z = local_x, plant.core.position[b, 1] + y, plant.core.position[b, 2] + z
    # v = Omega x r; centripetal = Omega x (v + V e_x + 2 r')
    c_x = o_y * p_z - o_z * p_y + velocity + 2.0 * x_rate
    c_y = o_z * p_x - o_x * p_z + 2.0 * y_rate
    c_z = o_x * p_y - o_y * p_x + 2.0 * z_rate
    inertial_y = a_z * p_x - a_x * p_z + o_z * c_x - o_x * c_z
    inertial_z = a_x * p_y - a_y * p_x + o_x * c_y - o_y * c_x
    if index[1] >= 0:
        force[index[1]] -= mass * (inertial_y + GRAVITY * frame[7])
    if index[2] >= 0:
        force[index[2]] -= mass * (inertial_z + GRAVITY * frame[8])
    inertia = plant.core.inertia[b]
    w_x = o_x + (rate[index[3]] if index[3] >= 0 else 0.0)
    w_y = o_y + (rate[index[4]] if index[4] >= 0 else 0.0)
    w_z = o_z + (rate[index[5]] if index[5] >= 0 else 0.0)
    if index[3] >= 0:
        force[index[3]] -= inertia[0] * a_x + (inertia[2] - inertia[1]) * w_y * w_z
    if index[4] >= 0:
        force[index[4]] -= inertia[1] * a_y + (inertia[0] - inertia[2]) * w_x * w_z
    if index[5] >= 0:
        force[index[5]] -= inertia[2] * a_z + (inertia[1] - inertia[0]) * w_x * w_y
    return a_y * p_z - a_z * p_y + o_y * c_z - o_z * c_y + GRAVITY * frame[6]


@inlined
def _gyroscopic(plant, i, x, force, frame):
    """Moments of a spinning wheelset whose frame turns."""
    n, w = plant.core.mass.shape[0], plant.core.radius.shape[0]
    index = plant.core.coordinate[plant.core.wheelset_body[i]]
    momentum = plant.core.spin_inertia[i] * x[2 * n + w + i]
    if index[3] >= 0 and index[5] >= 0:
        force[index[3]] += momentum * frame[2]
        force[index[5]] -= momentum * frame[0]


@inlined
def frame_forces(plant, velocity, x, q, rate, force, frame):
    """Gravity and the moving frame's inertial forces, of a model that knows one frame."""
    for b in range(plant.core.body_mass.shape[0]):
        if plant.core.curved:
            _inertial(plant, b, plant.core.position[b, 0], 0.0, velocity, q, rate, force, frame)
        elif plant.core.coordinate[b, 2] >= 0:
            force[plant.core.coordinate[b, 2]] -= plant.core.body_mass[b] * GRAVITY
    if plant.core.curved:
        for i in range(plant.core.radius.shape[0]):
            _gyroscopic(plant, i, x, force, frame)


@inlined
def frames_forces(plant, s, velocity, acceleration, x, q, rate, force, frame):
    """The same of a `general` model: each body in its own track frame, and along the track."""
    for f in range(plant.core.frames if plant.core.curved else 1):
        if plant.core.curved:
            frame_motion(plant, s + plant.core.frame_offset[f], velocity, acceleration, frame)
        for b in range(plant.core.body_mass.shape[0]):
            index = plant.core.coordinate[b]
            along = acceleration
            if plant.core.curved:
                if plant.core.body_frame[b] != f:
                    continue
                x_rate = rate[index[0]] if index[0] >= 0 else 0.0
                ahead = plant.core.local[b, 0] + (q[index[0]] if index[0] >= 0 else 0.0)
                along += _inertial(plant, b, ahead, x_rate, velocity, q, rate, force, frame)
            elif index[2] >= 0:
                force[index[2]] -= plant.core.body_mass[b] * GRAVITY
            if index[0] >= 0:
                force[index[0]] -= plant.core.body_mass[b] * along
        for i in range(plant.core.radius.shape[0] if plant.core.curved else 0):
            if plant.core.body_frame[plant.core.wheelset_body[i]] == f:
                _gyroscopic(plant, i, x, force, frame)
