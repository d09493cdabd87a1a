"""Steady state to start from: all accelerations zero at the first instant."""

from collections.abc import Callable, Iterator

import numpy as np
from scipy.optimize import root

from railsim.constants import GRAVITY
from railsim.dynamics.corunning import (
    COORDINATES,
    DEFLECTION,
    LAGS,
    LEFT_Z,
    PAD_STIFFNESS_Z,
    RIGHT_Z,
    SLEEPER_Z,
    support_stiffness,
    track_place,
    void_gap,
)
from railsim.dynamics.differences import central_differences
from railsim.dynamics.integrate import RUNGE_KUTTA
from railsim.dynamics.kernel import derivatives
from railsim.dynamics.plant import Plant
from railsim.dynamics.workspace import NO_WHEELS, workspace
from railsim.engines.interface import Run
from railsim.errors import InputError
from railsim.track.kernel import (
    LEFT_LATERAL,
    LEFT_VERTICAL,
    RIGHT_LATERAL,
    RIGHT_VERTICAL,
    TrackTables,
    sample,
)

GAUGE = 1.5  # m; distance of the contacts, for a first guess
LENGTH, ANGLE, SPIN = 1e-4, 1e-4, 1e-3  # m, rad, relative: scales of the unknowns
ACCURACY = 1e-9  # m/s2, rad/s2
ASIDE = (0.0, 2e-3, -2e-3, 5e-3, -5e-3)  # m, sideways starts: wheels of unlike radius, worn profiles
SEARCHES = {
    "hybr": {"xtol": 1e-14, "maxfev": 20000},
    "lm": {"xtol": 1e-14, "ftol": 1e-15, "maxiter": 20000},  # weak creep forces hardly hold the bodies' y and yaw
}
SETTLING_TIME, SETTLING_STEP = 6.0, 1.0 / 2048.0  # s; of the march to a start where no other leads to the steady state
RESTLESS = 1e-4  # m/s2, rad/s2; more is no steady state


def state_size(plant: Plant) -> int:
    """Length of the state vector."""
    own = track_coordinates(plant)
    return track_place(plant) + 2 * own + LAGS * (own // COORDINATES)


def track_coordinates(plant: Plant) -> int:
    """Number of coordinates of the tracks that run with the wheelsets."""
    return COORDINATES * len(plant.core.radius) if len(plant.core.corunning) > 1 else 0


def initial_state(plant: Plant, run: Run) -> np.ndarray:
    """The run's own initial state, or the steady one at its start.

    Raises
    ------
    InputError : the state does not fit the model, or no steady one was found.
    """
    if run.initial is None:
        return steady_state(plant, run.start)
    state = np.array(run.initial, dtype=float)
    if state.shape != (state_size(plant),) or not np.isfinite(state).all():
        raise InputError(
            f"initial state: give {state_size(plant)} finite numbers (got an array of shape {state.shape})"
        )
    return state


def steady_state(plant: Plant, start: float) -> np.ndarray:
    """State at `start` [m] without acceleration: on straight track the rest position, in a curve the steady one.

    Raises
    ------
    InputError : no such state was found (the vehicle cannot stand in this place at this speed).
    """
    n, w, own = len(plant.core.mass), len(plant.core.radius), track_coordinates(plant)
    size, track = state_size(plant), int(track_place(plant))
    speed, radius = plant.knots[0, 1], plant.core.radius.copy()
    vertical = plant.core.coordinate[:, 2]
    weight = float((plant.core.body_mass * (vertical >= 0)).sum()) * GRAVITY + float(plant.core.vertical_load.sum())
    load = weight / (2 * w)
    sunk = np.full(w, (load / plant.core.contact_stiffness[:2].mean()) ** (2.0 / 3.0))
    below = np.zeros(0)
    if own:
        below = _track_below(plant, start, load)
        sunk -= below.reshape(w, COORDINATES)[:, LEFT_Z] + plant.core.corunning[DEFLECTION]
    scale = np.full(n + w, LENGTH)
    for axes in plant.core.coordinate:
        scale[axes[3:][axes[3:] >= 0]] = ANGLE
    guess = np.concatenate((_on_rails(plant, start, sunk) / scale[:n], np.zeros(w), below / LENGTH))
    scale[n:] = SPIN * speed / radius
    out, scratch = np.empty(size), workspace(int(plant.core.joints))

    def state(unknown: np.ndarray) -> np.ndarray:
        x = np.zeros(size)
        x[:n] = unknown[:n] * scale[:n]
        x[2 * n + w : 2 * n + 2 * w] = speed / radius + unknown[n : n + w] * scale[n:]
        x[2 * n + 2 * w : 2 * n + 2 * w + 2] = start, speed
        x[track : track + own] = unknown[n + w :] * LENGTH
        return x

    places = np.r_[0:n, 2 * n + w : 2 * n + 2 * w, track : track + own]
    balanced = np.r_[n : 2 * n, 2 * n + w : 2 * n + 2 * w, track + own : track + 2 * own]
    scales = np.concatenate((scale, np.full(own, LENGTH)))
    columns, changes = np.empty((len(places), size)), np.empty((2, size))

    def residual(unknown: np.ndarray) -> np.ndarray:
        derivatives(plant, 0.0, state(unknown), out, scratch, NO_WHEELS)
        return out[balanced]

    def jacobian(unknown: np.ndarray) -> np.ndarray:
        central_differences(plant, state(unknown), places, 1e-4 * scales, columns, changes, scratch, NO_WHEELS)
        return columns[:, balanced].T * scales

    def restlessness(unknown: np.ndarray) -> float:
        return float(np.nan_to_num(np.abs(residual(unknown)).max(), nan=np.inf))

    def frozen(x: np.ndarray) -> np.ndarray:
        derivatives(plant, 0.0, x, out, scratch, NO_WHEELS)
        rates = out.copy()
        rates[2 * n + 2 * w : 2 * n + 2 * w + 2] = 0.0
        return rates

    def settled(unknown: np.ndarray) -> np.ndarray:
        """Where the vehicle comes to rest from there if the track stands still under it."""
        plant.core.implicit[:] = RUNGE_KUTTA.implicit(SETTLING_STEP)
        x = _marched(frozen, state(unknown))
        plant.core.implicit[:] = 0.0
        spins = (x[2 * n + w : 2 * n + 2 * w] - speed / radius) / scale[n:]
        return np.concatenate((x[:n] / scale[:n], spins, x[track : track + own] / LENGTH))

    sideways = [axes[1] for axes in plant.core.coordinate if axes[1] >= 0]
    best = guess

    def shifted(begun: np.ndarray) -> Iterator[np.ndarray]:
        for aside in ASIDE:
            moved = begun.copy()
            moved[sideways] += aside / LENGTH
            yield moved

    def starts() -> Iterator[np.ndarray]:
        yield from shifted(guess)
        between = guess + np.concatenate((_between_rails(plant, start) / LENGTH, np.zeros(w + own)))
        yield from shifted(between)
        yield settled(between)

    for begun in starts():  # one after the other: the last is dear
        for method, options in SEARCHES.items():
            polished = _polish(residual, jacobian, root(residual, begun, method=method, options=options).x)
            best = min(best, polished, key=restlessness)
            if restlessness(best) <= RESTLESS:
                return state(best)
    raise InputError(
        f"no steady state at s = {start:g} m and {speed:g} m/s: "
        "start on straight track or choose a speed that suits the cant"
    )


def _track_below(plant: Plant, start: float, load: float) -> np.ndarray:
    """Coordinates of the tracks below the wheelsets under their static loads [N]."""
    placed = np.zeros((len(plant.core.radius), COORDINATES))
    deflections = [_deflection(plant, start + x, load) for x in plant.core.position[plant.core.wheelset_body, 0]]
    placed[:, LEFT_Z] = placed[:, RIGHT_Z] = np.negative(deflections)
    placed[:, SLEEPER_Z] = load / plant.core.corunning[PAD_STIFFNESS_Z] - np.array(deflections)
    return placed.ravel()


def _deflection(plant: Plant, s: float, load: float) -> float:
    """Of a rail at s below the track without load [m]."""
    return load / support_stiffness(plant, s) + void_gap(plant, s)


def _on_rails(plant: Plant, start: float, sunk: np.ndarray) -> np.ndarray:
    """Free coordinates with the wheels of each wheelset `sunk` [m] below the surveyed rails, and the bodies above as
    the wheelsets stand.
    """
    core = plant.core
    track = TrackTables(core.s0, core.ds, core.cells, plant.track, False)
    x = core.position[core.wheelset_body, 0]
    left, right = (sample(track, channel, start + x) for channel in (LEFT_VERTICAL, RIGHT_VERTICAL))
    height, roll = 0.5 * (left + right) - sunk, (left - right) / GAUGE
    front, rear = int(x.argmax()), int(x.argmin())
    slope = (height[front] - height[rear]) / (x[front] - x[rear]) if x[front] > x[rear] else 0.0
    own = {int(body): i for i, body in enumerate(core.wheelset_body)}
    placed = np.zeros(len(core.mass))
    for body, axes in enumerate(core.coordinate):
        i = own.get(body)
        z, tilt = (height.mean(), roll.mean()) if i is None else (height[i], roll[i])
        for axis, value in ((2, z), (3, tilt), (4, -slope)):
            if axes[axis] >= 0:
                placed[axes[axis]] = value
    return placed


def _between_rails(plant: Plant, start: float) -> np.ndarray:
    """Free coordinates with every wheelset midway between its rails, and the bodies above as their wheelsets stand."""
    core = plant.core
    track = TrackTables(core.s0, core.ds, core.cells, plant.track, False)
    x = core.position[core.wheelset_body, 0]
    middle = 0.5 * (sample(track, LEFT_LATERAL, start + x) + sample(track, RIGHT_LATERAL, start + x))
    own = {int(body): i for i, body in enumerate(core.wheelset_body)}
    placed = np.zeros(len(core.mass))
    for body, axes in enumerate(core.coordinate):
        below = core.body_frame[core.wheelset_body] == core.body_frame[body]
        shared = middle[below].mean() if below.any() else middle.mean()
        if axes[1] >= 0:
            placed[axes[1]] = middle[own[body]] if body in own else shared
    return placed


def _marched(rates: Callable[[np.ndarray], np.ndarray], x: np.ndarray) -> np.ndarray:
    """The state after `SETTLING_TIME` by classical Runge-Kutta; as it was where that is not finite."""
    first, step = x, SETTLING_STEP
    for _ in range(round(SETTLING_TIME / step)):
        k_1 = rates(x)
        k_2 = rates(x + 0.5 * step * k_1)
        k_3 = rates(x + 0.5 * step * k_2)
        x = x + step / 6.0 * (k_1 + 2.0 * (k_2 + k_3) + rates(x + step * k_3))
        if not np.isfinite(x).all():
            return first
    return x


def _polish(
    residual: Callable[[np.ndarray], np.ndarray], jacobian: Callable[[np.ndarray], np.ndarray], unknown: np.ndarray
) -> np.ndarray:
    """Newton's steps until the accelerations vanish to rounding; none from where the motion is not finite."""
    best, value = unknown, residual(unknown)
    for _ in range(8):
        if np.abs(value).max() < ACCURACY:
            break
        slope = jacobian(best)
        if not (np.isfinite(slope).all() and np.isfinite(value).all()):
            break
        trial = best - np.linalg.lstsq(slope, value, rcond=1e-13)[0]
        moved = residual(trial)
        if not np.abs(moved).max() < np.abs(value).max():
            break
        best, value = trial, moved
    return best
