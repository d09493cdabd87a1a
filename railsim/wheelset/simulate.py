"""Runs of the single wheelset over a track: nonlinear and linear, by the same Runge-Kutta scheme of fourth order."""

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from railsim.compiled import allocating
from railsim.errors import InputError
from railsim.track import Track
from railsim.track.kernel import TrackTables, build_tables
from railsim.wheelset.contact import RollingTable
from railsim.wheelset.equations import (
    LEFT,
    LEFT_RATE,
    LEFT_SECOND,
    MASS_Y_RATE,
    RIGHT,
    RIGHT_RATE,
    RIGHT_SECOND,
    STATES,
    Y_RATE,
    YAW_RATE,
    Y,
    rails_at,
    roll_angle,
    state_rates,
    wheel_at,
)
from railsim.wheelset.linear import LinearWheelset, full_linear
from railsim.wheelset.parameters import Coefficients, WheelsetParameters

FASTEST_STEP = 0.25
"""Step times the largest eigenvalue of the linear model that the automatic step stays below (-)."""
COLUMNS = (
    "wheelset.y [m]",
    "wheelset.y_rate [m/s]",
    "wheelset.yaw [rad]",
    "wheelset.yaw_rate [rad/s]",
    "suspended_mass.y [m]",
    "suspended_mass.y_rate [m/s]",
    "wheelset.y_acceleration [m/s2]",
    "wheelset.yaw_acceleration [rad/s2]",
    "suspended_mass.y_acceleration [m/s2]",
    "wheelset.roll [rad]",
    "wheelset.roll_acceleration [rad/s2]",
    "track.left_lateral [m]",
    "track.right_lateral [m]",
)
WIDTH = len(COLUMNS)
ACCELERATION, YAW_ACCELERATION, MASS_ACCELERATION, ROLL, ROLL_ACCELERATION, LEFT_RAIL, RIGHT_RAIL = range(STATES, WIDTH)


def simulate_wheelset(
    parameters: WheelsetParameters,
    contact: RollingTable,
    track: Track,
    speed: float,
    duration: float,
    *,
    rate: float = 1024.0,
    start: float = 0.0,
    state: ArrayLike = (0.0,) * STATES,
    step: float | None = None,
) -> pd.DataFrame:
    """Run the nonlinear equations (11) to (15) over a track at constant speed.

    Parameters
    ----------
    contact : rolling radii and contact angles of both wheels.
    track : its lateral displacements are used, of each rail on its own.
    speed : in m/s. duration : in s. start : distance at time 0 in m.
    rate : rows a second in Hz.
    state : at time 0, shape (6,), as in `railsim.wheelset.equations`.
    step : largest integration step in s; by default a quarter of the fastest time constant of the linear model.

    Returns
    -------
    Table with `"time [s]"`, `"s [m]"` and `COLUMNS`.

    Raises
    ------
    InputError : the track is too short, or the wheelset leaves the contact table (says when and where).
    """
    tables = build_tables(track)
    conicity = _central_conicity(contact)
    steps = _steps(full_linear(parameters, conicity, speed), rate, step)
    rows = _rows(track, speed, duration, rate, start)
    begin = np.array(state, dtype=float)
    out = np.zeros((rows, WIDTH))
    done = _march(begin, parameters.coefficients(), contact, tables, start, speed, 1.0 / rate, steps, out)
    if done < rows:
        raise InputError(
            f"the wheelset left its contact table (more than {contact.reach:g} m from the middle)"
            f" at {done / rate:.4g} s, {start + speed * done / rate:.6g} m;"
            " lower the speed, smooth the track or widen the table"
        )
    return _table(out, rate, start, speed)


def simulate_linear(
    model: LinearWheelset,
    track: Track,
    speed: float,
    duration: float,
    *,
    rate: float = 1024.0,
    start: float = 0.0,
    state: ArrayLike = (0.0,) * STATES,
    step: float | None = None,
) -> pd.DataFrame:
    """Run a linear model over the rails' mean lateral displacement; the rest as in `simulate_wheelset`."""
    tables = build_tables(track)
    steps = _steps(model, rate, step)
    out = np.zeros((_rows(track, speed, duration, rate, start), WIDTH))
    phi, gamma = _transition(model, 1.0 / (rate * steps))
    _march_linear(np.array(state, dtype=float), phi, gamma, tables, start, speed, 1.0 / rate, steps, out)
    _complete_linear(model, tables, start, speed, 1.0 / rate, out)
    return _table(out, rate, start, speed)


@allocating
def _march(
    state: np.ndarray,
    c: Coefficients,
    contact: RollingTable,
    track: TrackTables,
    start: float,
    speed: float,
    interval: float,
    steps: int,
    out: np.ndarray,
) -> int:
    """Fill `out` (rows, WIDTH); return the number of rows before the wheelset left the table or the numbers ended."""
    h = interval / steps
    k1, k2, k3, k4 = np.zeros(STATES), np.zeros(STATES), np.zeros(STATES), np.zeros(STATES)
    rails, middle, end = np.zeros(6), np.zeros(6), np.zeros(6)
    low, high = contact.start, contact.start + contact.spacing * contact.cells
    for row in range(out.shape[0]):
        distance = start + speed * interval * row
        rails_at(track, distance, speed, rails)
        state_rates(state, rails, c, contact, speed, k1)
        left, right = state[Y] - rails[LEFT], rails[RIGHT] - state[Y]
        if not (low <= left <= high and low <= right <= high and np.all(np.isfinite(k1))):
            return row
        out[row, :STATES] = state
        out[row, ACCELERATION], out[row, YAW_ACCELERATION] = k1[Y_RATE], k1[YAW_RATE]
        out[row, MASS_ACCELERATION] = k1[MASS_Y_RATE]
        out[row, ROLL], out[row, ROLL_ACCELERATION] = roll_angle(state, k1[Y_RATE], rails, c.l, contact)
        out[row, LEFT_RAIL], out[row, RIGHT_RAIL] = rails[LEFT], rails[RIGHT]
        for part in range(steps):
            rails_at(track, distance + speed * h * part, speed, rails)
            rails_at(track, distance + speed * h * (part + 0.5), speed, middle)
            rails_at(track, distance + speed * h * (part + 1), speed, end)
            state_rates(state, rails, c, contact, speed, k1)
            state_rates(state + 0.5 * h * k1, middle, c, contact, speed, k2)
            state_rates(state + 0.5 * h * k2, middle, c, contact, speed, k3)
            state_rates(state + h * k3, end, c, contact, speed, k4)
            state += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return out.shape[0]


def _transition(model: LinearWheelset, h: float) -> tuple[np.ndarray, np.ndarray]:
    """One Runge-Kutta step as matrices: x' = phi x + gamma[0] u(t) + gamma[1] u(t + h/2) + gamma[2] u(t + h)."""
    z, identity = h * model.state_matrix, np.eye(STATES)
    phi = identity + z @ (identity + z @ (identity / 2 + z @ (identity / 6 + z / 24)))
    first = identity + z @ (identity + z @ (identity / 2 + z / 4))
    middle = 4 * identity + z @ (2 * identity + z / 2)
    return phi, np.ascontiguousarray(h / 6 * np.stack([first, middle, identity]) @ model.track_matrix)


@allocating
def _mean_rail(track: TrackTables, distance: float, speed: float, rails: np.ndarray) -> np.ndarray:
    """Mean displacement of the rails, its first and its second derivative by time, shape (3,)."""
    rails_at(track, distance, speed, rails)
    return np.array(
        [
            (rails[LEFT] + rails[RIGHT]) / 2.0,
            (rails[LEFT_RATE] + rails[RIGHT_RATE]) / 2.0,
            (rails[LEFT_SECOND] + rails[RIGHT_SECOND]) / 2.0,
        ]
    )


@allocating
def _march_linear(
    state: np.ndarray,
    phi: np.ndarray,
    gamma: np.ndarray,
    track: TrackTables,
    start: float,
    speed: float,
    interval: float,
    steps: int,
    out: np.ndarray,
) -> None:
    h, rails = interval / steps, np.zeros(6)
    for row in range(out.shape[0]):
        out[row, :STATES] = state
        distance = start + speed * interval * row
        for part in range(steps):
            following = phi @ state
            for stage in range(3):
                mean = _mean_rail(track, distance + speed * h * (part + 0.5 * stage), speed, rails)
                following += gamma[stage] @ mean[:2]
            state = following


def _complete_linear(
    model: LinearWheelset, track: TrackTables, start: float, speed: float, interval: float, out: np.ndarray
) -> None:
    """Accelerations, roll and rails of every row from its state."""
    rails = np.zeros(6)
    for row, values in enumerate(out):
        mean = _mean_rail(track, start + speed * interval * row, speed, rails)
        rates = model.state_matrix @ values[:STATES] + model.track_matrix @ mean[:2]
        values[[ACCELERATION, YAW_ACCELERATION, MASS_ACCELERATION]] = rates[[Y_RATE, YAW_RATE, MASS_Y_RATE]]
        values[ROLL] = model.roll_by_shift * (values[Y] - mean[0])
        values[ROLL_ACCELERATION] = model.roll_by_shift * (rates[Y_RATE] - mean[2])
        values[[LEFT_RAIL, RIGHT_RAIL]] = rails[[LEFT, RIGHT]]


def _central_conicity(contact: RollingTable) -> float:
    """Mean slope of the radii at the middle (-)."""
    return (wheel_at(contact, LEFT, 0.0)[1] + wheel_at(contact, RIGHT, 0.0)[1]) / 2.0


def _steps(model: LinearWheelset, rate: float, step: float | None) -> int:
    """Integration steps for one row."""
    largest = FASTEST_STEP / np.abs(model.eigenvalues()).max() if step is None else step
    return max(1, int(np.ceil(1.0 / (rate * largest) - 1e-9)))


def _rows(track: Track, speed: float, duration: float, rate: float, start: float) -> int:
    """Number of rows; raise `InputError` where the track does not reach as far as the run."""
    end = start + speed * duration
    if start < track.s[0] or end > track.s[-1]:
        raise InputError(
            f"track {track.name} reaches from {track.s[0]:g} to {track.s[-1]:g} m, the run from {start:g} to {end:g} m;"
            " shorten the run or move its start"
        )
    return int(np.floor(duration * rate + 1e-9)) + 1


def _table(out: np.ndarray, rate: float, start: float, speed: float) -> pd.DataFrame:
    time = np.arange(len(out)) / rate
    return pd.DataFrame({"time [s]": time, "s [m]": start + speed * time, **dict(zip(COLUMNS, out.T, strict=True))})
