"""Nonlinear force laws: force against elongation and its rate, by law code (compiled)."""

import math

from railsim.compiled import kernel
from railsim.model import BLOW_OFF, BUMP_STOP, FRICTION, MAXWELL, SCHEDULED, TABLED


@kernel
def law_force(code, parameters, tables, t, elongation, rate, state):
    """Force that opposes `elongation` [m, rad] at time t [s], and the rate of the law's own state (0 where it has
    none); codes as in `railsim.model`.
    """
    if code == BUMP_STOP:
        return bump_stop(parameters, elongation), 0.0
    if code == SCHEDULED:
        return scheduled(parameters, t, elongation, rate), 0.0
    if code == MAXWELL:
        return parameters[0] * state, rate - parameters[0] * state / parameters[1]
    if code == FRICTION:
        return parameters[0] * math.tanh(rate / parameters[1]), 0.0
    if code == BLOW_OFF:
        return blow_off(parameters, rate), 0.0
    if code == TABLED:
        return tabled(parameters, tables, elongation, rate), 0.0
    return 0.0, 0.0


@kernel
def bump_stop(parameters, elongation):
    """Nothing inside the gap, then linear plus cubic: parameters gap [m], k1 [N/m], k3 [N/m3], place of the middle
    [m].
    """
    offset = elongation - parameters[3]
    beyond = abs(offset) - parameters[0]
    if beyond <= 0.0:
        return 0.0
    force = beyond * (parameters[1] + parameters[2] * beyond * beyond)
    return force if offset > 0.0 else -force


@kernel
def scheduled(parameters, t, elongation, rate):
    """Spring, damper and constant force that fade in: parameters k [N/m], c [N s/m], onset [s], ramp [s], force [N]; k
    and c are negative where they take away from a linear element beside them.
    """
    since = t - parameters[2]
    if since <= 0.0 and parameters[2] > 0.0:
        return 0.0
    share = since / parameters[3] if since < parameters[3] and parameters[2] > 0.0 else 1.0
    return share * (parameters[0] * elongation + parameters[1] * rate + parameters[4])


@kernel
def blow_off(parameters, rate):
    """What a damper gives less beyond its blow-off velocity: parameters c before [N s/m], c beyond [N s/m], velocity
    [m/s].
    """
    beyond = abs(rate) - parameters[2]
    if beyond <= 0.0:
        return 0.0
    less = (parameters[1] - parameters[0]) * beyond
    return less if rate > 0.0 else -less


@kernel
def tabled(parameters, tables, elongation, rate):
    """Bilinear in displacement and velocity, held beyond the edges: parameters place in `tables`, displacements,
    velocities (numbers of), first displacement [m] and step, first velocity [m/s] and step.
    """
    offset, rows, columns = int(parameters[0]), int(parameters[1]), int(parameters[2])
    across = min(max((elongation - parameters[3]) / parameters[4], 0.0), rows - 1.0)
    along = min(max((rate - parameters[5]) / parameters[6], 0.0), columns - 1.0)
    i, j = min(int(across), rows - 2), min(int(along), columns - 2)
    x, y = across - i, along - j
    at = offset + i * columns + j
    low = tables[at] + y * (tables[at + 1] - tables[at])
    high = tables[at + columns] + y * (tables[at + columns + 1] - tables[at + columns])
    return low + x * (high - low)


@kernel
def bump_stop_energy(parameters, elongation):
    """Potential of `bump_stop` [J]."""
    beyond = max(abs(elongation - parameters[3]) - parameters[0], 0.0)
    return beyond * beyond * (0.5 * parameters[1] + 0.25 * parameters[2] * beyond * beyond)
