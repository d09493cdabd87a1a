"""Rows of truth from the absolute coordinates of the Exudyn engine (compiled)."""

import math

from railsim.compiled import kernel
from railsim.constants import GRAVITY
from railsim.dynamics.absolute import absolute_track, on_both_rails, wheelset_motion
from railsim.dynamics.absolute_frames import angular_velocity, locate_body, origin_frames, vehicle_coordinates
from railsim.dynamics.corunning import moving_track, track_values
from railsim.dynamics.extras import doubled
from railsim.dynamics.observe import (
    BODY_COUNT,
    CORUNNING_COUNT,
    RUN_COUNT,
    SPIN_COUNT,
    TRACK_COUNT,
    WHEEL_COUNT,
    X_ROW,
    displacements,
    run_row,
    track_row,
)
from railsim.dynamics.wheels import forces_of_wheel, second_of_wheel, wheel_row
from railsim.dynamics.workspace import (
    BODY_FRAME,
    BODY_MOTION,
    BODY_ROTATION,
    COORDINATES,
    DISTANCE,
    ON_RIGHT,
    SPEED,
    WHEELSET,
)


@kernel
def observe_absolute(plant, t, q, v, a, memory, work, row):
    """Fill a row from coordinates, velocities and accelerations of Exudyn (6 per body, then spins)."""
    bodies, w = plant.core.body_mass.shape[0], plant.core.radius.shape[0]
    for b in range(bodies):
        locate_body(plant, b, q, v, memory, work)
    r = plant.core.driver_body
    f = work[r, BODY_FRAME]
    own = a[6 * r : 6 * r + 3]
    tangential = f[0] * own[0] + f[3] * own[1] + f[6] * own[2]
    row[0] = t
    here, velocity = origin_frames(plant, work)
    run_row(plant, here, velocity, tangential, row[1 : 1 + RUN_COUNT])
    n, spare = plant.core.mass.shape[0], work[bodies]
    q_free, v_free = spare[COORDINATES : COORDINATES + n], spare[COORDINATES + n : COORDINATES + 2 * n]
    vehicle_coordinates(plant, q, v, work, q_free, v_free)
    at = 1 + RUN_COUNT
    for b in range(bodies):
        _body(plant, b, q, v, a, work, row[at : at + BODY_COUNT])
        along = plant.core.coordinate[b, 0]
        if along >= 0:
            row[at + X_ROW], row[at + X_ROW + 1] = q_free[along], v_free[along]
        at += BODY_COUNT
    for i in range(w):
        local = work[bodies, WHEELSET]
        b = plant.core.wheelset_body[i]
        s, speed = work[b, DISTANCE], work[b, SPEED]
        wheelset_motion(plant, i, work, local)
        if moving_track(plant):
            on_both_rails(plant, i, q, v, work)
        row[at], row[at + 1] = q[6 * bodies + i], v[6 * bodies + i]
        track_row(plant, s, row[at + SPIN_COUNT : at + SPIN_COUNT + TRACK_COUNT])
        at += SPIN_COUNT + TRACK_COUNT
        for side in range(2):
            if moving_track(plant) and side == 1:
                local = work[bodies, ON_RIGHT]
            forces = forces_of_wheel(plant, i, side, s, speed, v[6 * bodies + i], q[6 * bodies + i], local)
            wheel_row(forces, row[at : at + WHEEL_COUNT])
            at += WHEEL_COUNT
            if doubled(plant):
                forces = second_of_wheel(plant, i, side, s, speed, v[6 * bodies + i], q[6 * bodies + i], local)
                wheel_row(forces, row[at : at + WHEEL_COUNT])
                at += WHEEL_COUNT
    if at < row.shape[0]:
        displacements(plant, q_free, row[at:])
    if moving_track(plant):
        at = row.shape[0] - w * CORUNNING_COUNT
        for i in range(w):
            distance, track = work[plant.core.wheelset_body[i], DISTANCE], absolute_track(plant, i, q, v)[0]
            track_values(plant, distance, track, row[at : at + CORUNNING_COUNT])
            at += CORUNNING_COUNT


@kernel
def _body(plant, b, q, v, a, work, row):
    motion, matrix = work[b, BODY_MOTION], work[b, BODY_ROTATION]
    own, rate, second = q[6 * b : 6 * b + 6], v[6 * b : 6 * b + 6], a[6 * b : 6 * b + 6]
    row[0] = motion[1] - plant.core.position[b, 1]
    row[1] = motion[2] - plant.core.position[b, 2] - plant.core.sunk[b]
    row[5], row[6] = motion[7], motion[8]
    for k in range(3):
        row[2 + k], row[7 + k] = motion[3 + k], motion[9 + k]
    f_x, f_y, f_z = second[0], second[1], second[2] + GRAVITY
    w_x, w_y, w_z = angular_velocity(own, rate)
    ca, sa, cb, sb = math.cos(own[3]), math.sin(own[3]), math.cos(own[4]), math.sin(own[4])
    a_x, a_y, a_z = angular_velocity(own, second)
    a_x += cb * rate[4] * rate[5]
    a_y += -sa * rate[3] * rate[4] + (-ca * cb * rate[3] + sa * sb * rate[4]) * rate[5]
    a_z += ca * rate[3] * rate[4] + (-sa * cb * rate[3] - ca * sb * rate[4]) * rate[5]
    for k in range(3):
        row[10 + k] = matrix[k] * f_x + matrix[3 + k] * f_y + matrix[6 + k] * f_z
        row[13 + k] = matrix[k] * w_x + matrix[3 + k] * w_y + matrix[6 + k] * w_z
        row[16 + k] = matrix[k] * a_x + matrix[3 + k] * a_y + matrix[6 + k] * a_z


@kernel
def observe_all(plant, time, coordinates, velocities, accelerations, memory, work, rows):
    """Rows for all instants."""
    for k in range(time.shape[0]):
        observe_absolute(plant, time[k], coordinates[k], velocities[k], accelerations[k], memory, work, rows[k])
