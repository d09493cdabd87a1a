"""Speed of the particle filter of the suspension, beside the same bank of Kalman filters as filterpy objects."""

import time
from typing import Any

import numpy as np
from filterpy.kalman import KalmanFilter

from estimators.suspension.base import FilterBank, Problem
from estimators.suspension.discrete_model import discrete
from estimators.suspension.suspension_rbpf import SuspensionRbpf
from estimators.vehicle.affine import FULL
from railsim import load_scenario, measure, simulate

PARTICLES = 1000
OBJECTS, STEPS = 5, 64  # filterpy objects that are timed, and their steps; the rest is as many times that
OBJECT_BASELINE = f"{PARTICLES} filterpy.KalmanFilter objects"
UNIT = "s/s"


def suspension_rows(fast: bool = False) -> list[dict[str, Any]]:
    """Seconds of record per second of processor time, full sensors at 256 Hz: the whole estimator, and its kernel."""
    scenario = load_scenario("suspension", {"duration": 10.0 if fast else 65.0})
    measurements = measure(simulate(scenario, engine="compiled"), scenario).measurements
    estimator = SuspensionRbpf(particles=PARTICLES, track="exact")
    SuspensionRbpf(particles=10, track="exact").estimate(measurements)  # machine code
    began = time.process_time()
    estimator.estimate(measurements)
    whole = (float(measurements.time(FULL[0])[-1])) / (time.process_time() - began)
    problem = estimator.prepare(measurements)
    kernel, objects = kernel_speed(problem), objects_speed(problem)
    return [
        _row(f"estimator suspension_rbpf, {PARTICLES} particles", whole, OBJECT_BASELINE, whole / objects),
        _row(f"kernel of suspension_rbpf, {PARTICLES} particles", kernel, OBJECT_BASELINE, kernel / objects),
        _row(OBJECT_BASELINE, objects, None, None),
    ]


def kernel_speed(problem: Problem) -> float:
    """Seconds of record per second, of the bank of filters alone."""
    first, last = problem.stretches[-2]
    situation = problem.situation(first, last)
    assert situation is not None
    packed = problem.table(situation).at(np.tile(problem.nominal, (PARTICLES, 1)))
    filters = FilterBank(problem, PARTICLES)
    began = time.process_time()
    filters.run(situation, problem.system(situation)[3], packed, first, last)
    return (last - first) / problem.record.rate / (time.process_time() - began)


def objects_speed(problem: Problem) -> float:
    """The same with one object a particle; a few are timed."""
    first, last = problem.stretches[-2]
    situation = problem.situation(first, last)
    assert situation is not None
    vehicle, speed, unknowns, plan = problem.system(situation)
    model = discrete(vehicle, problem.nominal, speed, problem.record.rate, unknowns, plan)
    inputs, later, readings = problem.samples(first, last, situation[1])
    filters = []
    for _ in range(OBJECTS):
        kalman = KalmanFilter(dim_x=plan.size, dim_z=len(model.R))
        kalman.F, kalman.H, kalman.Q, kalman.R, kalman.P = model.F, model.C, model.Q, model.R, model.Q.copy()
        kalman.x = np.zeros(plan.size)
        filters.append(kalman)
    steps = min(STEPS, last - first)
    began = time.process_time()
    for kalman in filters:
        for k in range(steps):
            kalman.update(readings[k] - model.D @ inputs[k])
            kalman.predict()
            kalman.x = kalman.x + model.G @ np.concatenate([inputs[k], later[k]])
    spent = (time.process_time() - began) * PARTICLES / OBJECTS
    return steps / problem.record.rate / spent


def _row(name: str, value: float, against: str | None, ratio: float | None) -> dict[str, Any]:
    return {"name": name, "value": value, "unit": UNIT, "against": against, "ratio": ratio}
