"""Contacts, holding forces and nonlinear elements of a vehicle in absolute coordinates (compiled); the Exudyn
engine's user function.

Bodies have six absolute coordinates each, X, Y, Z and Tait-Bryan angles a, b, c with A = Rx(a) Ry(b) Rz(c); the
wheels' spins follow. A body's place along the track is found by projection on the centre line; its displacements
relative to the track frame there are exact (finite rotations). No inertial force of a moving frame appears here:
curvature, cant and gradient act through the contacts alone, which makes this an independent check of the moving
frame of `kernel`.

Movements and rotations that a body does not list as free are held to the track frame by
critically damped springs.
"""

from railsim.compiled import inlined, kernel
from railsim.constants import GRAVITY
from railsim.contact.wheel import upward
from railsim.dynamics.absolute_elements import elements
from railsim.dynamics.absolute_frames import add_moment, add_wrench, angular_velocity, locate_body
from railsim.dynamics.corunning import COORDINATES, moving_track, on_rail, track_rates
from railsim.dynamics.extras import load_value, wheel_extras
from railsim.dynamics.kernel import drag, path_moment, prescribed_speed, wheelset_torque
from railsim.dynamics.moving_frame import pose
from railsim.dynamics.wheels import forces_of_wheel
from railsim.dynamics.workspace import (
    BODY_FRAME,
    BODY_MOTION,
    BODY_ROTATION,
    DISTANCE,
    ON_RIGHT,
    REFERENCE_POSE,
    SPEED,
    WHEELSET,
    WHEELSET_EXTRA,
    WRENCH,
)

HOLD = 400.0  # rad/s; natural frequency of the holding springs
PROJECTIONS = 6  # Newton steps at most


@kernel
def forces(plant, t, start, q, v, memory, work, out):
    """Fill out (6 b + w + m,) with generalised forces; the states of elements are the velocities of the last m
    coordinates, of unit mass. Where a track runs with the wheelsets, its coordinates (7 w), of unit mass too, follow.

    `start`: distance of the reference body at time 0. memory (b,): last distance of each body (start of the
    projection). work: of `workspace.absolute_workspace`.
    """
    bodies, w = plant.core.body_mass.shape[0], plant.core.radius.shape[0]
    reference = plant.core.driver_body
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
        elements(plant, t, q, v, work, out)
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
    """Distance and speed of what is held together along the track, as means over the masses: holding forces towards
    them add up to nothing.
    """
    total, distance, speed = 0.0, 0.0, 0.0
    for b in range(plant.core.body_mass.shape[0]):
        if plant.core.coordinate[b, 0] >= 0:
            continue
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
def _hold(plant, b, target, velocity, acceleration, q, work, out):
    """What is not free: movements and rotations; static vertical load."""
    f, motion = work[b, BODY_FRAME], work[b, BODY_MOTION]
    index = plant.core.coordinate[b]
    mass, inertia = plant.core.body_mass[b], plant.core.inertia[b]
    own, mine = q[6 * b : 6 * b + 6], out[6 * b : 6 * b + 6]
    lag = target + plant.core.position[b, 0] - f[15]
    along = mass * (acceleration + HOLD * (HOLD * lag + 2.0 * (velocity - motion[12]))) if index[0] < 0 else 0.0
    f_y, m_x, m_y, m_z = 0.0, 0.0, 0.0, 0.0
    if index[1] < 0:
        f_y = mass * (GRAVITY * f[7] + HOLD * (HOLD * (plant.core.position[b, 1] - motion[1]) - 2.0 * motion[7]))
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
    add_wrench(f, own, along, f_y, f_z, m_x, m_y, m_z, mine)


@kernel
def wheelset_motion(plant, i, work, local):
    """Fill local (8,) as `wheels.wheelset_local` does."""
    motion = work[plant.core.wheelset_body[i], BODY_MOTION]
    local[0], local[1], local[2], local[3] = motion[1], motion[2] - plant.core.radius[i], motion[3], motion[5]
    local[4], local[5], local[6], local[7] = motion[7], motion[8], motion[9], motion[11]


@inlined
def absolute_track(plant, i, q, v):
    """Coordinates of the track under wheelset i (7,) and their rates among all coordinates and velocities."""
    at = 6 * plant.core.body_mass.shape[0] + plant.core.radius.shape[0] + plant.core.states + COORDINATES * i
    return q[at : at + COORDINATES], v[at : at + COORDINATES]


@kernel
def on_both_rails(plant, i, q, v, work):
    """Place wheelset i, whose coordinates `wheelset_motion` has filled, on the left and the right rail of the track
    below it.
    """
    local, right = work[work.shape[0] - 1, WHEELSET], work[work.shape[0] - 1, ON_RIGHT]
    track, moving = absolute_track(plant, i, q, v)
    on_rail(plant, 1, track, moving, local, right)
    on_rail(plant, 0, track, moving, local, local)


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
    right_local = local
    if moving_track(plant):
        right_local = work[work.shape[0] - 1, ON_RIGHT]
        on_both_rails(plant, i, q, v, work)
    left = forces_of_wheel(plant, i, 0, f[15], speed, spin, angle, local)
    right = forces_of_wheel(plant, i, 1, f[15], speed, spin, angle, right_local)
    if moving_track(plant):
        track, moving = absolute_track(plant, i, q, v)
        track_rates(
            plant, f[15], track, moving, absolute_track(plant, i, out, out)[0],
            -left.force_y, -left.force_z, -right.force_y, -right.force_z,
        )  # fmt: skip
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
    carried = plant.core.frame_body[i]
    if plant.core.moves_along and carried >= 0:  # what drives or brakes it stands on its bogie
        bogie, theirs = q[6 * carried : 6 * carried + 6], out[6 * carried : 6 * carried + 6]
        add_wrench(work[carried, BODY_FRAME], bogie, 0.0, 0.0, 0.0, 0.0, -torque, 0.0, theirs)
    out[6 * bodies + i] = left.moment_spin + right.moment_spin + torque + added
    momentum = plant.core.spin_inertia[i] * spin
    w_x, w_y, w_z = angular_velocity(own, v[6 * b : 6 * b + 6])
    matrix = work[b, BODY_ROTATION]
    h_x, h_y, h_z = momentum * matrix[1], momentum * matrix[4], momentum * matrix[7]
    add_moment(own, h_y * w_z - h_z * w_y, h_z * w_x - h_x * w_z, h_x * w_y - h_y * w_x, mine)
    return along, torque
