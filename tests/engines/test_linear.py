"""Linearised equations against Exudyn's own linearisation, and the critical speed against runs of both engines."""

import dataclasses

import numpy as np
import pytest

from railsim.analysis.linear import critical_speed, eigenvalues, linearise
from railsim.contact.functions import C11, C22
from railsim.dynamics.equilibrium import steady_state
from railsim.dynamics.plant import build_plant
from railsim.engines.exudyn import System
from railsim.errors import InputError
from railsim.model import Model
from railsim.vehicles.class175 import Class175
from railsim.vehicles.interface import Vehicle
from railsim.vehicles.manchester import Manchester
from railsim.vehicles.manchester_whole import ManchesterWhole
from railsim.vehicles.wheelset import WheelsetVehicle
from tests.engines.rig import flat, go, make_run


def growth(engine: str, model: Model, speed: float, amplitude: float = 1e-5, duration: float = 3.0) -> float:
    """Growth rate [1/s] of the hunting motion of a run that starts in its linear shape with a small amplitude [m]."""
    small = linearise(model, speed)
    values, shapes = np.linalg.eig(small.state_matrix())
    hunting = int(np.argmax(np.where(np.imag(values) > 0.0, np.real(values), -np.inf)))
    shape = amplitude * (shapes[:, hunting] / shapes[small.names.index("wheelset1.y"), hunting]).real
    run = make_run(model, flat(), speed, duration, start=0.0)
    x = steady_state(build_plant(model, run.track, run.speed), 0.0)
    n, w = len(model.names), len(model.wheelsets)
    x[: 2 * n] += shape[: 2 * n]
    x[2 * n + w : 2 * n + 2 * w] += shape[2 * n :]
    result = go(engine, dataclasses.replace(run, initial=x))
    late = result["time [s]"] > 0.5
    square = result["wheelset1.y [m]"] ** 2 + (result["wheelset1.y_rate [m/s]"] / np.imag(values[hunting])) ** 2
    return float(np.polyfit(result["time [s]"][late], 0.5 * np.log(square[late]), 1)[0])


def crossing(engine: str, model: Model, low: float, high: float) -> float:
    """Speed [m/s] at which the growth changes its sign: two secant steps."""
    slow, fast = growth(engine, model, low), growth(engine, model, high)
    assert slow < 0.0 < fast
    slope = (fast - slow) / (high - low)
    first = low - slow / slope
    return first - growth(engine, model, first) / slope


@pytest.mark.parametrize("speed", [8.0, 20.0, 50.0])
@pytest.mark.parametrize(
    ("vehicle", "tolerance"),
    [(Manchester(), 2e-4), (Class175(), 2e-3), (WheelsetVehicle(), 2e-4), (ManchesterWhole(), 1e-2)],
)
def test_exudyn_linearises_to_the_same_eigenvalues(vehicle: Vehicle, tolerance: float, speed: float) -> None:
    """Two differences are known: Exudyn's wheelsets can move along the track against the holding springs, which makes
    the rolling modes (spin against longitudinal creep) faster; and yaw dampers turn the held car body a little.
    """
    model = vehicle.model()
    small = linearise(model, speed)
    system = System(make_run(model, flat(), speed, 1.0, start=0.0))
    mass, damping, stiffness = system.linearised()
    count = len(mass)
    upper = np.hstack((np.zeros((count, count)), np.eye(count)))
    reference = eigenvalues(np.vstack((upper, -np.linalg.solve(mass, np.hstack((stiffness, damping))))))
    rolling = [i for i, name in enumerate(small.names) if name.endswith(".spin")]
    spinning = -small.damping[rolling, rolling] / small.mass[rolling, rolling]
    compared = 0
    for value in small.eigenvalues():
        if np.abs(value - spinning).min() < 1e-3 * abs(value):
            continue
        assert np.abs(reference - value).min() < tolerance * abs(value), value
        compared += 1
    assert compared >= 2 * len(model.names)


def test_matrices_hold_suspension_and_mass() -> None:
    model = Manchester().model()
    small = linearise(model, 20.0)
    free = model.free
    body = [i for i, name in enumerate(small.names) if name.startswith("body")]
    assert np.diag(small.mass)[: len(free)] == pytest.approx(model.mass[free])
    assert small.stiffness[np.ix_(body, body)] == pytest.approx(
        model.stiffness[np.ix_(free, free)][np.ix_(body, body)], rel=1e-4, abs=20.0
    )
    assert small.damping[np.ix_(body, body)] == pytest.approx(
        model.damping[np.ix_(free, free)][np.ix_(body, body)], abs=0.1
    )


@pytest.mark.parametrize("isotropic", [True, False], ids=["C11 = C22", "as it is"])
def test_both_engines_find_the_critical_speed(isotropic: bool) -> None:
    """Polach's slope at small creepage depends on its direction, between C11 and C22, so that the smallest motions of
    the real law are not those of the matrices; with C11 = C22 they are.
    """
    model = Manchester().model()
    if isotropic:
        coefficients = model.contact.coefficients.copy()
        coefficients[:, :, C11] = coefficients[:, :, C22]
        model = dataclasses.replace(model, contact=dataclasses.replace(model.contact, coefficients=coefficients))
    linear = critical_speed(model, 20.0, 120.0)
    assert linear is not None
    low, high = (0.98 * linear, 1.03 * linear) if isotropic else (1.05 * linear, 1.1 * linear)
    fast, reference = crossing("compiled", model, low, high), crossing("exudyn", model, low, high)
    assert fast == pytest.approx(reference, rel=1e-3)
    if isotropic:
        assert fast == pytest.approx(linear, rel=1e-3)
    else:
        assert 1.05 < fast / linear < 1.1


def test_critical_speed_is_where_the_least_damping_vanishes() -> None:
    model = Class175().model()
    speed = critical_speed(model, 20.0, 120.0)
    assert speed is not None
    assert abs(linearise(model, speed).eigenvalues()[0].real) < 1e-5
    assert (
        linearise(model, 0.99 * speed).eigenvalues()[0].real
        < 0.0
        < linearise(model, 1.01 * speed).eigenvalues()[0].real
    )
    assert critical_speed(model, 20.0, 60.0) is None
    with pytest.raises(InputError, match="start the search lower"):
        critical_speed(model, 1.1 * speed, 119.0)


def test_a_search_beyond_the_fastest_run_is_refused() -> None:
    with pytest.raises(InputError, match="up to 120 m/s at most, not 200"):
        critical_speed(Manchester().model(), 20.0, 200.0)
