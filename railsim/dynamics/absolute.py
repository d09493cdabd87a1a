"""Contacts, holding forces and nonlinear elements of a vehicle in absolute coordinates (compiled); the Exudyn
engine's user function.

Bodies have six absolute coordinates each, X, Y, Z and Tait-Bryan angles a, b, c with A = Rx(a) Ry(b) Rz(c); the
wheels' spins follow. A body's place along the track is found by projection on the centre line; its displacements
relative to the track frame there are exact (finite rotations). No inertial force of a moving frame appears here:
curvature, cant and gradient act through the contacts alone, which makes this an independent check of the moving
frame of `kernel`.

Longitudinal movement, and height and the rotations that a body does not list as free, are held to the track frame by
critically damped springs.
"""

import math

from railsim.compiled import kernel
from railsim.constants import GRAVITY
from railsim.dynamics.extras import load_value, wheel_extras
from railsim.dynamics.kernel import drag, path_moment, prescribed_speed, wheelset_torque
from railsim.dynamics.laws import law_force
from railsim.dynamics.moving_frame import pose
from railsim.dynamics.wheels import forces_of_wheel, upward
from railsim.dynamics.workspace import (
    BODY_FRAME,
    BODY_MOTION,
    BODY_ROTATION,
    CHORD,
    COORDINATES,
    DISTANCE,
    REFERENCE_POSE,
    RELATIVE,
    SPEED,
    WHEELSET,
    WHEELSET_EXTRA,
    WRENCH,
)
from railsim.track.kernel import CURVATURE, EAST, GRADIENT, HEADING, NORTH, ROLL, UP, locate, slope, value

HOLD = 400.0  # rad/s; natural frequency of the holding springs
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
def forces(plant, t, start, q, v, memory, work, out):
    """Fill out (6 b + w + m,) with generalised forces; the states of elements are the velocities of the last m
    coordinates, of unit mass.

    `start`: distance of the reference body at time 0. memory (b,): last distance of each body (start of the
    projection). work: of `workspace.absolute_workspace`.
    """
    bodies, w = plant.core.body_mass.shape[0], plant.core.radius.shape[0]
    reference = plant.core.reference_body
    out[:] = 0.0
    for b in range(bodies):
        locate_body(plant, b, q, v, memory, work)
    velocity, acceleration = prescribed_speed(plant.knots, t)
    target = start + travelled(plant.knots, t)
    frame = plant.core.path_frame
    if plant.core.driven:
        target, velocity = mean_motion(plant, work)
        acceleration = 0.0
        resisting = drag(plant, work[reference, SPEED])
        own, mine = q[6 * reference : 6 * reference + 6], out[6 * reference : 6 * reference + 6]
        add_wrench(work[reference, BODY_FRAME], own, -resisting, 0.0, 0.0, 0.0, 0.0, 0.0, mine)
    for b in range(bodies):
        _hold(plant, b, target, velocity, acceleration, q, work, out)
    along, torque = 0.0, 0.0
    for i in range(w):
        force, moment = _wheelset(plant, i, t, q, v, work, out)
        along += force
        torque += moment
    if frame >= 0:
        _path(plant, acceleration, along, torque, q, work, out)
    if plant.core.elements > 0:
        _elements(plant, t, q, v, work, out)
    for k in range(plant.core.loads):
        _load(plant, k, t, q, work, out)


@kernel
def _load(plant, k, t, q, work, out):
    """A load on a body, along an axis of the track frame at the body."""
    b, axis = plant.core.load_body[k], plant.core.load_axis[k]
    if plant.core.coordinate[b, axis] < 0:
        return
    d = work[work.shape[0] - 1, WRENCH]
    d[:] = 0.0
    d[axis] = load_value(plant, k, t, work[b, DISTANCE])
    mine = out[6 * b : 6 * b + 6]
    add_wrench(work[b, BODY_FRAME], q[6 * b : 6 * b + 6], d[0], d[1], d[2], d[3], d[4], d[5], mine)


@kernel
def _path(plant, acceleration, along, torque, q, work, out):
    """Pitch the bogie by what goes through it along the track: the holding forces act on centres of gravity, the
    joints that they stand for at the heights of axles and traction rod.
    """
    frame = plant.core.path_frame
    f = work[frame, BODY_FRAME]
    own, mine = q[6 * frame : 6 * frame + 6], out[6 * frame : 6 * frame + 6]
    apparent = acceleration + GRAVITY * f[6]
    if plant.core.driven:
        total = 0.0
        for mass in plant.core.body_mass:
            total += mass
        apparent = (along - drag(plant, work[frame, SPEED])) / total
    add_wrench(f, own, 0.0, 0.0, 0.0, 0.0, path_moment(plant, apparent, along, torque), 0.0, mine)


@kernel
def mean_motion(plant, work):
    """Distance and speed of the vehicle as means over the masses: holding forces towards them add up to nothing."""
    total, distance, speed = 0.0, 0.0, 0.0
    for b in range(plant.core.body_mass.shape[0]):
        mass = plant.core.body_mass[b]
        total += mass
        distance += mass * (work[b, DISTANCE] - plant.core.position[b, 0])
        speed += mass * work[b, SPEED]
    return distance / total, speed / total


@kernel
def travelled(knots, t):
    """Distance that the prescribed speed covers from time 0 to t [m]."""
    total, last = 0.0, knots.shape[0] - 1
    for i in range(last):
        end = min(t, knots[i + 1, 0])
        if end > knots[i, 0]:
            x = (end - knots[i, 0]) / (knots[i + 1, 0] - knots[i, 0])
            total += (end - knots[i, 0]) * (knots[i, 1] + 0.5 * x * (knots[i + 1, 1] - knots[i, 1]))
    if t > knots[last, 0]:
        total += knots[last, 1] * (t - knots[last, 0])
    return total


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
def _hold(plant, b, target, velocity, acceleration, q, work, out):
    """Longitudinal place; height, roll, pitch and yaw where they are not free; static vertical load."""
    f, motion = work[b, BODY_FRAME], work[b, BODY_MOTION]
    index = plant.core.coordinate[b]
    mass, inertia = plant.core.body_mass[b], plant.core.inertia[b]
    own, mine = q[6 * b : 6 * b + 6], out[6 * b : 6 * b + 6]
    lag = target + plant.core.position[b, 0] - f[15]
    along = mass * (acceleration + HOLD * (HOLD * lag + 2.0 * (velocity - motion[12])))
    m_x, m_y, m_z = 0.0, 0.0, 0.0
    f_z = -plant.core.vertical_load[b]
    if index[2] < 0:
        f_z += mass * (GRAVITY * f[8] + HOLD * (HOLD * (plant.core.position[b, 2] - motion[2]) - 2.0 * motion[8]))
    if index[3] < 0:
        m_x = -inertia[0] * HOLD * (HOLD * motion[3] + 2.0 * motion[9])
    if index[4] < 0:
        m_y = -inertia[1] * HOLD * (HOLD * motion[4] + 2.0 * motion[10])
    if index[5] < 0:
        wanted, wanted_rate = 0.0, 0.0
        if plant.core.curved and b == plant.core.chord_body:
            here = work[work.shape[0] - 1, REFERENCE_POSE]
            pose(plant, 0, f[15], here)
            wanted, wanted_rate = here[5], motion[12] * here[11]
        m_z = inertia[2] * HOLD * (HOLD * (wanted - motion[5]) + 2.0 * (wanted_rate - motion[11]))
    add_wrench(f, own, along, 0.0, f_z, m_x, m_y, m_z, mine)


@kernel
def wheelset_motion(plant, i, work, local):
    """Fill local (8,) as `wheels.wheelset_local` does."""
    motion = work[plant.core.wheelset_body[i], BODY_MOTION]
    local[0], local[1], local[2], local[3] = motion[1], motion[2] - plant.core.radius[i], motion[3], motion[5]
    local[4], local[5], local[6], local[7] = motion[7], motion[8], motion[9], motion[11]


@kernel
def _wheelset(plant, i, t, q, v, work, out):
    """Both contacts, torque and the gyroscopic moment of the spinning wheels; return force along the
    track [N] and torque [N m].
    """
    bodies = plant.core.body_mass.shape[0]
    b = plant.core.wheelset_body[i]
    f, local = work[b, BODY_FRAME], work[work.shape[0] - 1, WHEELSET]
    speed = work[b, SPEED]
    angle, spin = q[6 * bodies + i], v[6 * bodies + i]
    wheelset_motion(plant, i, work, local)
    left = forces_of_wheel(plant, i, 0, f[15], speed, spin, angle, local)
    right = forces_of_wheel(plant, i, 1, f[15], speed, spin, angle, local)
    own, mine = q[6 * b : 6 * b + 6], out[6 * b : 6 * b + 6]
    along = left.force_x + right.force_x
    add_wrench(
        f, own,
        along, left.force_y + right.force_y, left.force_z + right.force_z,
        left.moment_x + right.moment_x, 0.0, left.moment_z + right.moment_z, mine,
    )  # fmt: skip
    added = 0.0
    if plant.core.uneven:
        extra = work[work.shape[0] - 1, WHEELSET_EXTRA]
        wheel_extras(plant, i, angle, spin, upward(left), upward(right), extra)
        add_wrench(f, own, extra[0], 0.0, extra[1], extra[2], 0.0, extra[3], mine)
        along, added = along + extra[0], extra[4]
    torque = wheelset_torque(plant, i, t, spin, speed)
    out[6 * bodies + i] = left.moment_spin + right.moment_spin + torque + added
    momentum = plant.core.spin_inertia[i] * spin
    w_x, w_y, w_z = angular_velocity(own, v[6 * b : 6 * b + 6])
    matrix = work[b, BODY_ROTATION]
    h_x, h_y, h_z = momentum * matrix[1], momentum * matrix[4], momentum * matrix[7]
    add_moment(own, h_y * w_z - h_z * w_y, h_z * w_x - h_x * w_z, h_x * w_y - h_y * w_x, mine)
    return along, torque


@kernel
def vehicle_coordinates(plant, q, v, work, q_free, v_free):
    """Displacements and rates of the free coordinates in the vehicle frame (track frame at the reference body's
    distance); yaw and yaw rate of the body that keeps the chord's direction go to `CHORD` of the last row of work.
    """
    r = plant.core.reference_body
    f, speed = work[r, BODY_FRAME], work[r, SPEED]
    out, chord = work[work.shape[0] - 1, RELATIVE], work[work.shape[0] - 1, CHORD]
    for b in range(plant.core.body_mass.shape[0]):
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
                q_free[j] = out[k] - (plant.core.position[b, k] if k < 3 else 0.0)
                v_free[j] = out[6 + k]
        if b == plant.core.chord_body:
            chord[0], chord[1] = out[5], out[11]


@kernel
def _elements(plant, t, q, v, work, out):
    """Nonlinear elements, with elongations in the vehicle frame."""
    n = plant.core.mass.shape[0]
    spare = work[work.shape[0] - 1]
    chord, d = spare[CHORD], spare[WRENCH]
    q_free, v_free = spare[COORDINATES : COORDINATES + n], spare[COORDINATES + n : COORDINATES + 2 * n]
    vehicle_coordinates(plant, q, v, work, q_free, v_free)
    f = work[plant.core.reference_body, BODY_FRAME]
    for e in range(plant.core.elements):
        elongation = plant.core.chord_direction[e] * chord[0]
        stretching = plant.core.chord_direction[e] * chord[1]
        for j in range(n):
            elongation += plant.core.direction[e, j] * q_free[j]
            stretching += plant.core.direction[e, j] * v_free[j]
        own = plant.core.element_state[e]
        at = 6 * plant.core.body_mass.shape[0] + plant.core.radius.shape[0] + own
        resisting, change = law_force(
            plant.core.law_code[e], plant.core.parameters[e], plant.tables, t, elongation, stretching,
            v[at] if own >= 0 else 0.0,
        )  # fmt: skip
        if own >= 0:
            out[at] = change
        if resisting == 0.0:
            continue
        for b in range(plant.core.body_mass.shape[0]):
            for k in range(6):
                j = plant.core.coordinate[b, k]
                d[k] = -resisting * plant.core.direction[e, j] if j >= 0 else 0.0
            add_wrench(f, q[6 * b : 6 * b + 6], d[0], d[1], d[2], d[3], d[4], d[5], out[6 * b : 6 * b + 6])
