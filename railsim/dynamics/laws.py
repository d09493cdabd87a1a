"""Nonlinear force laws: force against elongation and its rate, by law code (compiled)."""

import math

from railsim.branches import where
from railsim.compiled import kernel
from railsim.force_laws import BlowOff, BumpStop, Damper, DryFriction, Maxwell, Scheduled, SeriesDamper, Tabulated

BUMP_STOP, SCHEDULED, MAXWELL = BumpStop.code, Scheduled.code, Maxwell.code
FRICTION, BLOW_OFF, TABULATED = DryFriction.code, BlowOff.code, Tabulated.code
DAMPER, SERIES_DAMPER = Damper.code, SeriesDamper.code

# places of the laws' numbers in a row of parameters
STOP_GAP, STOP_STIFFNESS, STOP_CUBIC, STOP_MIDDLE = BumpStop.positions()
STIFFNESS, DAMPING, ONSET, RAMP, FORCE = Scheduled.positions()
SERIES_STIFFNESS, SERIES_DAMPING = Maxwell.positions()
FRICTION_FORCE, FRICTION_SLIP = DryFriction.positions()
DAMPING_BEFORE, DAMPING_BEYOND, BLOW_OFF_VELOCITY = BlowOff.positions()
DAMPER_DAMPING, DAMPER_BEYOND, DAMPER_VELOCITY = Damper.positions()
SPRING, *_ = SeriesDamper.positions()  # then as `Damper`
FIRST_ELONGATION, ELONGATION_STEP, FIRST_RATE, RATE_STEP, TABLE, TABLE_ROWS, TABLE_COLUMNS = Tabulated.positions()


@kernel
def element_force(plant, e, t, elongation, stretching, x, out):
    """Force of nonlinear element e in state x; the rate of its own state goes to `out`."""
    own = plant.core.element_state[e]
    at = 2 * plant.core.mass.shape[0] + 2 * plant.core.radius.shape[0] + 2 + own
    state = x[at] if own >= 0 else 0.0
    resisting, change = law_force(
        plant.core.law_code[e], plant.core.parameters[e], plant.tables, t, elongation, stretching, state
    )
    if own >= 0:
        out[at] = change
    return resisting


@kernel
def law_force(code, parameters, tables, t, elongation, rate, state):
    """Force that opposes `elongation` [m, rad] at time t [s], and the rate of the law's own state (0 where it has
    none); codes and parameters as in `railsim.force_laws`.
    """
    if code == BUMP_STOP:
        return bump_stop(parameters, elongation), 0.0
    if code == SCHEDULED:
        return scheduled(parameters, t, elongation, rate), 0.0
    if code == MAXWELL:
        return parameters[SERIES_STIFFNESS] * state, rate - parameters[SERIES_STIFFNESS] * state / parameters[
            SERIES_DAMPING
        ]
    if code == FRICTION:
        return parameters[FRICTION_FORCE] * math.tanh(rate / parameters[FRICTION_SLIP]), 0.0
    if code == BLOW_OFF:
        return blow_off(parameters, rate), 0.0
    if code == DAMPER:
        return damper(parameters, rate), 0.0
    if code == SERIES_DAMPER:
        force = parameters[SPRING] * state
        return force, rate - damper_velocity(parameters[SPRING + 1 :], force)
    if code == TABULATED:
        return tabulated(parameters, tables, elongation, rate), 0.0
    return 0.0, 0.0


@kernel
def bump_stop(parameters, elongation):
    """Force of `BumpStop`."""
    offset = elongation - parameters[STOP_MIDDLE]
    beyond = max(abs(offset) - parameters[STOP_GAP], 0.0)
    force = beyond * (parameters[STOP_STIFFNESS] + parameters[STOP_CUBIC] * beyond * beyond)
    return where(offset > 0.0, force, -force)


@kernel
def scheduled(parameters, t, elongation, rate):
    """Force of `Scheduled`."""
    since, later = max(t - parameters[ONSET], 0.0), parameters[ONSET] > 0.0
    share = where(later & (since < parameters[RAMP]), since / parameters[RAMP], 1.0)
    share = where(later & (since <= 0.0), 0.0, share)
    return share * (parameters[STIFFNESS] * elongation + parameters[DAMPING] * rate + parameters[FORCE])


@kernel
def blow_off(parameters, rate):
    """Force of `BlowOff`."""
    beyond = max(abs(rate) - parameters[BLOW_OFF_VELOCITY], 0.0)
    less = (parameters[DAMPING_BEYOND] - parameters[DAMPING_BEFORE]) * beyond
    return where(rate > 0.0, less, -less)


@kernel
def damper(parameters, rate):
    """Force of `Damper`."""
    within = min(abs(rate), parameters[DAMPER_VELOCITY])
    force = parameters[DAMPER_DAMPING] * within + parameters[DAMPER_BEYOND] * (abs(rate) - within)
    return where(rate > 0.0, force, -force)


@kernel
def damper_velocity(parameters, force):
    """Velocity at which a `Damper` gives a force."""
    within = min(abs(force), parameters[DAMPER_DAMPING] * parameters[DAMPER_VELOCITY])
    velocity = within / parameters[DAMPER_DAMPING] + (abs(force) - within) / parameters[DAMPER_BEYOND]
    return where(force > 0.0, velocity, -velocity)


@kernel
def tabulated(parameters, tables, elongation, rate):
    """Force of `Tabulated`."""
    offset, rows, columns = int(parameters[TABLE]), int(parameters[TABLE_ROWS]), int(parameters[TABLE_COLUMNS])
    across = min(max((elongation - parameters[FIRST_ELONGATION]) / parameters[ELONGATION_STEP], 0.0), rows - 1.0)
    along = min(max((rate - parameters[FIRST_RATE]) / parameters[RATE_STEP], 0.0), columns - 1.0)
    i, j = min(int(across), rows - 2), min(int(along), columns - 2)
    x, y = across - i, along - j
    at = offset + i * columns + j
    low = tables[at] + y * (tables[at + 1] - tables[at])
    high = tables[at + columns] + y * (tables[at + columns + 1] - tables[at + columns])
    return low + x * (high - low)


@kernel
def bump_stop_energy(parameters, elongation):
    """Potential of `BumpStop` [J]."""
    beyond = max(abs(elongation - parameters[STOP_MIDDLE]) - parameters[STOP_GAP], 0.0)
    return beyond * beyond * (0.5 * parameters[STOP_STIFFNESS] + 0.25 * parameters[STOP_CUBIC] * beyond * beyond)
