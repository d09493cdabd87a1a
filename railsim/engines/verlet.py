"""The engine for very many runs: velocity Verlet with fixed step over the compiled right-hand side.

As many steps as `compiled` takes, and a quarter of its evaluations of the right-hand side; second order (how near to
the converged motion: docs/physics.md). Wheels that are not round are left to `compiled`: a flat lifts them, and to come
down on the rail as it does takes many more steps of second order. So are wheels with two contacts on rails that move.
"""

import math
from collections.abc import Iterator

import numpy as np

from railsim.dynamics.chunks import rows_of
from railsim.dynamics.integrate import RUNGE_KUTTA, VERLET
from railsim.dynamics.plant import build_plant
from railsim.engines.interface import LONGEST_STEP, Run, slowest_creep
from railsim.track.flexible import longest_step

STABLE = 0.9  # largest product of step and creep rate; the limit on the negative axis is 1
OSCILLATION = 1.05  # largest product of step and frequency of the track on its own; with its contacts 1.4 is too much


def integrate(run: Run) -> Iterator[np.ndarray]:
    """Rows of truth of a run, chunk by chunk; see `interface.Engine`.

    Raises
    ------
    Diverged : a state is not finite or a wheel left its rail; names time, place and body.
    """
    plant = build_plant(run.model, run.track, run.speed)
    if plant.core.round_points > 0 or (run.model.corunning is not None and run.model.contact.contacts > 1):
        yield from rows_of(run, plant, RUNGE_KUTTA, run.substeps)
        return
    stable = max(1.0 / LONGEST_STEP, slowest_creep(run.model, run.speed) / STABLE)
    if run.model.corunning is not None:
        stable = max(stable, 1.0 / longest_step(run.model.corunning, OSCILLATION, STABLE))
    steps = max(run.substeps, math.ceil(stable / run.rate - 1e-9))
    yield from rows_of(run, plant, VERLET, steps)
