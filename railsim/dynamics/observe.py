"""Rows of truth from the state: what an ideal observer on the vehicle and in the contacts sees (compiled)."""

import math

from railsim.compiled import inlined, kernel
from railsim.constants import GRAVITY
from railsim.dynamics.channels import BODY, CORUNNING, RUN, SPIN, TRACK, WHEEL
from railsim.dynamics.corunning import moving_track, track_below, track_values, wheelset_distance
from railsim.dynamics.extras import doubled
from railsim.dynamics.moving_frame import frame_motion, general, pose
from railsim.dynamics.wheels import wheelset_local
from railsim.dynamics.workspace import FRAME, LOCAL, POSE
from railsim.track.kernel import CURVATURE, EAST, LEFT_VERTICAL, ROLL, locate, value
from railsim.track.track import CANT_BASE

RUN_COUNT, BODY_COUNT, SPIN_COUNT, TRACK_COUNT, WHEEL_COUNT = len(RUN), len(BODY), len(SPIN), len(TRACK), len(WHEEL)
CORUNNING_COUNT = len(CORUNNING)
ROLL_ROW, PITCH_ROW, YAW_ROW, X_ROW = 2, 3, 4, BODY.index("x [m]")


@inlined
def cosines_and_sines(roll, pitch, yaw):
    """Cosines and sines of roll, pitch and yaw."""
    return math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)


@inlined
def body_axes(angles, x, y, z):
    """Components of a vector in body axes, from those in the frame in which the body is turned by yaw, pitch and roll
    (in this order).
    """
    x, y = angles[4] * x + angles[5] * y, angles[4] * y - angles[5] * x
    x, z = angles[2] * x - angles[3] * z, angles[2] * z + angles[3] * x
    return x, angles[0] * y + angles[1] * z, angles[0] * z - angles[1] * y


@kernel
def run_row(plant, s, velocity, acceleration, row):
    """Distance, speed and the place of the track frame's origin."""
    cell, x = locate(plant.core.s0, plant.core.ds, plant.core.cells, s)
    row[0], row[1], row[2] = s, velocity, acceleration
    for k in range(3):
        row[3 + k] = value(plant.track, cell, EAST + k, x)


@kernel
def track_row(plant, s, row):
    """Curvature, cant and the four rail coordinates at s."""
    c = plant.track
    cell, x = locate(plant.core.s0, plant.core.ds, plant.core.cells, s)
    row[0] = value(c, cell, CURVATURE, x)
    row[1] = -CANT_BASE * math.sin(value(c, cell, ROLL, x))
    for k in range(4):
        row[2 + k] = value(c, cell, LEFT_VERTICAL + k, x)


@kernel
def observe(plant, t, x, x_dot, wheels, scratch, row):
    """Fill a row of truth from the compiled engine's state, its derivative and what is kept of the wheels' contacts."""
    n, w = plant.core.mass.shape[0], plant.core.radius.shape[0]
    q, rate, accel = x[:n], x[n : 2 * n], x_dot[n : 2 * n]
    s, velocity = x[2 * n + 2 * w], x_dot[2 * n + 2 * w]
    acceleration = x_dot[2 * n + 2 * w + 1]
    frame, here, local = scratch[FRAME], scratch[POSE], scratch[LOCAL]
    frame_motion(plant, s, velocity, acceleration, frame)
    row[0] = t
    run_row(plant, s, velocity, acceleration, row[1 : 1 + RUN_COUNT])
    at = 1 + RUN_COUNT
    for b in range(plant.core.body_mass.shape[0]):
        if general(plant):
            frame_motion(plant, s + plant.core.frame_offset[plant.core.body_frame[b]], velocity, acceleration, frame)
        _body_row(plant, b, s, velocity, q, rate, accel, acceleration, frame, here, row[at : at + BODY_COUNT])
        row[at + 1] -= plant.core.sunk[b]
        at += BODY_COUNT
    for i in range(w):
        body = plant.core.wheelset_body[i]
        distance = s + plant.core.position[body, 0]
        if general(plant):
            distance += _free(q, plant.core.coordinate[body, 0])
        wheelset_local(plant, i, s, velocity, q, rate, here, local)
        start = 1 + RUN_COUNT + body * BODY_COUNT
        for k, axis in enumerate((0, 1, ROLL_ROW, YAW_ROW)):  # wheelsets: relative to the track at their own distance
            row[start + axis] = local[k]
            row[start + 5 + axis] = local[4 + k]
        row[at], row[at + 1] = x[2 * n + i], x[2 * n + w + i]
        track_row(plant, distance, row[at + SPIN_COUNT : at + SPIN_COUNT + TRACK_COUNT])
        at += SPIN_COUNT + TRACK_COUNT
        for side in range(2):
            kept = 2 * WHEEL_COUNT if doubled(plant) else WHEEL_COUNT
            for k in range(kept):
                row[at + k] = wheels[2 * i + side, k]
            at += kept
    displacements(plant, q, row[at:])
    if moving_track(plant):
        at = row.shape[0] - w * CORUNNING_COUNT
        for i in range(w):
            track_values(
                plant, wheelset_distance(plant, i, s, q), track_below(plant, i, x)[0], row[at : at + CORUNNING_COUNT]
            )
            at += CORUNNING_COUNT


@kernel
def _body_row(plant, b, s, velocity, q, rate, accel, acceleration, frame, here, row):
    index = plant.core.coordinate[b]
    row[:] = 0.0
    second = here[6:12]
    second[:] = 0.0
    for k in range(5):
        j = index[1 + k]
        if j >= 0:
            row[k], row[5 + k], second[k] = q[j], rate[j], accel[j]
    if b == plant.core.chord_body:
        pose(plant, 0, s, here)
        row[YAW_ROW], row[5 + YAW_ROW] = here[5], velocity * here[11]
        for k in range(5):
            j = index[1 + k]
            second[k] = accel[j] if j >= 0 else 0.0
    o_x, o_y, o_z, a_x, a_y, a_z = frame[0], frame[1], frame[2], frame[3], frame[4], frame[5]
    ahead, along = plant.core.local[b, 0], velocity
    if general(plant) and index[0] >= 0:
        row[X_ROW], row[X_ROW + 1] = q[index[0]], rate[index[0]]
        ahead, along, acceleration = ahead + q[index[0]], along + 2.0 * rate[index[0]], acceleration + accel[index[0]]
    p_x, p_y, p_z = ahead, plant.core.position[b, 1] + row[0], plant.core.position[b, 2] + row[1]
    c_x = o_y * p_z - o_z * p_y + along
    c_y = o_z * p_x - o_x * p_z + 2.0 * row[5]
    c_z = o_x * p_y - o_y * p_x + 2.0 * row[6]
    f_x = acceleration + a_y * p_z - a_z * p_y + o_y * c_z - o_z * c_y + GRAVITY * frame[6]
    f_y = second[0] + a_z * p_x - a_x * p_z + o_z * c_x - o_x * c_z + GRAVITY * frame[7]
    f_z = second[1] + a_x * p_y - a_y * p_x + o_x * c_y - o_y * c_x + GRAVITY * frame[8]
    angles = cosines_and_sines(row[ROLL_ROW], row[PITCH_ROW], row[YAW_ROW])
    row[10], row[11], row[12] = body_axes(angles, f_x, f_y, f_z)
    t_x, t_y, t_z = body_axes(angles, o_x, o_y, o_z)
    row[13], row[14], row[15] = t_x + row[7], t_y + row[8], t_z + row[9]
    t_x, t_y, t_z = body_axes(angles, a_x, a_y, a_z)
    row[16], row[17], row[18] = t_x + second[2], t_y + second[3], t_z + second[4]


@kernel
def displacements(plant, q, row):
    """Vertical movement of the frame above each axlebox, extension +, of the wheelsets that carry one."""
    at = 0
    for i in range(plant.core.radius.shape[0]):
        carried, body = plant.core.frame_body[i], plant.core.wheelset_body[i]
        if carried < 0:
            continue
        frame, index = plant.core.coordinate[carried], plant.core.coordinate[body]
        x = plant.core.position[body, 0] - plant.core.position[carried, 0]
        height = _free(q, frame[2]) - x * _free(q, frame[4]) - _free(q, index[2])
        roll = _free(q, frame[3]) - _free(q, index[3])
        row[at] = height + plant.core.axlebox[i] * roll
        row[at + 1] = height - plant.core.axlebox[i] * roll
        if plant.core.sunk[carried] != 0.0:
            for side in range(2):
                row[at + side] -= plant.core.sunk[carried]
        at += 2


@inlined
def _free(q, j):
    """Coordinate j, zero where it is held."""
    return q[j] if j >= 0 else 0.0
