"""The fast engine: classical Runge-Kutta with fixed step over the compiled right-hand side in the moving track
frame.
"""

from collections.abc import Callable, Iterator

import numpy as np

from railsim.dynamics.chunks import rows_of
from railsim.dynamics.equilibrium import initial_state
from railsim.dynamics.integrate import RUNGE_KUTTA
from railsim.dynamics.kernel import derivatives
from railsim.dynamics.plant import build_plant, check_reach
from railsim.dynamics.workspace import NO_WHEELS, workspace
from railsim.engines.interface import Run


def integrate(run: Run) -> Iterator[np.ndarray]:
    """Rows of truth of a run, chunk by chunk; see `interface.Engine`.

    Raises
    ------
    Diverged : a state is not finite or a wheel left its rail; names time, place and body.
    """
    yield from rows_of(run, build_plant(run.model, run.track, run.speed), RUNGE_KUTTA, run.substeps)


def right_hand_side(run: Run) -> tuple[Callable[[float, np.ndarray], np.ndarray], np.ndarray]:
    """dx/dt as a function of time [s] and state, and the state to start from, for any integrator.

    The state is that of `dynamics.kernel`: coordinates, their rates, spin angles, spins, distance, speed.
    """
    plant = build_plant(run.model, run.track, run.speed)
    check_reach(plant, run.model)
    start = initial_state(plant, run)
    scratch = workspace(int(plant.core.joints))

    def change(t: float, x: np.ndarray) -> np.ndarray:
        out = np.empty_like(x)
        derivatives(plant, t, x, out, scratch, NO_WHEELS)
        return out

    return change, start
