"""Conicity function on varying gauge: the Kalman smoother's path and D, then particles over rails and gauge.

The smoother is left with what does not depend on the conicity, the wheelset's path y and half the difference of the
rolling radii D.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd

from estimators.wheel_rail.conicity_kernel import PSI, PSI_RATE, RAIL, Numbers, WheelsetRecord, Y
from estimators.wheel_rail.conicity_likelihood import Likelihood
from estimators.wheel_rail.conicity_result import ConicityFit, mean_over
from estimators.wheel_rail.gauge_likelihood import GaugeLikelihood, Rails
from estimators.wheel_rail.rail_process import Process
from estimators.wheel_rail.wheel_basis import wheel_basis
from railsim.errors import InputError

SETTLED = 30.0  # m at the start that the particles do not read: the Kalman smoother's own settling
FEWEST = 1000  # steps that the particles need: 300 m, tens of waves of the gauge
TOGETHER = 3.0  # m over which the error of the shift hangs together: the gauge's own length
WHEEL_REACH, WHEEL_PIECES = 4e-3, 16  # m; of one wheel's slope: pieces of 0.5 mm, in which hollow wheels bend
WHEEL_ROUGHNESS = 0.3  # second difference of the slope, hollow wheels 1
TILT, TRANSITION, MIDDLE = 0.6, 1e-3, 4e-4
"""Of the slope where the search starts: steeper towards the flange, over m, about m. As new wheels are whose contact
angle grows towards the flange: S1002 on 60E1 has slopes of 0.09, 0.21, 0.29 and 0.22 at -1, 0, 1 and 2 mm."""


class Gauge(NamedTuple):
    """Processes of the rails and the gauge; spread of the logarithm of the gauge's level; std of the gauge, m.

    conicity_spread : of the prior (-). particles : how many. seed : of theirs.
    """

    rail: Process
    gauge: Process
    level_spread: float
    std: float
    conicity_spread: float
    particles: int
    seed: int


def on_varying_gauge(
    name: str, likelihood: Likelihood, settings: Gauge, time: np.ndarray, record: WheelsetRecord, spacing: float,
    window: float, model_error: float,
) -> ConicityFit:  # fmt: skip
    """By particles over rails and gauge; where they tell nothing, at both ends, the Kalman smoother's rails.

    Parameters
    ----------
    name : of the estimator, for the error. time : (n,), s, of the record. spacing : of the particles' steps, m.
    window : of the conicity over time, s. model_error : standard deviation (-) besides that of the data.

    Raises
    ------
    InputError : the record is too short.
    """
    posterior = likelihood.fit(1, False)
    states, deviation = likelihood.smooth(posterior)
    half = half_difference(likelihood.numbers, record, states)
    along = np.concatenate([[0.0], np.cumsum(0.5 * (record.speed[1:] + record.speed[:-1]) * record.step)])
    distance = np.arange(SETTLED, along[-1], spacing)
    if len(distance) < FEWEST:
        raise InputError(
            f"{name}: {along[-1]:.0f} m are too short with varying gauge; give {FEWEST * spacing:.0f} m "
            "or set gauge to 0 if it is constant"
        )
    basis = wheel_basis(WHEEL_REACH, WHEEL_PIECES, TILT, TRANSITION, MIDDLE)
    wheel, paths = GaugeLikelihood(
        np.interp(distance, along, half), np.interp(distance, along, states[:, Y]),
        Rails(settings.rail, settings.gauge, (1.5, settings.level_spread)), basis,
        likelihood.prior.conicity, WHEEL_ROUGHNESS, settings.conicity_spread,
        np.random.default_rng(settings.seed), settings.particles,
    ).fit()  # fmt: skip
    known = np.isfinite(paths[:, 0])
    inside = (along >= distance[known][0]) & (along <= distance[known][-1])
    shift, gauge, shift_std, gauge_std = (np.interp(along, distance[known], column) for column in paths[known].T)
    shift = np.where(inside, shift, states[:, Y] - states[:, RAIL])
    shift_std = np.where(inside, shift_std, deviation[:, 1])
    width = round(window / record.step)
    square = np.maximum(mean_over(shift**2 + shift_std**2, width), 1e-15)
    hanging = max(1.0, TOGETHER / (record.step * float(np.mean(record.speed))))
    by_shift = np.sqrt(mean_over((half * shift_std) ** 2, width) * hanging / (window / record.step)) / square
    function = np.interp(np.sqrt(square), basis.shift, np.sqrt(np.diag(wheel.covariance)))
    series = pd.DataFrame({
        "time [s]": time,
        "conicity [-]": mean_over(half * shift, width) / square,
        "conicity_std [-]": np.sqrt(by_shift**2 + function**2 + model_error**2),
        "track_lateral [m]": states[:, Y] - shift,
        "track_lateral_std [m]": np.hypot(deviation[:, 0], shift_std),
        "wheelset1.lateral_shift [m]": shift,
        "wheelset1.lateral_shift_std [m]": shift_std,
        "wheelset1.gauge_deviation [m]": np.where(inside, gauge, 0.0),
        "wheelset1.gauge_deviation_std [m]": np.where(inside, gauge_std, settings.std),
    })  # fmt: skip
    levels = np.exp(wheel.parameters[-2:])
    others = {"rail_level [m]": float(levels[0]), "gauge_level [m]": float(levels[1])}
    others["best cone over the run [-]"] = float(half @ shift / np.sum(shift**2 + shift_std**2))
    visited = np.concatenate([np.abs(shift + one * shift_std) for one in (-1.0, 1.0)])
    return ConicityFit(series, basis.shift, wheel.conicity, wheel.covariance, visited, others)


def half_difference(numbers: Numbers, record: WheelsetRecord, states: np.ndarray) -> np.ndarray:
    """(r_L - r_R) / 2 in m from smoothed yaw (n, states), by equation (18) with the yaw suspension and inertia."""
    c, rate = numbers, states[:, PSI_RATE]
    damping = 2.0 * c.l**2 * c.f11 / record.speed + c.c_psi
    moment = c.I * np.gradient(rate, record.step) + damping * rate + c.k_psi * states[:, PSI]
    return -c.r0 / (2.0 * c.l * c.f11) * moment


def level_of(std: float, slow: float, fast: float) -> float:
    """Level of a process's driving noise by its standard deviation (m) and corners (rad/m)."""
    return float(std * np.sqrt(2.0 * slow * fast * (slow + fast)))
