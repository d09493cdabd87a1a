"""The track that runs with each wheelset (compiled): two rails on pads, sleepers on ballast; see
`railsim.track.flexible`.

Its displacements count from the track without load; rails are then higher by the deflection under the mean static
wheel load than where they were surveyed, and so they carry each wheel where the survey has them. A rail that moves
under a wheel is, for the contact, a wheelset that moves the other way: `on_rail` gives a wheel the wheelset's
coordinates relative to its own rail.

The contact's own stiffness and the creep forces move the light rails faster than the steps of a run would follow. Where
they do, `settle_contacts` takes both linearly implicit (Hairer and Wanner 1996, section IV.7): the acceleration with
which wheel and rail approach, and the one with which they slide, meet an inertia of step^2 times stiffness, or step
times damping. It vanishes with the step, and where the wheel follows its rail and rolls without sliding faster. Of the
sliding it meets only what is faster than a few steps: a state for each wheel follows the rest.
"""

import math

from railsim.branches import may, where
from railsim.compiled import inlined, kernel
from railsim.contact.elementary import cube_root
from railsim.contact.wheel import CREEP, DAMPING, SLOWEST
from railsim.dynamics.extras import roundness_second
from railsim.track.flexible import CoRunning
from railsim.track.kernel import COMPLIANCE, LEFT_LATERAL, LEFT_VERTICAL, locate, second, slope, value

NUMBERS = len(CoRunning._fields)
(
    RAIL_MASS_Z, RAIL_MASS_Y, SLEEPER_MASS_Z, SLEEPER_MASS_Y, SLEEPER_INERTIA,
    PAD_STIFFNESS_Z, PAD_DAMPING_Z, PAD_STIFFNESS_Y, PAD_DAMPING_Y,
    BALLAST_DAMPING_Z, BALLAST_STIFFNESS_Y, BALLAST_DAMPING_Y,
    SEAT, BED, HEIGHT, SOFTNESS, VARIATION, SPACING, FIRST,
) = range(NUMBERS)  # fmt: skip
DEFLECTION, STATED, CREEP_SLOPE, VOIDS, FIRST_VOID = range(NUMBERS, NUMBERS + 5)
"""Behind the numbers of `CoRunning`: mean static deflection [m]; whether the track states its compliance; slope of the
lateral creep force under 1 N at 1 m/s; number of voids; then place, length and gap of each."""
VOID = 3

LEFT_Z, LEFT_Y, RIGHT_Z, RIGHT_Y, SLEEPER_Z, SLEEPER_Y, SLEEPER_ROLL = range(7)
COORDINATES = 7  # of the track under a wheelset
LAGS = 2  # states of a wheelset behind the rates of all coordinates: slow part of its wheels' sliding accelerations
LAG = 4.0  # time constant of these over that of the implicit sliding: the pair is critically damped
BY_WHEELSET, BY_RAIL, STIFF, GIVEN, SOFT = 0, 12, 20, 24, 28
"""In the scratch of `settle_contacts`, for the normal and the lateral direction of the left, then the right wheel: how
the wheelset's y, z, roll and the rail's z, y enter; the added inertia; the acceleration that rails which do not give
would ask for; then four rows of equations."""
SETTLING = SOFT + 4 * 5


@inlined
def moving_track(plant):
    """Whether a track runs with the wheelsets; a constant of the compiled kernel."""
    return plant.core.corunning.shape[0] > 1


@inlined
def track_place(plant):
    """Where the track's coordinates begin in the state; their rates follow them."""
    n, w = plant.core.mass.shape[0], plant.core.radius.shape[0]
    return 2 * (n + w) + 2 + plant.core.states


@inlined
def track_below(plant, i, x):
    """Coordinates of the track under wheelset i (7,), and their rates, in a state or its derivative."""
    at = track_place(plant) + COORDINATES * i
    rates = at + COORDINATES * plant.core.radius.shape[0]
    return x[at : at + COORDINATES], x[rates : rates + COORDINATES]


@inlined
def on_rail(plant, side, track, moving, local, own):
    """Fill own (8,) with the coordinates `local` of a wheelset relative to the rail on one side of the track below it,
    whose coordinates (7,) and rates (7,) are given.
    """
    for k in range(8):
        own[k] = local[k]
    own[0] -= track[2 * side + LEFT_Y]
    own[1] -= track[2 * side + LEFT_Z] + plant.core.corunning[DEFLECTION]
    own[4] -= moving[2 * side + LEFT_Y]
    own[5] -= moving[2 * side + LEFT_Z]


@inlined
def wheelset_distance(plant, i, s, q):
    """Distance of wheelset i of a vehicle at s [m]."""
    body = plant.core.wheelset_body[i]
    along = plant.core.coordinate[body, 0]
    return s + plant.core.position[body, 0] + (q[along] if along >= 0 else 0.0)


@inlined
def support_stiffness(plant, s):
    """Stiffness of each rail under a static vertical force at distance s, the wheel's [N/m]."""
    p = plant.core.corunning
    softness = p[SOFTNESS]
    if p[STATED] != 0.0:
        cell, x = locate(plant.core.s0, plant.core.ds, plant.core.cells, s)
        softness = value(plant.track, cell, COMPLIANCE, x)
    wave = p[VARIATION] * math.cos(2.0 * math.pi * (s - p[FIRST]) / p[SPACING])
    return (1.0 + wave) / softness


@inlined
def ballast_stiffness(plant, s):
    """Stiffness of the ballast under each half of the sleepers at distance s [N/m]: what the pads leave."""
    return 1.0 / (1.0 / support_stiffness(plant, s) - 1.0 / plant.core.corunning[PAD_STIFFNESS_Z])


@inlined
def void_gap(plant, s):
    """Gap below the sleepers at distance s [m]."""
    p = plant.core.corunning
    gap = 0.0
    for k in range(int(p[VOIDS])):
        at = FIRST_VOID + VOID * k
        x = (s - p[at]) / p[at + 1]
        gap += where(abs(x) < 0.5, p[at + 2] * (0.5 + 0.5 * math.cos(2.0 * math.pi * x)), 0.0)
    return gap


@inlined
def ballast_force(plant, stiffness, gap, sunk, rate):
    """Upward force of the ballast under half of the sleepers [N]: of a spring and a damper; over a gap it begins where
    the gap is closed, and does not pull.
    """
    force = stiffness * (sunk - gap) + plant.core.corunning[BALLAST_DAMPING_Z] * rate
    return where((gap > 0.0) & ((sunk < gap) | (force < 0.0)), 0.0, force)


@inlined
def track_rates(plant, s, track, moving, out, left_y, left_z, right_y, right_z):
    """Fill out (7,) with the accelerations of a track at distance s, with these coordinates (7,) and rates (7,), on
    whose rails the wheels press with these forces [N].
    """
    p = plant.core.corunning
    ballast, gap = ballast_stiffness(plant, s), void_gap(plant, s)
    roll, rolling, z, z_rate = track[SLEEPER_ROLL], moving[SLEEPER_ROLL], track[SLEEPER_Z], moving[SLEEPER_Z]
    y, y_rate = track[SLEEPER_Y] - p[HEIGHT] * roll, moving[SLEEPER_Y] - p[HEIGHT] * rolling
    lift, push, moment = 0.0, 0.0, 0.0
    for side in range(2):
        own, sign = 2 * side, 1.0 - 2.0 * side
        press_y, press_z = (left_y, left_z) if side == 0 else (right_y, right_z)
        pad_z = p[PAD_STIFFNESS_Z] * (track[own + LEFT_Z] - z - sign * p[SEAT] * roll) + p[PAD_DAMPING_Z] * (
            moving[own + LEFT_Z] - z_rate - sign * p[SEAT] * rolling
        )
        pad_y = p[PAD_STIFFNESS_Y] * (track[own + LEFT_Y] - y) + p[PAD_DAMPING_Y] * (moving[own + LEFT_Y] - y_rate)
        out[own + LEFT_Z] = (press_z - pad_z) / p[RAIL_MASS_Z]
        out[own + LEFT_Y] = (press_y - pad_y) / p[RAIL_MASS_Y]
        arm = sign * p[BED]
        bed = ballast_force(plant, ballast, gap, -z - arm * roll, -z_rate - arm * rolling)
        lift += pad_z + bed
        push += pad_y
        moment += sign * p[SEAT] * pad_z - p[HEIGHT] * pad_y + arm * bed
    held = p[BALLAST_STIFFNESS_Y] * track[SLEEPER_Y] + p[BALLAST_DAMPING_Y] * moving[SLEEPER_Y]
    out[SLEEPER_Z] = lift / p[SLEEPER_MASS_Z]
    out[SLEEPER_Y] = (push - held) / p[SLEEPER_MASS_Y]
    out[SLEEPER_ROLL] = moment / p[SLEEPER_INERTIA]


@kernel
def track_energy(plant, s, track, moving):
    """Kinetic energy and that of the springs of a track at distance s [J]; arguments of `track_rates`."""
    p = plant.core.corunning
    ballast, gap, roll = ballast_stiffness(plant, s), void_gap(plant, s), track[SLEEPER_ROLL]
    kinetic = p[SLEEPER_MASS_Z] * moving[SLEEPER_Z] ** 2 + p[SLEEPER_MASS_Y] * moving[SLEEPER_Y] ** 2
    kinetic += p[SLEEPER_INERTIA] * moving[SLEEPER_ROLL] ** 2
    pressed = p[BALLAST_STIFFNESS_Y] * track[SLEEPER_Y] ** 2
    for side in range(2):
        own, sign = 2 * side, 1.0 - 2.0 * side
        kinetic += p[RAIL_MASS_Z] * moving[own + LEFT_Z] ** 2 + p[RAIL_MASS_Y] * moving[own + LEFT_Y] ** 2
        pad_z = track[own + LEFT_Z] - track[SLEEPER_Z] - sign * p[SEAT] * roll
        pad_y = track[own + LEFT_Y] - track[SLEEPER_Y] + p[HEIGHT] * roll
        sunk = -track[SLEEPER_Z] - sign * p[BED] * roll - gap
        if gap > 0.0:
            sunk = max(sunk, 0.0)
        pressed += p[PAD_STIFFNESS_Z] * pad_z**2 + p[PAD_STIFFNESS_Y] * pad_y**2 + ballast * sunk**2
    return 0.5 * kinetic, 0.5 * pressed


@inlined
def keep_yaw_rate(plant, i, yaw_rate, out):
    """Keep the yaw rate of wheelset i relative to the track, as `keep_contacts`."""
    out[track_place(plant) + COORDINATES * i + 4] = yaw_rate


@inlined
def keep_contacts(plant, i, left, right, out):
    """Keep what `settle_contacts` must know of the wheels of wheelset i, in the places of the track's velocities."""
    at = track_place(plant) + COORDINATES * i
    out[at], out[at + 1], out[at + 2], out[at + 3] = left.normal, left.tangent, right.normal, right.tangent


@inlined
def settle_contacts(plant, s, velocity, acceleration, x, force, out, work):
    """Take the contacts linearly implicit, where the step asks for it: change `force` on the wheelsets and the rails'
    accelerations. work (SETTLING,) is scratch.
    """
    w = plant.core.radius.shape[0]
    lags = track_place(plant) + 2 * COORDINATES * w
    for i in range(w):
        for side in range(2):
            out[lags + LAGS * i + side] = 0.0
        if plant.core.implicit[0] == 0.0:
            continue
        work[SOFT + 9] = work[SOFT + 19] = 0.0
        stiff = _stiff(plant, i, velocity, out, work)
        if may(stiff):
            _given(plant, i, wheelset_distance(plant, i, s, x), velocity, acceleration, x, out, work)
            for side in range(2):
                work[GIVEN + 2 * side + 1] -= x[lags + LAGS * i + side]
            _settle(plant, i, force, out, work)
        for side in range(2):  # what the implicit sliding still meets is the difference
            out[lags + LAGS * i + side] = where(stiff, work[SOFT + 10 * side + 9], 0.0) / (LAG * plant.core.implicit[1])


@inlined
def _stiff(plant, i, velocity, out, work):
    """Fill directions and added inertias of the contacts of wheelset i; whether there are any of the latter."""
    p = plant.core.corunning
    at = track_place(plant) + COORDINATES * i
    mobility = plant.core.mobility[i]
    speed = max(abs(velocity), SLOWEST)
    any_stiff = False
    for side in range(2):
        normal, tangent, sign = out[at + 2 * side], out[at + 2 * side + 1], 1.0 - 2.0 * side
        cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
        sine, radius, arm = tangent * cosine, plant.core.radius[i], sign * p[SEAT]
        root, hertz, row = cube_root(normal), cube_root(plant.core.contact_stiffness[side]), 2 * side
        spring, damper = 1.5 * hertz * hertz * root, plant.core.law[DAMPING] * normal
        creep = p[CREEP_SLOPE] * root * root / speed if plant.core.law[CREEP] != 0.0 else 0.0
        _direction(work, row, sine, -cosine, radius * sine - arm * cosine)
        _direction(work, row + 1, cosine, sine, radius * cosine + arm * sine)
        wanted = max(plant.core.implicit[0] * spring, plant.core.implicit[1] * damper)
        work[STIFF + row] = max(wanted - 1.0 / _mobility(mobility, row, row, work), 0.0)
        wanted = plant.core.implicit[1] * creep
        work[STIFF + row + 1] = max(wanted - 1.0 / _mobility(mobility, row + 1, row + 1, work), 0.0)
        any_stiff = any_stiff | (work[STIFF + row] > 0.0) | (work[STIFF + row + 1] > 0.0)
    return any_stiff


@inlined
def _given(plant, i, s, velocity, acceleration, x, out, work):
    """Fill the accelerations in the contacts of wheelset i that come of the rails' shape, the wheels' radii and the
    yaw: a rolling wheel goes where it points.
    """
    c, square = plant.track, velocity * velocity
    yaw_rate = out[track_place(plant) + COORDINATES * i + 4]
    cell, at = locate(plant.core.s0, plant.core.ds, plant.core.cells, s)
    for side in range(2):
        y, z, row = LEFT_LATERAL + side, LEFT_VERTICAL + side, 2 * side
        across = square * second(c, cell, y, at) + acceleration * slope(c, cell, y, at)
        upward = square * second(c, cell, z, at) + acceleration * slope(c, cell, z, at)
        if plant.core.round_points > 0:
            n, w = plant.core.mass.shape[0], plant.core.radius.shape[0]
            spin = x[2 * n + w + i]
            upward += spin * spin * roundness_second(plant, i, side, x[2 * n + i])
        work[GIVEN + row] = work[BY_RAIL + 2 * row] * upward + work[BY_RAIL + 2 * row + 1] * across
        work[GIVEN + row + 1] = work[BY_RAIL + 2 * row + 3] * velocity * yaw_rate


@inlined
def _direction(work, row, by_y, by_z, by_roll):
    """Movement of a wheel relative to its rail, by the wheelset's y, z and roll; the rail's z and y count against."""
    work[BY_WHEELSET + 3 * row], work[BY_WHEELSET + 3 * row + 1] = by_y, by_z
    work[BY_WHEELSET + 3 * row + 2] = by_roll
    work[BY_RAIL + 2 * row], work[BY_RAIL + 2 * row + 1] = -by_z, -by_y


@inlined
def _mobility(mobility, row, column, work):
    """Acceleration in one direction under unit force in another [1/kg]."""
    total = 0.0
    for k in range(3):
        total += mobility[k] * work[BY_WHEELSET + 3 * row + k] * work[BY_WHEELSET + 3 * column + k]
    if row // 2 == column // 2:
        for k in range(2):
            total += mobility[3 + k] * work[BY_RAIL + 2 * row + k] * work[BY_RAIL + 2 * column + k]
    return total


@inlined
def _settle(plant, i, force, out, work):
    """Solve (1 + A D) r' = r for the accelerations r of the contacts, with A the mobilities and D the added inertias,
    and apply -D r'.
    """
    mobility, index = plant.core.mobility[i], plant.core.coordinate[plant.core.wheelset_body[i]]
    rates = track_place(plant) + COORDINATES * (i + plant.core.radius.shape[0])
    rows = work[SOFT:SETTLING]
    for a in range(4):
        total = work[GIVEN + a]
        for k in range(3):
            j = index[1 + k]
            if j >= 0:
                total += work[BY_WHEELSET + 3 * a + k] * force[j] * mobility[k]
        for k in range(2):
            total += work[BY_RAIL + 2 * a + k] * out[rates + 2 * (a // 2) + k]
        rows[5 * a + 4] = total
        for b in range(4):
            rows[5 * a + b] = _mobility(mobility, a, b, work) * work[STIFF + b]
        rows[5 * a + a] += 1.0
    _solve(rows)
    for a in range(4):
        applied = -work[STIFF + a] * rows[5 * a + 4]
        for k in range(3):
            j = index[1 + k]
            if j >= 0:
                force[j] += applied * work[BY_WHEELSET + 3 * a + k]
        for k in range(2):
            out[rates + 2 * (a // 2) + k] += applied * work[BY_RAIL + 2 * a + k] * mobility[3 + k]


@inlined
def _solve(rows):
    """Solve four equations, rows (20,) of coefficients and right-hand side, which is replaced; by elimination without
    pivots: the matrix is the unit matrix and a product of two that are not negative.
    """
    for a in range(4):
        inverse = 1.0 / rows[5 * a + a]
        for b in range(a + 1, 4):
            factor = rows[5 * b + a] * inverse
            for c in range(a + 1, 5):
                rows[5 * b + c] -= factor * rows[5 * a + c]
    for a in range(3, -1, -1):
        total = rows[5 * a + 4]
        for c in range(a + 1, 4):
            total -= rows[5 * a + c] * rows[5 * c + 4]
        rows[5 * a + 4] = total / rows[5 * a + a]


@inlined
def track_velocities(plant, x, out):
    """Fill the rates of the track's coordinates."""
    at, count = track_place(plant), COORDINATES * plant.core.radius.shape[0]
    for k in range(count):
        out[at + k] = x[at + count + k]


@kernel
def track_values(plant, s, track, row):
    """Fill row with what truth holds of a track at distance s: its coordinates (7,), the stiffness below each rail
    [N/m] and the gap below the sleepers [m].
    """
    for k in range(COORDINATES):
        row[k] = track[k]
    row[COORDINATES] = support_stiffness(plant, s)
    row[COORDINATES + 1] = void_gap(plant, s)
