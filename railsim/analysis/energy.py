"""Energy of a vehicle over a run of the compiled engine on straight track, seen from the frame that travels with it."""

import numpy as np

from railsim.compiled import kernel
from railsim.constants import GRAVITY
from railsim.dynamics.corunning import moving_track, on_rail, track_below, track_energy, wheelset_distance
from railsim.dynamics.elements import body_coordinates, cross, turned_arm
from railsim.dynamics.equilibrium import initial_state
from railsim.dynamics.extras import doubled
from railsim.dynamics.integrate import rk4_step
from railsim.dynamics.kernel import derivatives
from railsim.dynamics.laws import BUMP_STOP, bump_stop_energy
from railsim.dynamics.plant import Plant, build_plant
from railsim.dynamics.wheels import forces_of_wheel, second_of_wheel, wheelset_local
from railsim.dynamics.workspace import ELEMENT, LOCAL, NO_WHEELS, ON_TRACK, POSE, workspace
from railsim.engines.interface import Run

KINETIC, SPRINGS, CONTACTS, GRAVITATION = range(4)
KINDS = ("kinetic", "springs", "contacts", "gravity")


@kernel
def energies(plant, x, scratch, out):
    """Fill out (4,) with kinetic energy (spin included), that of springs and bump stops, of contacts, of weight [J].

    Rates are those relative to the travelling frame; springs count from their state without load, so that preloads and
    geometric stiffness are in it; a contact has 2/5 C p_n^2.5 = 2/5 N p_n, which holds without contact damping. A track
    that runs with the wheelsets counts with its masses and springs.
    """
    n, w = plant.core.mass.shape[0], plant.core.radius.shape[0]
    q, rate = x[:n], x[n : 2 * n]
    s, velocity = x[2 * n + 2 * w], x[2 * n + 2 * w + 1]
    here, local, work = scratch[POSE], scratch[LOCAL], scratch[ELEMENT]
    out[:] = 0.0
    for i in range(n):
        out[KINETIC] += 0.5 * plant.core.mass[i] * rate[i] * rate[i]
        total = 0.0
        for k in range(plant.core.link_start[i], plant.core.link_start[i + 1]):
            total += 0.5 * plant.core.link_stiffness[k] * q[plant.core.link[k]]
        out[SPRINGS] += q[i] * (total - plant.core.preload[i])
    for e in range(plant.core.elements):
        elongation = 0.0
        for i in range(n):
            elongation += plant.core.direction[e, i] * q[i]
        if plant.core.law_code[e] == BUMP_STOP:
            out[SPRINGS] += bump_stop_energy(plant.core.parameters[e], elongation)
    for e in range(plant.core.finite):
        out[SPRINGS] += _finite_energy(plant, e, s, velocity, q, rate, work)
    for b in range(plant.core.body_mass.shape[0]):
        z = plant.core.coordinate[b, 2]
        if z >= 0:
            out[GRAVITATION] += plant.core.body_mass[b] * GRAVITY * q[z]
    for i in range(w):
        spin = x[2 * n + w + i]
        out[KINETIC] += 0.5 * plant.core.spin_inertia[i] * spin * spin
        wheelset_local(plant, i, s, velocity, q, rate, here, local)
        distance = s + plant.core.position[plant.core.wheelset_body[i], 0]
        track, moving = track_below(plant, i, x)
        for side in range(2):
            if moving_track(plant):
                on_rail(plant, side, track, moving, local, scratch[ON_TRACK])
            placed = scratch[ON_TRACK] if moving_track(plant) else local
            normal = forces_of_wheel(plant, i, side, distance, velocity, spin, x[2 * n + i], placed).normal
            out[CONTACTS] += 0.4 * normal * (normal / plant.core.contact_stiffness[side]) ** (2.0 / 3.0)
            if doubled(plant):
                normal = second_of_wheel(plant, i, side, distance, velocity, spin, x[2 * n + i], placed).normal
                out[CONTACTS] += 0.4 * normal * (normal / plant.core.contact_stiffness[side + 2]) ** (2.0 / 3.0)
        if moving_track(plant):
            kinetic, pressed = track_energy(plant, wheelset_distance(plant, i, s, q), track, moving)
            out[KINETIC] += kinetic
            out[SPRINGS] += pressed


@kernel
def _finite_energy(plant, e, s, velocity, q, rate, work):
    """Energy of an element that is evaluated to second order, over the same elongations as its forces."""
    position_u, position_l, rates = work[0:6], work[6:12], work[12:18]
    moved_u, moved_l, spare, stretch = work[18:21], work[21:24], work[24:27], work[27:33]
    body_coordinates(plant, plant.core.finite_bodies[e, 0], s, velocity, q, rate, work[60:72], position_u, rates)
    body_coordinates(plant, plant.core.finite_bodies[e, 1], s, velocity, q, rate, work[60:72], position_l, rates)
    turned_arm(position_u[3:], plant.core.finite_arms[e, 0], spare, moved_u)
    turned_arm(position_l[3:], plant.core.finite_arms[e, 1], spare, moved_l)
    middle = work[33:36]
    for k in range(3):
        middle[k] = 0.5 * (position_u[3 + k] + position_l[3 + k])
        stretch[k] = position_u[k] + moved_u[k] - position_l[k] - moved_l[k]
        stretch[3 + k] = position_u[3 + k] - position_l[3 + k]
    cross(middle, stretch, spare)
    total = 0.0
    for k in range(3):
        stretch[k] -= spare[k]
        total -= plant.core.finite_preload[e, k] * stretch[k]
    for i in range(6):
        for j in range(6):
            total += 0.5 * stretch[i] * plant.core.finite_stiffness[e, i, j] * stretch[j]
    return total


def energy_over(run: Run) -> np.ndarray:
    """(rows, 4) energies [J] by `KINDS` at every row of a run of the compiled engine; straight track only."""
    plant = build_plant(run.model, run.track, run.speed)
    x = initial_state(plant, run)
    rows = np.zeros((run.rows, len(KINDS)))
    stages, trial, scratch = np.empty((4, len(x))), np.empty(len(x)), workspace(int(plant.core.joints))
    _march(plant, x, run.substeps, run.rate, rows, stages, trial, scratch, NO_WHEELS.copy())
    return rows


@kernel
def _march(plant: Plant, x, substeps, rate, rows, stages, trial, scratch, unseen):
    h = 1.0 / (rate * substeps)
    for k in range(rows.shape[0]):
        energies(plant, x, scratch, rows[k])
        for j in range(substeps):
            t = k / rate + j * h
            derivatives(plant, t, x, stages[0], scratch, unseen)
            rk4_step(plant, t, h, x, stages, trial, scratch, unseen)
