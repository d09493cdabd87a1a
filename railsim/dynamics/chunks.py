"""Rows of truth of a fixed-step loop over the compiled right-hand side, chunk by chunk."""

from collections.abc import Iterator

import numpy as np

from railsim.dynamics.channels import WHEEL, channel_names
from railsim.dynamics.equilibrium import initial_state
from railsim.dynamics.guard import check_rows
from railsim.dynamics.integrate import Scheme
from railsim.dynamics.plant import Plant, check_reach
from railsim.dynamics.stability import check_start
from railsim.dynamics.workspace import workspace
from railsim.engines.interface import CHUNK, Run


def rows_of(run: Run, plant: Plant, scheme: Scheme, steps: int) -> Iterator[np.ndarray]:
    """A run by one of the schemes of `integrate`, which takes so many steps a row; see `interface.Engine`.

    Raises
    ------
    Diverged : a state is not finite or a wheel left its rail; names time, place and body.
    InputError : the track is curved, and a body stands too far from the reference body.
    """
    check_reach(plant, run.model)
    names = channel_names(run.model)
    step = 1.0 / (run.rate * steps)
    x = initial_state(plant, run)
    plant.core.implicit[:] = scheme.implicit(step)
    check_start(plant, run, x, step, scheme.settling)
    wheels = np.empty((2 * len(run.model.wheelsets), len(WHEEL) * run.model.contact.contacts))
    scratch = np.zeros((scheme.stages, len(x))), np.empty(len(x)), wheels, workspace(int(plant.core.joints))
    for first in range(0, run.rows, CHUNK):
        rows = np.zeros((min(CHUNK, run.rows - first), len(names)))
        finite = scheme.loop(plant, x, first, len(rows), steps, run.rate, rows, *scratch)
        check_rows(rows, finite, names, run)
        yield rows
