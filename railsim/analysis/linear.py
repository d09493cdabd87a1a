"""Linearised equations of a vehicle about its steady state at constant speed: M q'' + C q' + K q = F z, where z are
the states of elements that have their own, dz/dt = D_q q + D_v q' + D_z z.

The matrices hold everything that the compiled right-hand side does: suspension, geometric stiffness of preloads,
Hertzian contact with gravitational stiffness, creep forces and the wheels' gyroscopic moments.

Polach's creep law is homogeneous but not differentiable at vanishing creepage: its slope there depends on the
direction of the creepage, between C11 and C22. The matrices hold the slopes of the pure directions.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import root_scalar

from railsim.dynamics.equilibrium import state_size, steady_state
from railsim.dynamics.kernel import derivatives
from railsim.dynamics.plant import Plant, build_plant, check_reach
from railsim.dynamics.workspace import NO_WHEELS, workspace
from railsim.errors import InputError
from railsim.model import Model
from railsim.speed import FASTEST, Constant, speed_tables
from railsim.track.kernel import TrackTables, build_tables
from railsim.track.track import Track

LENGTH, ANGLE, CREEPAGE = 1e-6, 1e-6, 1e-6  # m, rad, -: steps of the central differences
SPEEDS_TRIED = 40  # of the search for a critical speed


@dataclass(frozen=True)
class Linearised:
    """M q'' + C q' + K q = F z, dz/dt = D_q q + D_v q' + D_z z, about a steady state.

    Attributes
    ----------
    mass, damping, stiffness : (n, n) over `names`, SI; not symmetric where contacts and spinning wheels take part.
    names : free coordinates of the model, then the spin angle of each wheelset.
    state_forces : (n, m) F, of the m states of elements.
    state_rates : (m, 2 n + m) D_q, D_v and D_z, side by side.
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    names: tuple[str, ...]
    state_forces: np.ndarray
    state_rates: np.ndarray

    def state_matrix(self) -> np.ndarray:
        """A of dx/dt = A x, x = [coordinates that carry stiffness, all rates, states of elements]; a wheel's spin angle
        acts on nothing.
        """
        n, states = self.state_forces.shape
        held = np.flatnonzero(self.stiffness.any(axis=0))
        inverse = np.linalg.inv(self.mass)
        identity = np.eye(n)[held]
        upper = np.hstack((np.zeros((len(held),) * 2), identity, np.zeros((len(held), states))))
        middle = np.hstack((-inverse @ self.stiffness[:, held], -inverse @ self.damping, inverse @ self.state_forces))
        return np.vstack((upper, middle, self.state_rates[:, np.concatenate((held, np.arange(n, 2 * n + states)))]))

    def eigenvalues(self) -> np.ndarray:
        """Eigenvalues of the first-order form [1/s], the least damped first."""
        return eigenvalues(self.state_matrix())


def eigenvalues(state_matrix: np.ndarray) -> np.ndarray:
    """Eigenvalues [1/s], the least damped first; of a conjugate pair the one with positive frequency first."""
    values = np.linalg.eigvals(state_matrix)
    return values[np.lexsort((-values.imag, -values.real.round(9)))]


def linearise(model: Model, speed: float, track: Track | None = None, at: float = 0.0) -> Linearised:
    """Equations of small motion about the steady state.

    Parameters
    ----------
    speed : V [m/s], constant.
    track : where the vehicle runs; None is straight, level and smooth. Geometry and irregularities must be constant
        around `at` [m], the distance of the reference body, for the matrices to mean anything.

    Raises
    ------
    InputError : there is no steady state, the speed is not positive, or a body stands too far from the reference body
        on a track that is not straight and level.
    """
    tables = build_tables(straight() if track is None else track)
    return _linearised(model, speed, tables, at)


def critical_speed(model: Model, low: float, high: float, track: Track | None = None, at: float = 0.0) -> float | None:
    """Lowest speed [m/s] between `low` and `high` above which a motion grows; None where none does.

    Raises
    ------
    InputError : a motion grows at `low` already; or `high` is faster than any run may be.
    """
    if high > FASTEST:
        raise InputError(f"critical speed: search up to {FASTEST:g} m/s at most, not {high:g}")
    tables = build_tables(straight() if track is None else track)

    def growth(speed: float) -> float:
        return float(_linearised(model, speed, tables, at).eigenvalues()[0].real)

    if growth(low) > 0.0:
        raise InputError(f"critical speed: a motion grows at {low:g} m/s already; start the search lower")
    below = low
    for speed in np.geomspace(low, high, SPEEDS_TRIED)[1:]:
        if growth(float(speed)) > 0.0:
            return float(root_scalar(growth, bracket=(below, float(speed)), xtol=1e-6).root)
        below = float(speed)
    return None


def straight(length: float = 100.0) -> Track:
    """Straight, level, smooth track around distance 0, `length` [m] to each side."""
    s = np.linspace(-length, length, 5)
    return Track(s, {"vertical": np.zeros(s.size)}, "straight")


def _linearised(model: Model, speed: float, tables: TrackTables, at: float) -> Linearised:
    wheelsets = len(model.wheelsets)
    plant = build_plant(model, tables, speed_tables(Constant(speed=speed), (), wheelsets, 1.0))
    check_reach(plant, model)
    x = steady_state(plant, at)
    n, w = len(plant.core.mass), wheelsets
    positions = [*range(n), *range(2 * n, 2 * n + w)]
    rates = [*range(n, 2 * n), *range(2 * n + w, 2 * n + 2 * w)]
    steps = np.array([ANGLE if i % 6 > 2 else LENGTH for i in model.free])
    spins = CREEPAGE * speed / plant.core.radius
    by_position = _jacobian(plant, x, positions[:n], steps)
    by_rate = _jacobian(plant, x, rates, np.concatenate((steps * speed, spins)))
    mass = np.concatenate((plant.core.mass, plant.core.spin_inertia))
    stiffness = np.hstack((-mass[:, None] * by_position[rates], np.zeros((n + w, w))))
    names = (*model.names, *(f"{wheelset.body}.spin" for wheelset in model.wheelsets))
    states = list(range(2 * n + 2 * w + 2, len(x)))
    by_state = _jacobian(plant, x, states, np.full(len(states), LENGTH))
    none = np.zeros((len(states), w))
    state_rates = np.hstack((by_position[states], none, by_rate[states], by_state[states]))
    return Linearised(
        np.diag(mass), -mass[:, None] * by_rate[rates], stiffness, names, mass[:, None] * by_state[rates], state_rates
    )


def _jacobian(plant: Plant, x: np.ndarray, columns: list[int], steps: np.ndarray) -> np.ndarray:
    """d(dx/dt)/dx of some columns, by central differences of fourth order."""

    def rate(column: int, step: float) -> np.ndarray:
        moved = x.copy()
        moved[column] += step
        out = np.empty(state_size(plant))
        derivatives(plant, 0.0, moved, out, workspace(int(plant.core.joints)), NO_WHEELS)
        return out

    if not columns:
        return np.zeros((state_size(plant), 0))
    return np.column_stack(
        [
            (8.0 * (rate(c, h) - rate(c, -h)) - (rate(c, 2.0 * h) - rate(c, -2.0 * h))) / (12.0 * h)
            for c, h in zip(columns, steps, strict=True)
        ]
    )
