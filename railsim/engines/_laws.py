"""Nonlinear force laws: force against elongation and its rate, by law code (compiled)."""

from railsim.compiled import kernel
from railsim.model import BUMP_STOP, SCHEDULED


@kernel
def law_force(code, parameters, t, elongation, rate):
    """Force that opposes `elongation` [m, rad] at time t [s]; codes and parameters as in `railsim.model`."""
    if code == BUMP_STOP:
        return bump_stop(parameters, elongation)
    if code == SCHEDULED:
        return scheduled(parameters, t, elongation, rate)
    return 0.0


@kernel
def bump_stop(parameters, elongation):
    """Nothing inside the gap, then linear plus cubic: parameters gap [m], k1 [N/m], k3 [N/m3]."""
    beyond = abs(elongation) - parameters[0]
    if beyond <= 0.0:
        return 0.0
    force = beyond * (parameters[1] + parameters[2] * beyond * beyond)
    return force if elongation > 0.0 else -force


@kernel
def scheduled(parameters, t, elongation, rate):
    """Spring and damper that fade in: parameters k [N/m], c [N s/m], onset [s], ramp [s]; negative where they take
    away from a linear element beside them.
    """
    since = t - parameters[2]
    if since <= 0.0:
        return 0.0
    share = since / parameters[3] if since < parameters[3] else 1.0
    return share * (parameters[0] * elongation + parameters[1] * rate)


@kernel
def bump_stop_energy(parameters, elongation):
    """Potential of `bump_stop` [J]."""
    beyond = max(abs(elongation) - parameters[0], 0.0)
    return beyond * beyond * (0.5 * parameters[1] + 0.25 * parameters[2] * beyond * beyond)
