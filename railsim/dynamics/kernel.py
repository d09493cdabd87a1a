"""Right-hand side of a vehicle in the moving track frame (compiled).

The vehicle frame is the track frame at distance s: origin on the centre line, velocity V along x, angular velocity
Omega = V k(s) with k the curvature vector of the frame (heading, gradient, cant). Every body gets the frame's
inertial forces at its own place (Goldstein 1980, section 4.10) and gravity turned into the frame; suspension forces
are linear in the displacements (K holds the preloads' geometric stiffness); contacts are evaluated in the track
frame at each wheelset's own distance.

A model whose bodies refer to several track frames, or move along the track, is `general`: each body gets the inertial
forces of its own frame, and `joints` carries displacements and forces from one frame to the other. Which of both a
model is, is known when the kernel is compiled; others pay nothing for it.

State x = [q (n), q' (n), spin angle (w), spin (w), s, V, states of elements (m)], and where a track runs with the
wheelsets, its coordinates (7 w), their rates (7 w) and the lags of its contacts (2 w) behind.
"""

import math

from railsim.branches import vanishes, where
from railsim.compiled import inlined, kernel
from railsim.constants import GRAVITY
from railsim.contact.wheel import upward
from railsim.dynamics.corunning import (
    keep_contacts,
    keep_yaw_rate,
    moving_track,
    on_rail,
    settle_contacts,
    track_below,
    track_rates,
    track_velocities,
    wheelset_distance,
)
from railsim.dynamics.elements import finite_element
from railsim.dynamics.extras import doubled, load_value, wheel_extras
from railsim.dynamics.joints import close_joints, element_of_joint, law_of_joint, open_joints
from railsim.dynamics.laws import BUMP_STOP, bump_stop, element_force
from railsim.dynamics.moving_frame import frame_forces, frame_motion, frames_forces, general, pose
from railsim.dynamics.observe import WHEEL_COUNT
from railsim.dynamics.wheels import evaluate, put, resultant_in_lane, second_in_lane, wheel_row, wheelset_local
from railsim.dynamics.workspace import CONTACTS, ELEMENT, EXTRA, FRAME, JOINTS, LANES, LOCAL, ON_TRACK, POSE, POSES
from railsim.track.kernel import GRADIENT, locate, value

BRAKE_GRIP = 400.0  # 1/s; a brake's torque per spin inertia and spin, until it slips: it holds a wheelset that stands
SLIDE_GAIN = 400.0  # 1/s; brake torque of the slide control per spin inertia and spin error


@inlined
def knot(knots, t):
    """Interval and fraction of the speed table at time t."""
    last = knots.shape[0] - 1
    if t >= knots[last, 0]:
        return last, last, 0.0, 0.0
    i, above = 0, last
    while above - i > 1:
        middle = (i + above) // 2
        if t >= knots[middle, 0]:
            i = middle
        else:
            above = middle
    length = knots[i + 1, 0] - knots[i, 0]
    return i, i + 1, (t - knots[i, 0]) / length, 1.0 / length


@inlined
def prescribed_speed(knots, t):
    """Speed [m/s] and acceleration [m/s2] of a prescribed profile."""
    i, j, x, inverse = knot(knots, t)
    step = knots[j, 1] - knots[i, 1]
    return knots[i, 1] + x * step, step * inverse


@inlined
def wheelset_torque(plant, i, t, spin, velocity):
    """Drive or brake torque on wheelset i [N m]; the slide control holds the wanted slip while that is not 0."""
    a, b, x, _ = knot(plant.knots, t)
    torque = plant.knots[a, 2 + i] + x * (plant.knots[b, 2 + i] - plant.knots[a, 2 + i])
    column = 2 + plant.core.radius.shape[0] + i
    slip = plant.knots[a, column] + x * (plant.knots[b, column] - plant.knots[a, column])
    slide = SLIDE_GAIN * plant.core.spin_inertia[i] * (spin - (1.0 - slip) * velocity / plant.core.radius[i])
    column += plant.core.radius.shape[0]
    brake = plant.knots[a, column] + x * (plant.knots[b, column] - plant.knots[a, column])
    grip = max(-brake, min(brake, BRAKE_GRIP * plant.core.spin_inertia[i] * spin))
    return torque - where(slip != 0.0, slide, 0.0) - where(brake > 0.0, grip, 0.0)


@kernel
def derivatives(plant, t, x, out, scratch, wheels):
    """Fill out = dx/dt, and wheels (2 w, 10) with what is kept of each wheel's contact, by wheelset, left before right
    (two contacts: (2 w, 20), the first one's before the second's); with `workspace.NO_WHEELS` nothing is kept.
    scratch: of `workspace.workspace`.
    """
    n, w = plant.core.mass.shape[0], plant.core.radius.shape[0]
    q, rate = x[:n], x[n : 2 * n]
    force = out[n : 2 * n]
    s, velocity = x[2 * n + 2 * w], x[2 * n + 2 * w + 1]
    acceleration = 0.0
    if not plant.core.driven:
        velocity, acceleration = prescribed_speed(plant.knots, t)
    frame, here = scratch[FRAME], scratch[POSE]
    for i in range(n):
        out[i] = rate[i]
        total = 0.0
        for k in range(plant.core.link_start[i], plant.core.link_start[i + 1]):
            j = plant.core.link[k]
            total += plant.core.link_stiffness[k] * q[j] + plant.core.link_damping[k] * rate[j]
        force[i] = plant.core.preload[i] - total
    held = 0.0
    if general(plant):
        open_joints(plant, s, velocity, q, rate, scratch[JOINTS], scratch[ELEMENT])
    for e in range(plant.core.finite):
        if general(plant) and plant.core.finite_joint[e] >= 0:
            element_of_joint(plant, e, q, rate, force, scratch[JOINTS], scratch[ELEMENT])
        else:
            finite_element(plant, e, s, velocity, q, rate, force, scratch[ELEMENT])
    for e in range(plant.core.elements):
        if general(plant) and plant.core.element_joint[e] >= 0:
            law_of_joint(plant, e, t, q, rate, x, force, out, scratch[JOINTS], scratch[ELEMENT])
            continue
        elongation, stretching = 0.0, 0.0
        for i in range(n):
            elongation += plant.core.direction[e, i] * q[i]
            stretching += plant.core.direction[e, i] * rate[i]
        if plant.core.curved and plant.core.chord_direction[e] != 0.0:
            pose(plant, 0, s, here)
            elongation += plant.core.chord_direction[e] * here[5]
            stretching += plant.core.chord_direction[e] * velocity * here[11]
        if plant.core.law_code[e] == BUMP_STOP:
            resisting = bump_stop(plant.core.parameters[e], elongation)
        else:
            resisting = element_force(plant, e, t, elongation, stretching, x, out)
        if vanishes(resisting):
            continue
        for i in range(n):
            force[i] -= plant.core.direction[e, i] * resisting
    if general(plant):
        held = close_joints(plant, q, force, scratch[JOINTS], scratch[ELEMENT])
    if plant.core.loads > 0:
        _loads(plant, t, s, force)
    along, rolling, torque = _wheelsets(plant, t, s, velocity, x, q, rate, force, out, scratch, wheels)
    if plant.core.driven:
        acceleration = _free_acceleration(plant, s, velocity, held if plant.core.moves_along else along)
    frame_motion(plant, s, velocity, acceleration, frame)
    if plant.core.path_frame >= 0:
        pitch = plant.core.coordinate[plant.core.path_frame, 4]
        force[pitch] += path_moment(plant, acceleration + GRAVITY * frame[6], rolling, torque)
    if general(plant):
        frames_forces(plant, s, velocity, acceleration, x, q, rate, force, frame)
    else:
        frame_forces(plant, velocity, x, q, rate, force, frame)
    if moving_track(plant):
        settle_contacts(plant, s, velocity, acceleration, x, force, out, scratch[CONTACTS])
        track_velocities(plant, x, out)
    for i in range(n):
        force[i] /= plant.core.mass[i]
    out[2 * n + 2 * w] = velocity
    out[2 * n + 2 * w + 1] = acceleration


@kernel
def _loads(plant, t, s, force):
    """Add the loads on bodies."""
    for k in range(plant.core.loads):
        body = plant.core.load_body[k]
        j = plant.core.coordinate[body, plant.core.load_axis[k]]
        if j >= 0:
            force[j] += load_value(plant, k, t, s + plant.core.position[body, 0])


@inlined
def _wheelsets(plant, t, s, velocity, x, q, rate, force, out, scratch, wheels):
    """Add the contact forces, and keep them where `wheels` has rows; return the sums along the vehicle's x and along
    each wheelset's own track [N], and of the torques [N m].
    """
    n, w = plant.core.mass.shape[0], plant.core.radius.shape[0]
    local, extra, poses, lanes = scratch[LOCAL], scratch[EXTRA], scratch[POSES].reshape(2, 12), scratch[LANES]
    along, rolling, torques = 0.0, 0.0, 0.0
    for first in range(0, w, 2):
        last = min(first + 2, w)
        if moving_track(plant):
            _put_on_track(plant, first, last, s, velocity, x, q, rate, out, poses, scratch)
        for i in range(first, first if moving_track(plant) else last):
            distance, own = s + plant.core.position[plant.core.wheelset_body[i], 0], velocity
            if general(plant):
                along_track = plant.core.coordinate[plant.core.wheelset_body[i], 0]
                if along_track >= 0:
                    distance, own = distance + q[along_track], velocity + rate[along_track]
            wheelset_local(plant, i, s, velocity, q, rate, poses[i - first], local)
            for side in range(2):
                lane = 2 * (i - first) + side
                put(plant, i, side, lane, distance, own, x[2 * n + w + i], x[2 * n + i], local, lanes)
        evaluate(plant.core.law, lanes)
        for i in range(first, last):
            here, index = poses[i - first], plant.core.coordinate[plant.core.wheelset_body[i]]
            angle, spin = x[2 * n + i], x[2 * n + w + i]
            lane = 2 * (i - first)
            left, right = resultant_in_lane(plant, lanes, lane), resultant_in_lane(plant, lanes, lane + 1)
            if wheels.shape[0] > 0:
                wheel_row(left, wheels[2 * i])
                wheel_row(right, wheels[2 * i + 1])
                if doubled(plant):
                    wheel_row(second_in_lane(lanes, lane), wheels[2 * i, WHEEL_COUNT:])
                    wheel_row(second_in_lane(lanes, lane + 1), wheels[2 * i + 1, WHEEL_COUNT:])
            if moving_track(plant):
                track, moving = track_below(plant, i, x)
                track_rates(
                    plant, wheelset_distance(plant, i, s, q), track, moving, track_below(plant, i, out)[1],
                    -left.force_y, -left.force_z, -right.force_y, -right.force_z,
                )  # fmt: skip
                keep_contacts(plant, i, left, right, out)
            f_x, f_y, f_z = left.force_x + right.force_x, left.force_y + right.force_y, left.force_z + right.force_z
            m_x, m_z = left.moment_x + right.moment_x, left.moment_z + right.moment_z
            added = 0.0
            if plant.core.uneven:
                wheel_extras(plant, i, angle, spin, upward(left), upward(right), extra)
                f_x, f_z, m_x, m_z, added = f_x + extra[0], f_z + extra[1], m_x + extra[2], m_z + extra[3], extra[4]
            rolling += f_x
            if plant.core.curved:
                f_x, f_y, f_z = (
                    f_x + here[4] * f_z - here[5] * f_y,
                    f_y + here[5] * f_x - here[3] * f_z,
                    f_z + here[3] * f_y - here[4] * f_x,
                )
            along += f_x
            if general(plant) and index[0] >= 0:
                force[index[0]] += f_x
            if index[1] >= 0:
                force[index[1]] += f_y
            if index[2] >= 0:
                force[index[2]] += f_z
            if index[3] >= 0:
                force[index[3]] += m_x
            if index[5] >= 0:
                force[index[5]] += m_z
            torque = wheelset_torque(plant, i, t, spin, velocity)
            torques += torque
            if general(plant) and plant.core.moves_along and plant.core.frame_body[i] >= 0:
                pitch = plant.core.coordinate[plant.core.frame_body[i], 4]
                if pitch >= 0:
                    force[pitch] -= torque  # what drives or brakes it stands on its bogie
            out[2 * n + i] = spin
            out[2 * n + w + i] = (left.moment_spin + right.moment_spin + torque + added) / plant.core.spin_inertia[i]
            # gyroscopic moments of the spinning wheels
            if index[3] >= 0 and index[5] >= 0:
                momentum = plant.core.spin_inertia[i] * spin
                force[index[3]] += momentum * rate[index[5]]
                force[index[5]] -= momentum * rate[index[3]]
    return along, rolling, torques


@kernel
def _put_on_track(plant, first, last, s, velocity, x, q, rate, out, poses, scratch):
    """Put the wheels of wheelsets `first` up to `last` into their lanes, on rails that move."""
    n, w, local, placed = plant.core.mass.shape[0], plant.core.radius.shape[0], scratch[LOCAL], scratch[ON_TRACK]
    for i in range(first, last):
        along_track, own = plant.core.coordinate[plant.core.wheelset_body[i], 0], velocity
        if along_track >= 0:
            own += rate[along_track]
        wheelset_local(plant, i, s, velocity, q, rate, poses[i - first], local)
        keep_yaw_rate(plant, i, local[7], out)
        track, moving = track_below(plant, i, x)
        for side in range(2):
            on_rail(plant, side, track, moving, local, placed)
            put(
                plant, i, side, 2 * (i - first) + side, wheelset_distance(plant, i, s, q), own,
                x[2 * n + w + i], x[2 * n + i], placed, scratch[LANES],
            )  # fmt: skip


@inlined
def path_moment(plant, acceleration, along, torque):
    """Pitching moment on the bogie [N m] of what goes through it along the track: d'Alembert on each body.

    Each wheelset pushes it by its contact force less what its own mass takes, at the axle's height; the car body holds
    it back at the rod's height by what then is missing for the bogie's own acceleration; brakes and motors react.
    `acceleration` [m/s2] holds gravity's part along the track; `along` [N] and `torque` [N m] are those of all
    wheelsets.
    """
    axles = along - plant.core.path_mass[0] * acceleration
    rod = plant.core.path_mass[1] * acceleration - axles
    return plant.core.path_lever[0] * axles + plant.core.path_lever[1] * rod - torque


@inlined
def drag(plant, velocity):
    """Running resistance [N]."""
    a = plant.core.resistance
    return where(velocity > 0.0, a[0] + velocity * (a[1] + velocity * a[2]), 0.0)


@inlined
def _free_acceleration(plant, s, velocity, along):
    """Acceleration of what is held together along the track, under the force on it [m/s2]."""
    total = 0.0
    for b in range(plant.core.body_mass.shape[0]):
        if not plant.core.moves_along or plant.core.coordinate[b, 0] < 0:
            total += plant.core.body_mass[b]
    climb = 0.0
    if plant.core.curved:
        cell, x = locate(plant.core.s0, plant.core.ds, plant.core.cells, s + plant.core.driver_origin)
        climb = math.sin(value(plant.track, cell, GRADIENT, x))
    return (along - drag(plant, velocity)) / total - GRAVITY * climb
