"""Whether a vehicle stands on its rails, and a run's steps can follow its fastest movement: known before the first
step.
"""

import numpy as np

from railsim.contact.wheel import DAMPING, SLOWEST
from railsim.dynamics.corunning import CREEP_SLOPE, RAIL_MASS_Y, RAIL_MASS_Z
from railsim.dynamics.differences import central_differences
from railsim.dynamics.plant import Plant
from railsim.dynamics.workspace import NO_WHEELS, workspace
from railsim.engines.interface import Run
from railsim.errors import InputError

RELATIVE = 1e-7  # step of the differences, relative to the size of a coordinate
SMALLEST = 1e-7  # m, rad, m/s, rad/s
REACH = 2.5  # product of step and rate; classical Runge-Kutta is stable up to 2.78 (real) and 2.83 (imaginary)
HOPELESS = 30.0  # the same product; a run of the validation report that ends well has 6.5 at its start
MOST_STEPS = 512  # a row; who needs more has no vehicle
OWN = 10.0  # times what bodies move: what a series spring must give way for the movement to be its own
FALLING = 0.2  # 1/s; a body that leaves its rest faster than this, and does not swing, falls


def check_start(plant: Plant, run: Run, x: np.ndarray, step: float, settling: float = REACH) -> None:
    """Refuse a vehicle that falls from its steady state, or moves so fast in it that the steps of the run would be
    unstable. One whose wheelsets hunt or slide may run.

    Parameters
    ----------
    x : state of the run at its start. step : of the integration [s]. settling : largest product of step and decay rate
    for which the integration of a linear state is stable.

    Raises
    ------
    InputError : names the movement, its rate and what it would need.
    """
    matrix = _jacobian(plant, x)
    names = run.model.names
    _check_standing(matrix, run)
    rates, shapes = np.linalg.eig(matrix)
    sizes = np.abs(shapes[: len(names)])
    _check_elements(plant, rates, shapes, run, step, settling)
    fastest = int(np.abs(rates).argmax())
    rate = float(np.abs(rates[fastest]))
    if rate * step <= HOPELESS:
        return
    moving = names[int(sizes[:, fastest].argmax())]
    needed = int(np.ceil(rate * step * run.substeps / REACH))
    cure = f"give 'substeps' of {needed} or more, or " if needed <= MOST_STEPS else ""
    raise InputError(
        f"vehicle: '{moving}' moves at {rate / (2.0 * np.pi):.3g} Hz where the vehicle stands on its rails, too fast "
        f"for steps of {1e3 * step:.3g} ms; {cure}check masses and stiffnesses around '{moving.split('.')[0]}'"
    )


def _check_elements(
    plant: Plant, rates: np.ndarray, shapes: np.ndarray, run: Run, step: float, settling: float
) -> None:
    """Refuse a spring in series with a damper that settles faster than the steps follow: its state is linear, so it
    grows without end, where a contact that is as fast slips or lifts off.
    """
    states = int(plant.core.states)
    if not states:
        return
    moved = np.abs(shapes[: len(run.model.names)]).max(axis=0)
    own = np.abs(shapes[-states:]).max(axis=0) > OWN * moved
    rate = float(np.abs(rates[own]).max(initial=0.0))
    if rate * step <= settling:
        return
    needed = int(np.ceil(rate / (settling * run.rate)))
    raise InputError(
        f"vehicle: a spring in series with a damper settles in {1e3 / rate:.2g} ms, too fast for steps of "
        f"{1e3 * step:.2g} ms; give 'substeps' of {needed} or more, or leave its stiffness out: it is rigid then"
    )


def rail_rate(plant: Plant, load: float) -> float:
    """Fastest rate [1/s] of a rail that moves, between what holds it and its contact with a wheel under `load` [N]."""
    p = plant.core.corunning
    spring = 1.5 * float(plant.core.contact_stiffness.max()) ** (2.0 / 3.0) * load ** (1.0 / 3.0)
    creep = p[CREEP_SLOPE] * load ** (2.0 / 3.0) / max(float(plant.knots[:, 1].min()), SLOWEST)
    damper = float(plant.core.law[DAMPING]) * load
    return max((spring / p[RAIL_MASS_Z]) ** 0.5, damper / p[RAIL_MASS_Z], creep / p[RAIL_MASS_Y])


def _check_standing(matrix: np.ndarray, run: Run) -> None:
    """Refuse what falls although its wheelsets are held: bodies that their springs do not hold against their weight."""
    names, own = run.model.names, {wheelset.body for wheelset in run.model.wheelsets}
    sprung = [i for i, name in enumerate(names) if name.split(".")[0] not in own]
    if not sprung:
        return
    squares, shapes = np.linalg.eig(matrix[np.ix_([len(names) + i for i in sprung], sprung)])
    growing = np.real(squares)
    worst = int(np.argmax(growing))
    if growing[worst] <= FALLING**2:
        return
    moving = names[sprung[int(np.abs(shapes[:, worst]).argmax())]]
    raise InputError(
        f"vehicle: it does not stand: '{moving}' falls, and goes e times as far every "
        f"{growing[worst] ** -0.5:.2g} s; check masses, heights and stiffnesses of '{moving.split('.')[0]}' and "
        "of what carries it"
    )


def _jacobian(plant: Plant, x: np.ndarray) -> np.ndarray:
    """Derivatives of the right-hand side by coordinates, rates, spins and states of elements, distance and speed as
    they are.
    """
    n, w = len(plant.core.mass), len(plant.core.radius)
    kept = np.r_[0 : 2 * n, 2 * n + w : 2 * n + 2 * w, 2 * n + 2 * w + 2 : len(x)]
    steps, columns = np.maximum(SMALLEST, RELATIVE * np.abs(x[kept])), np.empty((len(kept), len(x)))
    scratch = workspace(int(plant.core.joints))
    central_differences(plant, x.copy(), kept, steps, columns, np.empty((2, len(x))), scratch, NO_WHEELS)
    matrix = columns[:, kept].T
    return np.nan_to_num(matrix, posinf=np.finfo(float).max ** 0.25, neginf=-(np.finfo(float).max ** 0.25))
