"""Bodies in absolute coordinates and the track frames from which they are seen (compiled).

Bodies have six absolute coordinates each, X, Y, Z and Tait-Bryan angles a, b, c with A = Rx(a) Ry(b) Rz(c). A body's
place along the track is found by projection on the centre line; its displacements relative to the track frame there
are exact (finite rotations).
"""

import math

from railsim.compiled import kernel
from railsim.dynamics.moving_frame import general
from railsim.dynamics.workspace import (
    BODY_FRAME,
    BODY_MOTION,
    BODY_ROTATION,
    CHORD,
    DISTANCE,
    ORIGIN_FRAME,
    RELATIVE,
    SPEED,
)
from railsim.track.kernel import CURVATURE, EAST, GRADIENT, HEADING, NORTH, ROLL, UP, locate, slope, value

PROJECTIONS = 6  # Newton steps at most


@kernel
def rotation(a, b, c, out):
    """Rows of Rx(a) Ry(b) Rz(c)."""
    ca, sa, cb, sb, cc, sc = math.cos(a), math.sin(a), math.cos(b), math.sin(b), math.cos(c), math.sin(c)
    out[0], out[1], out[2] = cb * cc, -cb * sc, sb
    out[3], out[4], out[5] = ca * sc + sa * sb * cc, ca * cc - sa * sb * sc, -sa * cb
    out[6], out[7], out[8] = sa * sc - ca * sb * cc, sa * cc + ca * sb * sc, ca * cb


@kernel
def track_frame(plant, s, f):
    """Fill f with the track frame at s: rotation matrix, origin, curvature vector in the frame's axes, s."""
    f[:] = 0.0
    f[15] = s
    if not plant.core.curved:
        f[0], f[4], f[8], f[9] = 1.0, 1.0, 1.0, s - plant.core.s0
        return
    c = plant.track
    cell, x = locate(plant.core.s0, plant.core.ds, plant.core.cells, s)
    heading, climb, roll = value(c, cell, HEADING, x), value(c, cell, GRADIENT, x), value(c, cell, ROLL, x)
    kappa, climb_1, roll_1 = value(c, cell, CURVATURE, x), slope(c, cell, GRADIENT, x), slope(c, cell, ROLL, x)
    cz, sz, cg, sg, cx, sx = (
        math.cos(heading),
        math.sin(heading),
        math.cos(climb),
        math.sin(climb),
        math.cos(roll),
        math.sin(roll),
    )
    f[0], f[1], f[2] = cz * cg, -cz * sg * sx - sz * cx, -cz * sg * cx + sz * sx
    f[3], f[4], f[5] = sz * cg, -sz * sg * sx + cz * cx, -sz * sg * cx - cz * sx
    f[6], f[7], f[8] = sg, cg * sx, cg * cx
    f[9], f[10], f[11] = value(c, cell, EAST, x), value(c, cell, NORTH, x), value(c, cell, UP, x)
    f[12] = roll_1 + kappa * sg
    f[13] = -climb_1 * cx + kappa * sx * cg
    f[14] = climb_1 * sx + kappa * cx * cg


@kernel
def project(plant, guess, x, y, z, f):
    """Track frame at the distance whose cross plane holds the point, by Newton's method from `guess`."""
    if not plant.core.curved:
        track_frame(plant, x + plant.core.s0, f)
        return
    s = guess
    for _ in range(PROJECTIONS):
        track_frame(plant, s, f)
        dx, dy, dz = x - f[9], y - f[10], z - f[11]
        along = f[0] * dx + f[3] * dy + f[6] * dz
        left = f[1] * dx + f[4] * dy + f[7] * dz
        above = f[2] * dx + f[5] * dy + f[8] * dz
        step = along / (1.0 - f[14] * left + f[13] * above)
        s += step
        if abs(step) < 1e-11:
            break
    track_frame(plant, s, f)


@kernel
def seen_from(f, q, v, matrix, out):
    """Fill out[:13]: x, y, z; roll, pitch, yaw; their rates; the frame's own speed, for a body with coordinates q, v.

    `matrix` (9,) is the body's rotation matrix. The frame moves along the track so that the body stays in its cross
    plane (out[12] = ds/dt).
    """
    dx, dy, dz = q[0] - f[9], q[1] - f[10], q[2] - f[11]
    p_x = f[0] * dx + f[3] * dy + f[6] * dz
    p_y = f[1] * dx + f[4] * dy + f[7] * dz
    p_z = f[2] * dx + f[5] * dy + f[8] * dz
    v_x = f[0] * v[0] + f[3] * v[1] + f[6] * v[2]
    v_y = f[1] * v[0] + f[4] * v[1] + f[7] * v[2]
    v_z = f[2] * v[0] + f[5] * v[1] + f[8] * v[2]
    frame_speed = v_x / (1.0 + f[13] * p_z - f[14] * p_y)
    out[12] = frame_speed
    relative_motion(f, frame_speed, p_x, p_y, p_z, v_x, v_y, v_z, q, v, matrix, out)


@kernel
def relative_motion(f, frame_speed, p_x, p_y, p_z, v_x, v_y, v_z, q, v, matrix, out):
    """Positions, angles and rates relative to a frame that moves along the track with ds/dt = frame_speed."""
    o_x, o_y, o_z = frame_speed * f[12], frame_speed * f[13], frame_speed * f[14]
    out[0], out[1], out[2] = p_x, p_y, p_z
    out[6] = v_x - frame_speed - (o_y * p_z - o_z * p_y)
    out[7] = v_y - (o_z * p_x - o_x * p_z)
    out[8] = v_z - (o_x * p_y - o_y * p_x)
    # relative rotation B = T^T A, angles in the order yaw, pitch, roll
    b00 = f[0] * matrix[0] + f[3] * matrix[3] + f[6] * matrix[6]
    b10 = f[1] * matrix[0] + f[4] * matrix[3] + f[7] * matrix[6]
    b20 = f[2] * matrix[0] + f[5] * matrix[3] + f[8] * matrix[6]
    b21 = f[2] * matrix[1] + f[5] * matrix[4] + f[8] * matrix[7]
    b22 = f[2] * matrix[2] + f[5] * matrix[5] + f[8] * matrix[8]
    out[3], out[4], out[5] = math.atan2(b21, b22), -math.asin(b20), math.atan2(b10, b00)
    w_x, w_y, w_z = angular_velocity(q, v)
    # in body axes, relative to the frame
    g_x = f[0] * o_x + f[1] * o_y + f[2] * o_z
    g_y = f[3] * o_x + f[4] * o_y + f[5] * o_z
    g_z = f[6] * o_x + f[7] * o_y + f[8] * o_z
    w_x, w_y, w_z = w_x - g_x, w_y - g_y, w_z - g_z
    r_x = matrix[0] * w_x + matrix[3] * w_y + matrix[6] * w_z
    r_y = matrix[1] * w_x + matrix[4] * w_y + matrix[7] * w_z
    r_z = matrix[2] * w_x + matrix[5] * w_y + matrix[8] * w_z
    cos_b = math.sqrt(1.0 - b20 * b20)
    sin_r, cos_r = b21 / cos_b, b22 / cos_b
    turning = (sin_r * r_y + cos_r * r_z) / cos_b
    out[9] = r_x - b20 * turning
    out[10] = cos_r * r_y - sin_r * r_z
    out[11] = turning


@kernel
def angular_velocity(q, v):
    """Absolute angular velocity in global axes from the angles' rates."""
    ca, sa, cb, sb = math.cos(q[3]), math.sin(q[3]), math.cos(q[4]), math.sin(q[4])
    return v[3] + sb * v[5], ca * v[4] - sa * cb * v[5], sa * v[4] + ca * cb * v[5]


@kernel
def add_wrench(f, q, f_x, f_y, f_z, m_x, m_y, m_z, out):
    """Add a force and a moment given in frame f to the generalised forces out (6,) of a body."""
    out[0] += f[0] * f_x + f[1] * f_y + f[2] * f_z
    out[1] += f[3] * f_x + f[4] * f_y + f[5] * f_z
    out[2] += f[6] * f_x + f[7] * f_y + f[8] * f_z
    g_x = f[0] * m_x + f[1] * m_y + f[2] * m_z
    g_y = f[3] * m_x + f[4] * m_y + f[5] * m_z
    g_z = f[6] * m_x + f[7] * m_y + f[8] * m_z
    add_moment(q, g_x, g_y, g_z, out)


@kernel
def add_moment(q, g_x, g_y, g_z, out):
    """Add a moment in global axes to the generalised forces of the angles."""
    ca, sa, cb, sb = math.cos(q[3]), math.sin(q[3]), math.cos(q[4]), math.sin(q[4])
    out[3] += g_x
    out[4] += ca * g_y + sa * g_z
    out[5] += sb * g_x - sa * cb * g_y + ca * cb * g_z


@kernel
def locate_body(plant, b, q, v, memory, work):
    """Fill row b of work."""
    own, rate = q[6 * b : 6 * b + 6], v[6 * b : 6 * b + 6]
    matrix = work[b, BODY_ROTATION]
    rotation(own[3], own[4], own[5], matrix)
    project(plant, memory[b], own[0], own[1], own[2], work[b, BODY_FRAME])
    memory[b] = work[b, DISTANCE]
    seen_from(work[b, BODY_FRAME], own, rate, matrix, work[b, BODY_MOTION])


@kernel
def origin_frames(plant, work):
    """Fill the track frames to which the model's coordinates refer; return the reference's distance and speed."""
    if not general(plant):
        r = plant.core.reference_body
        here, own = work[0, ORIGIN_FRAME], work[r, BODY_FRAME]
        for k in range(own.shape[0]):
            here[k] = own[k]
        return work[r, DISTANCE], work[r, SPEED]
    d = plant.core.driver_body
    s = work[d, DISTANCE] - plant.core.position[d, 0]
    for k in range(plant.core.frames):
        track_frame(plant, s + plant.core.frame_offset[k], work[k, ORIGIN_FRAME])
    return s, work[d, SPEED]


@kernel
def vehicle_coordinates(plant, q, v, work, q_free, v_free):
    """Displacements and rates of the free coordinates, each body in the track frame to which its coordinates refer;
    yaw and yaw rate of the body that keeps the chord's direction go to `CHORD` of the last row of work.
    """
    _, speed = origin_frames(plant, work)
    out, chord = work[work.shape[0] - 1, RELATIVE], work[work.shape[0] - 1, CHORD]
    for b in range(plant.core.body_mass.shape[0]):
        f = work[plant.core.body_frame[b], ORIGIN_FRAME]
        own, rate = q[6 * b : 6 * b + 6], v[6 * b : 6 * b + 6]
        dx, dy, dz = own[0] - f[9], own[1] - f[10], own[2] - f[11]
        relative_motion(
            f, speed,
            f[0] * dx + f[3] * dy + f[6] * dz, f[1] * dx + f[4] * dy + f[7] * dz, f[2] * dx + f[5] * dy + f[8] * dz,
            f[0] * rate[0] + f[3] * rate[1] + f[6] * rate[2], f[1] * rate[0] + f[4] * rate[1] + f[7] * rate[2],
            f[2] * rate[0] + f[5] * rate[1] + f[8] * rate[2], own, rate, work[b, BODY_ROTATION], out,
        )  # fmt: skip
        for k in range(6):
            j = plant.core.coordinate[b, k]
            if j >= 0:
                q_free[j] = out[k] - (plant.core.local[b, k] if k < 3 else 0.0)
                v_free[j] = out[6 + k]
        if b == plant.core.chord_body:
            chord[0], chord[1] = out[5], out[11]
