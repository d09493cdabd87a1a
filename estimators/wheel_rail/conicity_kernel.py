"""Extended Kalman filter of a wheelset on unknown rails, for a given function of conicity: what its likelihood needs.

States: yaw psi and its rate, lateral position y, slip velocity s of y' = V psi + s and its rate, lateral position and
velocity of the suspended mass, the rails' lateral position d as a process over distance with the corners of a track
spectrum (two states), biases of yaw gyro and accelerometer, and a part n of the conicity that changes along the line
with the gauge. With x = y - d and F = (lambda(|x|) + n) x the yaw follows equation (18) of Ward et al. (2011),

    I psi'' = -2 l f11 / r0 F - (2 l^2 f11 / V + c_psi) psi' - k_psi psi,

whose fast pole is integrated exactly. Lateral creep forces do not enter: s is what the sensors say, whatever they are.
The mass's acceleration is an input as measured. Measurements: yaw rate; mass less wheelset.
"""

from typing import NamedTuple

import numpy as np

from estimators.filters.kalman import correct, move
from railsim.compiled import allocating, inlined

PSI, PSI_RATE, Y, SLIP, SLIP_RATE, MASS, MASS_RATE, RAIL, RAIL_2, GYRO_BIAS, MASS_BIAS, LINE = range(12)
STATES = 12
GYRO, TRANSDUCER = range(2)


class Numbers(NamedTuple):
    """SI units; symbols of Ward et al. (2011), Appendix 1, for the first five.

    corners : of the track's spectrum, rad/m. rail : level of its driving noise. slip_corner : rad/s. slip : std, m/s.
    moment : yaw moment that the model does not know, N m. line, line_corner : std (-) and corner (rad/m) of n.
    gyro, transducer : variances of a sample. mass : density of the mass's acceleration, m/s2/sqrt(Hz).
    """

    I: float  # noqa: E741
    l: float  # noqa: E741
    r0: float
    k_psi: float
    c_psi: float
    f11: float
    corner: float
    slow_corner: float
    rail: float
    slip_corner: float
    slip: float
    moment: float
    line: float
    line_corner: float
    gyro: float
    transducer: float
    mass: float


class WheelsetRecord(NamedTuple):
    """Yaw rate (rad/s), mass less wheelset (m), the mass's acceleration (m/s2), speed (m/s), shapes (n,); step in s.

    NaN in the first two where nothing was measured.
    """

    gyro: np.ndarray
    transducer: np.ndarray
    mass: np.ndarray
    speed: np.ndarray
    step: float


@inlined
def half_difference(table, spacing, x):
    """lambda(|x|) x and its slope by x, lambda from a table of equal spacing, linear between its points."""
    index = abs(x) / spacing
    cell = min(int(index), table.shape[0] - 2)
    slope = table[cell + 1] - table[cell]
    value = table[cell] + (index - cell) * slope
    return value * x, value + abs(x) * slope / spacing


@inlined
def step(x, F, table, spacing, numbers, v, h, acceleration):
    """Move the mean `x` on by h seconds at speed v, and fill its transition matrix `F`; return what the noise needs.

    The moment is taken as linear over the step (first-order hold), from the shift at its start to the one predicted for
    its end: with the middle's shift alone the yaw rate lags by half a step, which is a fifth of the kinematic motion's
    damping at 30 m/s and 0.3 m.
    """
    c = numbers
    damping = 2.0 * c.l * c.l * c.f11 / v + c.c_psi
    stiff = damping / c.I * h
    keep = np.exp(-stiff)
    late = -(1.0 - (1.0 - keep) / stiff) / damping
    early = -(1.0 - keep) / damping - late
    steering = 2.0 * c.l * c.f11 / c.r0
    slow, fast = np.exp(-c.slow_corner * v * h), np.exp(-c.corner * v * h)
    F[:] = 0.0
    F[RAIL, RAIL], F[RAIL, RAIL_2], F[RAIL_2, RAIL_2] = slow, (slow - fast) / (c.corner - c.slow_corner), fast
    rail = slow * x[RAIL] + F[RAIL, RAIL_2] * x[RAIL_2]
    here = x[Y] - x[RAIL]
    there = x[Y] + h * (v * x[PSI] + x[SLIP]) + 0.5 * h * h * v * x[PSI_RATE] - rail
    value, slope = half_difference(table, spacing, here)
    ahead, slope_ahead = half_difference(table, spacing, there)
    by_here, by_there = early * steering * (slope + x[LINE]), late * steering * (slope_ahead + x[LINE])
    F[PSI_RATE, PSI_RATE] = keep + late * c.k_psi * h + by_there * 0.5 * h * h * v
    F[PSI_RATE, PSI] = (early + late) * c.k_psi + by_there * h * v
    F[PSI_RATE, Y], F[PSI_RATE, SLIP] = by_here + by_there, by_there * h
    F[PSI_RATE, RAIL], F[PSI_RATE, RAIL_2] = -by_here - by_there * slow, -by_there * F[RAIL, RAIL_2]
    F[PSI_RATE, LINE] = steering * (early * here + late * there)
    new_rate = keep * x[PSI_RATE] + early * (steering * (value + x[LINE] * here) + c.k_psi * x[PSI])
    new_rate += late * (steering * (ahead + x[LINE] * there) + c.k_psi * (x[PSI] + h * x[PSI_RATE]))
    decay = np.exp(-c.slip_corner * h)
    F[SLIP, SLIP], F[SLIP, SLIP_RATE] = decay * (1.0 + c.slip_corner * h), decay * h
    F[SLIP_RATE, SLIP], F[SLIP_RATE, SLIP_RATE] = -decay * c.slip_corner**2 * h, decay * (1.0 - c.slip_corner * h)
    slip = F[SLIP, SLIP] * x[SLIP] + F[SLIP, SLIP_RATE] * x[SLIP_RATE]
    slip_rate = F[SLIP_RATE, SLIP] * x[SLIP] + F[SLIP_RATE, SLIP_RATE] * x[SLIP_RATE]
    for j in range(STATES):
        F[PSI, j] = 0.5 * h * F[PSI_RATE, j]
    F[PSI, PSI] += 1.0
    F[PSI, PSI_RATE] += 0.5 * h
    psi = x[PSI] + 0.5 * h * (x[PSI_RATE] + new_rate)
    for j in range(STATES):
        F[Y, j] = 0.5 * h * (v * F[PSI, j] + F[SLIP, j])
    F[Y, Y] += 1.0
    F[Y, PSI] += 0.5 * h * v
    F[Y, SLIP] += 0.5 * h
    x[Y] += 0.5 * h * (v * (x[PSI] + psi) + x[SLIP] + slip)
    F[MASS, MASS], F[MASS, MASS_RATE], F[MASS, MASS_BIAS] = 1.0, h, -0.5 * h * h
    F[MASS_RATE, MASS_RATE], F[MASS_RATE, MASS_BIAS] = 1.0, -h
    moved = acceleration - x[MASS_BIAS]
    x[MASS] += h * x[MASS_RATE] + 0.5 * h * h * moved
    x[MASS_RATE] += h * moved
    x[RAIL] = rail
    x[RAIL_2] *= fast
    F[GYRO_BIAS, GYRO_BIAS] = F[MASS_BIAS, MASS_BIAS] = 1.0
    along = np.exp(-c.line_corner * v * h)
    F[LINE, LINE] = along
    x[LINE] *= along
    x[PSI], x[PSI_RATE], x[SLIP], x[SLIP_RATE] = psi, new_rate, slip, slip_rate
    return early + late, -by_there, fast, along


@inlined
def add_noise(P, numbers, v, h, give, by_rail, fast, along):
    """Covariance of what a step brings anew; `by_rail`: what the rail's share does to the yaw rate within the step."""
    c = numbers
    drive = c.rail * c.rail * (1.0 - fast * fast) / (2.0 * c.corner)
    both, own = 0.5 * drive * v * h, drive * (v * h) ** 2 / 3.0
    P[RAIL_2, RAIL_2] += drive
    P[RAIL, RAIL_2] += both
    P[RAIL_2, RAIL] += both
    P[RAIL, RAIL] += own
    moment = (give * c.moment) ** 2
    for i in range(3):
        to_i = 1.0 if i == PSI_RATE else (0.5 * h if i == PSI else 0.25 * h * h * v)
        P[i, RAIL] += to_i * by_rail * own
        P[RAIL, i] += to_i * by_rail * own
        P[i, RAIL_2] += to_i * by_rail * both
        P[RAIL_2, i] += to_i * by_rail * both
        for j in range(3):
            to_j = 1.0 if j == PSI_RATE else (0.5 * h if j == PSI else 0.25 * h * h * v)
            P[i, j] += to_i * to_j * (by_rail * by_rail * own + moment)
    P[SLIP_RATE, SLIP_RATE] += 4.0 * c.slip_corner**3 * c.slip**2 * h
    P[MASS_RATE, MASS_RATE] += c.mass**2 * h
    P[MASS_BIAS, MASS_BIAS] += 1e-12 * h
    P[GYRO_BIAS, GYRO_BIAS] += 1e-12 * h
    P[LINE, LINE] += c.line**2 * (1.0 - along * along)


@allocating
def run(record, table, spacing, numbers, x, P, keep):
    """Filter from (x, P), which are overwritten.

    Returns
    -------
    Innovations and their variances (n, 2), 0 and 1 where nothing was measured; and, if `keep`, else with one row:
    predicted and filtered means (n, 2, states) and covariances (n, 2, states, states), transitions (n, states, states).
    """
    count = record.gyro.shape[0]
    innovation, variance = np.zeros((count, 2)), np.ones((count, 2))
    kept = count if keep else 1
    means, covariances = np.zeros((kept, 2, STATES)), np.zeros((kept, 2, STATES, STATES))
    transitions = np.zeros((kept, STATES, STATES))
    F, A, gain = np.zeros((STATES, STATES)), np.zeros((STATES, STATES)), np.zeros(STATES)
    h = record.step
    for k in range(count):
        if k > 0:
            v = 0.5 * (record.speed[k] + record.speed[k - 1])
            pushed = 0.5 * (record.mass[k] + record.mass[k - 1])
            give, by_rail, fast, along = step(x, F, table, spacing, numbers, v, h, pushed)
            move(P, F, A)
            add_noise(P, numbers, v, h, give, by_rail, fast, along)
        if keep:
            transitions[k] = F
            means[k, 0] = x
            covariances[k, 0] = P
        for m in range(2):
            first_state, second_state, sign = (PSI_RATE, GYRO_BIAS, 1.0) if m == GYRO else (MASS, Y, -1.0)
            measured = record.gyro[k] if m == GYRO else record.transducer[k]
            if not np.isfinite(measured):
                continue
            noise = numbers.gyro if m == GYRO else numbers.transducer
            for i in range(STATES):
                gain[i] = P[i, first_state] + sign * P[i, second_state]
            S = gain[first_state] + sign * gain[second_state] + noise
            error = measured - x[first_state] - sign * x[second_state]
            correct(x, P, gain, S, error)
            innovation[k, m], variance[k, m] = error, S
        if keep:
            means[k, 1] = x
            covariances[k, 1] = P
    return innovation, variance, means, covariances, transitions
