"""The suspension estimators' own model: against the vehicle's matrices, and its filters against filterpy's."""

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

from estimators._half_vehicle import DEGREES, FULL, STATES, WITHOUT_WHEELSETS, half_vehicle, nominal
from estimators._shaping import Prior
from estimators._suspension_bank import exact, gains, run_bank
from estimators._suspension_model import Unknowns, discrete, layout, steady
from railsim.vehicles.class175 import Class175
from railsim.vehicles.manchester import Manchester

RATE, SPEED = 256.0, 30.0
ORDER = ("bogie.y", "bogie.yaw", "body.y", "bogie.roll", "body.roll")


def unknowns(channels: tuple[str, ...], track: tuple[Prior, ...] = ()) -> Unknowns:
    """Plausible noise."""
    return Unknowns(np.full(DEGREES, 30.0**2), np.full(len(channels), 0.01**2), track)


@pytest.mark.parametrize("vehicle", [Class175(), Manchester()])
@pytest.mark.parametrize("kind", ["stiffness", "damping"])
def test_suspension_is_that_of_the_vehicle(vehicle: Class175, kind: str):
    """Forces on bogie and body by every coordinate are the assembled K and C of the vehicle, preloads included."""
    values = vehicle.nominal()
    A = half_vehicle(values, SPEED, FULL, 0.6).at(nominal(values))[0]
    model = vehicle.model()
    assembled = model.stiffness if kind == "stiffness" else model.damping
    names = [f"{body.name}.{axis}" for body in model.bodies for axis in ("x", "y", "z", "roll", "pitch", "yaw")]
    own = ["wheelset1.y", "wheelset1.yaw", "wheelset2.y", "wheelset2.yaw", *ORDER]
    rows, columns = [names.index(name) for name in ORDER], [names.index(name) for name in own]
    mass = model.mass[rows][:, None]
    first = 0 if kind == "stiffness" else DEGREES
    ours = -A[DEGREES + 4 :, first : first + DEGREES] * mass
    theirs = assembled[np.ix_(rows, columns)]
    assert np.allclose(ours, theirs, atol=1e-6 * np.abs(theirs).max())


def test_matrices_are_affine_in_the_parameters():
    vehicle = half_vehicle(Class175().nominal(), SPEED, FULL, 0.6)
    one, other = np.array([1e4, 2e5, 0.1]), np.array([5e4, 6e5, 0.3])
    for low, high, middle in zip(vehicle.at(one), vehicle.at(other), vehicle.at((one + other) / 2), strict=True):
        assert np.allclose((low + high) / 2, middle, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("track", [(), (Prior(1.4e-7), Prior(4.9e-7, (0.438, 0.8246)))])
def test_steady_filter_is_the_one_that_filterpy_converges_to(track: tuple[Prior, ...]):
    values = Class175().nominal()
    vehicle = half_vehicle(values, SPEED, WITHOUT_WHEELSETS, 0.6)
    plan = layout(2.6, SPEED, 64.0, track)
    system = discrete(vehicle, nominal(values), SPEED, 64.0, unknowns(WITHOUT_WHEELSETS, track), plan)
    K, S = steady(*(part[None] for part in (system.F, system.C, system.Q, system.R)))
    reference = KalmanFilter(dim_x=plan.size, dim_z=3)
    reference.F, reference.H, reference.Q, reference.R = system.F, system.C, system.Q, system.R
    reference.P = np.diag(np.diag(system.Q)) * 10 + 1e-9 * np.eye(plan.size)
    for _ in range(1500):
        reference.predict()
        reference.update(np.zeros(3))
    assert np.allclose(S[0], reference.S, rtol=1e-4, atol=1e-6 * np.abs(reference.S).max())
    expected = system.F @ reference.K
    assert np.allclose(K[0], expected, atol=1e-4 * np.abs(expected).max())


def test_bank_gives_the_likelihood_of_filterpy_and_of_its_interpolated_gains():
    values = Class175().nominal()
    vehicle, plan = half_vehicle(values, SPEED, FULL, 0.6), layout(2.6, SPEED, RATE, ())
    inside, rng = unknowns(FULL), np.random.default_rng(3)
    parameters = nominal(values)[None, :]
    readings, inputs = 0.02 * rng.standard_normal((300, 7)), 1e-4 * rng.standard_normal((301, 6))
    inputs[:, 4:] = 0.0
    means = (inputs[1:] + inputs[:-1]) / 2

    def likelihood(packed: np.ndarray) -> float:
        state, found, work = np.zeros((1, STATES)), np.zeros(1), np.zeros((3, 64))
        run_bank(state, packed, plan.columns, plan.head, plan.length, inputs[:-1], means, readings, found, work)
        return float(found[0])

    packed = exact(vehicle, SPEED, RATE, inside, plan, parameters)
    table = gains(vehicle, SPEED, RATE, inside, plan, np.array([0.0, 0.0, 0.01]), np.array([64e3, 811e3, 0.45]))
    system = discrete(vehicle, parameters[0], SPEED, RATE, inside, plan)
    K, S = steady(*(part[None] for part in (system.F, system.C, system.Q, system.R)))
    x, total = np.zeros(STATES), 0.0
    for k, reading in enumerate(readings):
        error = reading - system.C @ x - system.D @ inputs[k]
        total -= 0.5 * (error @ np.linalg.solve(S[0], error) + np.linalg.slogdet(S[0])[1])
        x = system.F @ x + system.G @ (inputs[k] + inputs[k + 1]) / 2 + K[0] @ error
    assert likelihood(packed) == pytest.approx(total, rel=1e-9)
    assert likelihood(table.at(parameters)) == pytest.approx(total, abs=1.0)
