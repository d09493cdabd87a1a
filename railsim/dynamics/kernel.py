"""Right-hand side of a vehicle in the moving track frame (compiled).

The vehicle frame is the track frame at distance s: origin on the centre line, velocity V along x, angular velocity
Omega = V k(s) with k the curvature vector of the frame (heading, gradient, cant). Every body gets the frame's
inertial forces at its own place (Goldstein 1980, section 4.10) and gravity turned into the frame; suspension forces
are linear in the displacements (K holds the preloads' geometric stiffness); contacts are evaluated in the track
frame at each wheelset's own distance.

State x = [q (n), q' (n), spin angle (w), spin (w), s, V, states of elements (m)].
"""

import math

from railsim.compiled import inlined, kernel
from railsim.constants import GRAVITY
from railsim.dynamics.extras import load_value, wheel_extras
from railsim.dynamics.laws import BUMP_STOP, bump_stop, law_force
from railsim.dynamics.moving_frame import frame_forces, frame_motion, pose
from railsim.dynamics.wheels import evaluate, forces_in_lane, put, upward, wheel_row, wheelset_local
from railsim.dynamics.workspace import ELEMENT, EXTRA, FRAME, LANES, LOCAL, POSE, POSES
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
    if slip != 0.0:
        torque -= SLIDE_GAIN * plant.core.spin_inertia[i] * (spin - (1.0 - slip) * velocity / plant.core.radius[i])
    column += plant.core.radius.shape[0]
    brake = plant.knots[a, column] + x * (plant.knots[b, column] - plant.knots[a, column])
    if brake > 0.0:
        torque -= max(-brake, min(brake, BRAKE_GRIP * plant.core.spin_inertia[i] * spin))
    return torque


@kernel
def derivatives(plant, t, x, out, scratch):
    """Fill out = dx/dt; scratch: of `workspace.workspace`."""
    _change(plant, t, x, out, scratch, scratch[:0].reshape(0, 0), False)


@kernel
def derivatives_and_wheels(plant, t, x, out, scratch, wheels):
    """The same, and wheels (2 w, 10) with what is kept of each wheel's contact, by wheelset, left before right."""
    _change(plant, t, x, out, scratch, wheels, True)


@inlined
def _change(plant, t, x, out, scratch, wheels, observed):
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
    for e in range(plant.core.finite):
        finite_element(plant, e, s, velocity, q, rate, force, scratch[ELEMENT])
    for e in range(plant.core.elements):
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
            resisting = _other_law(plant, e, t, elongation, stretching, x, out)
        if resisting != 0.0:
            for i in range(n):
                force[i] -= plant.core.direction[e, i] * resisting
    if plant.core.loads > 0:
        _loads(plant, t, s, force)
    along, rolling, torque = _wheelsets(plant, t, s, velocity, x, q, rate, force, out, scratch, wheels, observed)
    if plant.core.driven:
        acceleration = _free_acceleration(plant, s, velocity, along)
    frame_motion(plant, s, velocity, acceleration, frame)
    if plant.core.path_frame >= 0:
        pitch = plant.core.coordinate[plant.core.path_frame, 4]
        force[pitch] += path_moment(plant, acceleration + GRAVITY * frame[6], rolling, torque)
    frame_forces(plant, velocity, x, q, rate, force, frame)
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


@kernel
def _other_law(plant, e, t, elongation, stretching, x, out):
    """Force of an element of another law than the bump stop's; the rate of its state goes to `out`."""
    own = plant.core.element_state[e]
    at = 2 * plant.core.mass.shape[0] + 2 * plant.core.radius.shape[0] + 2 + own
    state = x[at] if own >= 0 else 0.0
    resisting, change = law_force(
        plant.core.law_code[e], plant.core.parameters[e], plant.tables, t, elongation, stretching, state
    )
    if own >= 0:
        out[at] = change
    return resisting


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
def finite_element(plant, e, s, velocity, q, rate, force, work):
    """Linear element with its axes midway between both bodies' orientations, to second order in the rotations.

    Forces are the gradient of the element's energy in that stretch, so it conserves energy; work (96,).
    """
    upper, lower = plant.core.finite_bodies[e, 0], plant.core.finite_bodies[e, 1]
    arms = plant.core.finite_arms[e]
    position_u, rate_u, position_l, rate_l = work[0:6], work[6:12], work[12:18], work[18:24]
    moved_u, moved_l, stretch, speed = work[24:27], work[27:30], work[30:36], work[36:42]
    middle, spare, turned, joint_force = work[42:45], work[45:48], work[48:51], work[51:54]
    body_coordinates(plant, upper, s, velocity, q, rate, work[60:72], position_u, rate_u)
    body_coordinates(plant, lower, s, velocity, q, rate, work[60:72], position_l, rate_l)
    turned_arm(position_u[3:], arms[0], spare, moved_u)
    turned_arm(position_l[3:], arms[1], spare, moved_l)
    cross(rate_u[3:], arms[0], spare)
    cross(rate_l[3:], arms[1], turned)
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
    for i in range(6):
        total = 0.0
        for j in range(6):
            total += (
                plant.core.finite_stiffness[e, i, j] * work[72 + j] + plant.core.finite_damping[e, i, j] * work[78 + j]
            )
        work[84 + i] = -total
    for k in range(3):
        work[84 + k] += plant.core.finite_preload[e, k]
    cross(middle, work[84:87], spare)
    for k in range(3):
        joint_force[k] = work[84 + k] + spare[k]
    cross(stretch, work[84:87], turned)  # the axes turn with both bodies
    lever_moment(position_u[3:], arms[0], joint_force, work[60:72], moved_u)
    lever_moment(position_l[3:], arms[1], joint_force, work[60:72], moved_l)
    for k in range(3):
        i, j = plant.core.coordinate[upper, k], plant.core.coordinate[lower, k]
        if i >= 0:
            force[i] += joint_force[k]
        if j >= 0:
            force[j] -= joint_force[k]
        i, j = plant.core.coordinate[upper, 3 + k], plant.core.coordinate[lower, 3 + k]
        if i >= 0:
            force[i] += moved_u[k] - 0.5 * turned[k] + work[87 + k]
        if j >= 0:
            force[j] -= moved_l[k] + 0.5 * turned[k] + work[87 + k]


@inlined
def _wheelsets(plant, t, s, velocity, x, q, rate, force, out, scratch, wheels, observed):
    """Add the contact forces, and keep them if they are `observed`; return the sums along the vehicle's x and along
    each wheelset's own track [N], and of the torques [N m].
    """
    n, w = plant.core.mass.shape[0], plant.core.radius.shape[0]
    local, extra, poses, lanes = scratch[LOCAL], scratch[EXTRA], scratch[POSES].reshape(2, 12), scratch[LANES]
    along, rolling, torques = 0.0, 0.0, 0.0
    for first in range(0, w, 2):
        last = min(first + 2, w)
        for i in range(first, last):
            distance = s + plant.core.position[plant.core.wheelset_body[i], 0]
            wheelset_local(plant, i, s, velocity, q, rate, poses[i - first], local)
            for side in range(2):
                lane = 2 * (i - first) + side
                put(plant, i, side, lane, distance, velocity, x[2 * n + w + i], x[2 * n + i], local, lanes)
        evaluate(plant.core.law, lanes)
        for i in range(first, last):
            here, index = poses[i - first], plant.core.coordinate[plant.core.wheelset_body[i]]
            angle, spin = x[2 * n + i], x[2 * n + w + i]
            left, right = forces_in_lane(lanes, 2 * (i - first)), forces_in_lane(lanes, 2 * (i - first) + 1)
            if observed:
                wheel_row(left, wheels[2 * i])
                wheel_row(right, wheels[2 * i + 1])
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
            out[2 * n + i] = spin
            out[2 * n + w + i] = (left.moment_spin + right.moment_spin + torque + added) / plant.core.spin_inertia[i]
            # gyroscopic moments of the spinning wheels
            if index[3] >= 0 and index[5] >= 0:
                momentum = plant.core.spin_inertia[i] * spin
                force[index[3]] += momentum * rate[index[5]]
                force[index[5]] -= momentum * rate[index[3]]
    return along, rolling, torques


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
    return a[0] + velocity * (a[1] + velocity * a[2]) if velocity > 0.0 else 0.0


@inlined
def _free_acceleration(plant, s, velocity, along):
    total = 0.0
    for mass in plant.core.body_mass:
        total += mass
    climb = 0.0
    if plant.core.curved:
        cell, x = locate(plant.core.s0, plant.core.ds, plant.core.cells, s)
        climb = math.sin(value(plant.track, cell, GRADIENT, x))
    return (along - drag(plant, velocity)) / total - GRAVITY * climb
