"""The linear matrices are the Jacobian of the nonlinear equations with the contact of equation (1), term by term."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from railsim.errors import InputError
from railsim.wheelset import WheelsetParameters, conical, critical_speed, full_linear, simplified_linear
from railsim.wheelset.equations import LEFT, LEFT_RATE, RIGHT, RIGHT_RATE, STATES, YAW, YAW_RATE, Y, state_rates

# every term of the equations of the same order, so that none hides behind another
EVEN = WheelsetParameters(
    mass=1.3,
    yaw_inertia=0.7,
    spin_inertia=1.1,
    wheel_radius=0.45,
    half_width=0.75,
    load=3.0,
    longitudinal_creep=1.7,
    lateral_creep=2.3,
    lateral_spin_creep=0.9,
    spin_creep=1.9,
    lateral_stiffness=2.9,
    lateral_damping=0.6,
    yaw_stiffness=3.1,
    yaw_damping=0.8,
    suspended_mass=2.1,
)


def jacobian(parameters: WheelsetParameters, conicity: float, speed: float) -> tuple[np.ndarray, np.ndarray]:
    """Central differences of the nonlinear equations at rest: by the state (6, 6), by d and dd/dt (6, 2)."""
    c, table = parameters.coefficients(), conical(conicity, parameters.wheel_radius)

    def rates(state: np.ndarray, rails: np.ndarray) -> np.ndarray:
        out = np.zeros(STATES)
        state_rates(state, rails, c, table, speed, out)
        return out

    h, rest, still = 1e-3, np.zeros(STATES), np.zeros(6)
    by_state = [(rates(h * one, still) - rates(-h * one, still)) / (2 * h) for one in np.eye(STATES)]
    by_track = []
    for pair in ([LEFT, RIGHT], [LEFT_RATE, RIGHT_RATE]):
        moved = still.copy()
        moved[pair] = h
        by_track.append((rates(rest, moved) - rates(rest, -moved)) / (2 * h))
    return np.array(by_state).T, np.array(by_track).T


@pytest.mark.parametrize("speed", [0.5, 20.0, 60.0])
@pytest.mark.parametrize("conicity", [0.025, 0.2])
@pytest.mark.parametrize("parameters", [EVEN, WheelsetParameters()], ids=["even", "default"])
def test_full_linear_is_the_jacobian(parameters: WheelsetParameters, conicity: float, speed: float):
    model = full_linear(parameters, conicity, speed)
    by_state, by_track = jacobian(parameters, conicity, speed)
    np.testing.assert_allclose(by_state, model.state_matrix, rtol=1e-6, atol=1e-9 * np.abs(by_state).max())
    np.testing.assert_allclose(by_track, model.track_matrix, rtol=1e-6, atol=1e-9 * np.abs(by_track).max())


@given(values=st.lists(st.floats(0.1, 10.0), min_size=15, max_size=15), conicity=st.floats(0.01, 0.5))
def test_full_linear_is_the_jacobian_for_any_parameters(values: list[float], conicity: float):
    parameters = WheelsetParameters(**dict(zip(WheelsetParameters.model_fields, values, strict=True)))
    by_state, by_track = jacobian(parameters, conicity, 3.0)
    model = full_linear(parameters, conicity, 3.0)
    np.testing.assert_allclose(by_state, model.state_matrix, rtol=1e-6, atol=1e-9 * np.abs(by_state).max())
    np.testing.assert_allclose(by_track, model.track_matrix, rtol=1e-6, atol=1e-9 * np.abs(by_track).max())


def test_as_printed_differs_in_the_steering_moment_alone():
    """Equation (17) prints l^2 where (12) with (1) gives l."""
    model, printed = full_linear(EVEN, 0.1, 20.0), full_linear(EVEN, 0.1, 20.0, as_printed=True)
    differs = np.argwhere(model.state_matrix != printed.state_matrix)
    assert differs.tolist() == [[YAW_RATE, Y]]
    suspension_free = simplified_linear(EVEN, 0.1, 20.0).state_matrix[YAW_RATE, Y]
    difference = printed.state_matrix[YAW_RATE, Y] - model.state_matrix[YAW_RATE, Y]
    assert difference == pytest.approx(suspension_free * (EVEN.half_width - 1), rel=1e-12)
    simple = simplified_linear(EVEN, 0.1, 20.0, as_printed=True).state_matrix[YAW_RATE, Y]
    assert simple == pytest.approx(suspension_free * EVEN.half_width, rel=1e-12)


def test_simplified_is_full_without_the_smaller_terms():
    small = {"lateral_spin_creep": 0.0, "spin_creep": 0.0, "spin_inertia": 0.0, "load": 0.0}
    full, simple = full_linear(EVEN.but(**small), 0.1, 20.0), simplified_linear(EVEN, 0.1, 20.0)
    np.testing.assert_allclose(simple.state_matrix[YAW_RATE], full.state_matrix[YAW_RATE], rtol=1e-14)
    np.testing.assert_allclose(simple.track_matrix[YAW_RATE], full.track_matrix[YAW_RATE], rtol=1e-14)
    lateral = full_linear(EVEN, 0.1, 20.0)
    others = [row for row in range(STATES) if row != YAW_RATE]
    np.testing.assert_array_equal(simple.state_matrix[others], lateral.state_matrix[others])


def test_spin_of_the_wheels_couples_roll_into_yaw():
    """The gyroscopic moment -I_wy V / r0 dphi/dt, with dphi/dt = lambda / l dy/dt."""
    spinning, still = (
        full_linear(EVEN.but(spin_inertia=inertia), 0.1, 20.0).state_matrix[YAW_RATE] for inertia in (1.1, 0.0)
    )
    expected = np.zeros(STATES)
    expected[1] = -1.1 * 20.0 / 0.45 * 0.1 / 0.75 / EVEN.yaw_inertia
    np.testing.assert_allclose(spinning - still, expected, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("conicity", [0.05, 0.1, 0.2, 0.4])
def test_critical_speed_is_where_the_least_damped_eigenvalue_crosses(conicity: float):
    parameters = WheelsetParameters()
    speed = critical_speed(parameters, conicity)
    assert speed is not None
    assert full_linear(parameters, conicity, 0.999 * speed).eigenvalues()[0].real < 0
    assert full_linear(parameters, conicity, 1.001 * speed).eigenvalues()[0].real > 0
    assert abs(full_linear(parameters, conicity, speed).eigenvalues()[0].imag) > 1.0  # an oscillation, not divergence


def test_critical_speed_falls_with_conicity_and_rises_with_yaw_stiffness():
    parameters = WheelsetParameters()
    speeds = [critical_speed(parameters, conicity) for conicity in (0.05, 0.1, 0.2, 0.4)]
    assert all(first > second for first, second in zip(speeds, speeds[1:], strict=False))  # type: ignore[operator]
    stiffer = critical_speed(parameters.but(yaw_stiffness=5e6), 0.1)
    assert stiffer is not None and stiffer > 1.2 * (speeds[1] or 0)


def test_no_critical_speed_in_the_range_and_unstable_from_the_start():
    assert critical_speed(WheelsetParameters(), 0.1, high=50.0) is None
    with pytest.raises(InputError, match=r"already unstable at 100 m/s"):
        critical_speed(WheelsetParameters(), 0.1, low=100.0)


def test_standing_still_is_refused():
    with pytest.raises(InputError, match=r"speed 0 m/s"):
        full_linear(WheelsetParameters(), 0.1, 0.0)


def test_yaw_gravity_destabilises():
    """+ l W lambda psi on the right of (17)."""
    heavy, light = (full_linear(EVEN.but(load=load), 0.1, 20.0).state_matrix[YAW_RATE, YAW] for load in (5.0, 3.0))
    assert heavy - light == pytest.approx(0.75 * 2.0 * 0.1 / EVEN.yaw_inertia, rel=1e-12)
