"""Hunting beyond the linear theory: limit cycles over speed, and the speed at which they die out.

The nonlinear critical speed is the lowest speed at which a limit cycle lives on (Knothe and Stichel 2017, Rail Vehicle
Dynamics, chapter 11): a run starts above the linear critical speed with the wheelsets thrown aside, and its speed falls
slowly until the motion is gone. A second, slower ramp around that speed takes off most of the delay with which
the motion follows the speed. Below the linear critical speed (subcritical) a large disturbance is needed to get there.

Polach's creep law has no single slope at vanishing creepage (see `analysis.linear`), so that the smallest motions do
not grow as the matrices say; `small_motion_speed` takes the growth of runs instead.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from railsim.analysis.linear import critical_speed, linearise, straight
from railsim.dynamics.channels import channel_names
from railsim.dynamics.equilibrium import steady_state
from railsim.dynamics.plant import build_plant
from railsim.engines.interface import Run, default_substeps
from railsim.errors import InputError
from railsim.model import Model
from railsim.simulation import load_engine
from railsim.speed import FASTEST, Constant, Profile, speed_tables
from railsim.track.kernel import build_tables

RATE = 1024.0  # rows a second
WINDOW = 1.0  # s; several periods of hunting
ALIVE = 5e-4  # m; amplitude of the leading wheelset below which the motion counts as gone
SETTLE = 8.0  # s at the highest speed, for the cycle to form
THROW = 3e-3  # m; the wheelsets' first displacement
COARSE, FINE = 0.5, 0.1  # m/s2
ABOVE = 6.0  # m/s; how far above the coarse ramp's end the fine one starts
SMALL = 1e-5  # m; amplitude of runs that are to be linear
FASTEST_RUN = 0.999 * FASTEST


@dataclass(frozen=True)
class Ramp:
    """Limit cycle along a ramp of falling speed.

    Attributes
    ----------
    speed, amplitude : mean speed [m/s] and half of the leading wheelset's lateral range [m] of every window.
    end : speed at which the amplitude falls below `ALIVE` for good [m/s]; None where it never was above, or never fell.
    """

    speed: np.ndarray
    amplitude: np.ndarray
    end: float | None


@dataclass(frozen=True)
class Hunting:
    """Critical speeds of a model [m/s]; None where there is none below `FASTEST`.

    Attributes
    ----------
    matrices : where an eigenvalue of the linearised equations crosses the axis.
    small_motion : where the smallest motions of runs begin to grow.
    nonlinear : where the limit cycle dies out in the fine ramp. ramp : the coarse one, for the amplitude over speed.
    """

    matrices: float | None
    small_motion: float | None
    nonlinear: float | None
    ramp: Ramp | None


def hunting(model: Model, low: float = 5.0) -> Hunting:
    """Linear and nonlinear critical speed on straight, level, smooth track.

    Raises
    ------
    InputError : a motion grows at `low` [m/s] already.
    """
    linear = critical_speed(model, low, FASTEST_RUN)
    if linear is None:
        return Hunting(None, None, None, None)
    high = min(1.25 * linear, FASTEST_RUN)
    ramp = decreasing_speed(model, high, ((max(0.6 * linear, low), COARSE),))
    small = small_motion_speed(model, 0.9 * linear, high)
    if ramp.end is None or ramp.end > high - COARSE * WINDOW:
        return Hunting(linear, small, None, ramp)
    fine = decreasing_speed(model, high, ((min(ramp.end + ABOVE, high - 0.1), COARSE), (ramp.end, FINE)))
    return Hunting(linear, small, fine.end, ramp)


def decreasing_speed(
    model: Model, high: float, legs: Sequence[tuple[float, float]], throw: float = THROW, engine: str = "compiled"
) -> Ramp:
    """Run at `high` [m/s] for `SETTLE` seconds, then with the speed falling in `legs`.

    Parameters
    ----------
    legs : speed [m/s] at the end of each, and the rate at which it is reached [m/s2].
    throw : lateral displacement of all wheelsets at the start [m], to the left +.
    engine : name of the engine that runs it.

    Raises
    ------
    InputError : the speed does not fall.
    """
    time, speed = [0.0, SETTLE], [high, high]
    for low, rate in legs:
        if not (0.0 < low < speed[-1] <= FASTEST and rate > 0.0):
            raise InputError(
                f"ramp from {speed[-1]:g} to {low:g} m/s at {rate:g} m/s2: let it fall, from {FASTEST:g} m/s at most"
            )
        time.append(time[-1] + (speed[-1] - low) / rate)
        speed.append(low)
    profile = Profile(kind="profile", time=tuple(time), speed=tuple(speed))
    run = _run(model, profile, time[-1])
    state = steady_state(build_plant(model, run.track, run.speed), 0.0)
    for wheelset in model.wheelsets:
        state[model.names.index(f"{wheelset.body}.y")] += throw
    moment, y = _lateral(replace(run, initial=state), engine)
    per = round(WINDOW * RATE)
    windows = len(y) // per
    mean_speed = np.interp(moment, time, speed)[: windows * per].reshape(windows, per).mean(axis=1)
    amplitude = 0.5 * np.ptp(y[: windows * per].reshape(windows, per), axis=1)
    return Ramp(mean_speed, amplitude, _end(mean_speed, amplitude))


def growth_rate(model: Model, speed: float, amplitude: float = SMALL, duration: float = 3.0) -> float:
    """Growth [1/s] of the hunting motion of a run that starts in its linear shape, `amplitude` [m] at wheelset 1."""
    small = linearise(model, speed)
    values, shapes = np.linalg.eig(small.state_matrix())
    worst = int(np.argmax(np.where(np.imag(values) > 0.0, np.real(values), -np.inf)))
    leading = small.names.index(f"{model.wheelsets[0].body}.y")
    shape = amplitude * (shapes[:, worst] / shapes[leading, worst]).real
    run = _run(model, Constant(speed=speed), duration)
    state = steady_state(build_plant(model, run.track, run.speed), 0.0)
    n, w = len(model.names), len(model.wheelsets)
    state[: 2 * n] += shape[: 2 * n]
    state[2 * n + w : 2 * n + 2 * w] += shape[2 * n : 2 * n + w]
    state[2 * n + 2 * w + 2 :] += shape[2 * n + w :]
    time, y = _lateral(replace(run, initial=state), "compiled")
    square = y**2 + (np.gradient(y, time) / np.imag(values[worst])) ** 2
    late = time > 0.2 * duration
    return float(np.polyfit(time[late], 0.5 * np.log(square[late]), 1)[0])


def small_motion_speed(model: Model, low: float, high: float, accuracy: float = 0.02) -> float | None:
    """Speed between `low` and `high` [m/s] at which the growth of the smallest motions changes its sign, by bisection.

    None where they do not grow at `high`.

    Raises
    ------
    InputError : they grow at `low` already.
    """
    if growth_rate(model, high) <= 0.0:
        return None
    if growth_rate(model, low) > 0.0:
        raise InputError(f"critical speed: the smallest motions grow at {low:g} m/s already; start lower")
    while high - low > accuracy:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if growth_rate(model, middle) > 0.0 else (middle, high)
    return 0.5 * (low + high)


def _run(model: Model, speed: Constant | Profile, duration: float) -> Run:
    tables = speed_tables(speed, (), len(model.wheelsets), duration)
    return Run(model, build_tables(straight()), tables, 0.0, duration, RATE, default_substeps(model, tables, RATE))


def _lateral(run: Run, engine: str) -> tuple[np.ndarray, np.ndarray]:
    """Time [s] and the leading wheelset's lateral place [m]."""
    at = channel_names(run.model).index(f"{run.model.wheelsets[0].body}.y [m]")
    rows = np.concatenate([chunk[:, [0, at]] for chunk in load_engine(engine)(run)])
    return rows[:, 0], rows[:, 1]


def _end(speed: np.ndarray, amplitude: np.ndarray) -> float | None:
    """Speed at which the amplitude falls below `ALIVE` for good, between two windows by its logarithm."""
    alive = np.flatnonzero(amplitude > ALIVE)
    if not alive.size or alive[-1] == len(speed) - 1:
        return None
    last = int(alive[-1])
    logs = np.log(np.maximum(amplitude[last : last + 2], 1e-12))
    part = (logs[0] - np.log(ALIVE)) / (logs[0] - logs[1])
    return float(speed[last] + part * (speed[last + 1] - speed[last]))
