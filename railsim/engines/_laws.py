"""Nonlinear force laws: force against elongation and its rate, by law code (compiled)."""

from railsim.compiled import kernel
from railsim.model import BUMP_STOP


@kernel
def law_force(code, parameters, elongation, rate):
    """Force that opposes `elongation` [m, rad]; codes and parameters as in `railsim.model`."""
    if code == BUMP_STOP:
        return bump_stop(parameters, elongation)
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
def bump_stop_energy(parameters, elongation):
    """Potential of `bump_stop` [J]."""
    beyond = max(abs(elongation) - parameters[0], 0.0)
    return beyond * beyond * (0.5 * parameters[1] + 0.25 * parameters[2] * beyond * beyond)
