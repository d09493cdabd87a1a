"""Recursive least squares in sections: against batch least squares, and on a cone by equations (11) and (12)."""

import numpy as np
import pytest

from estimators.wheel_rail.rolling_radii_rls import RollingRadiiRls
from estimators.wheel_rail.section_rls import geometry, known_parts, powers, recursion, regress
from experiments.runs.rolling_radii import ideal_signals
from railsim.wheelset import WheelsetParameters, conical, simulate_wheelset
from tests.estimators.single_wheelset import recording, waves

R0, CONICITY = 0.45, 0.15


def test_recursion_ends_where_batch_least_squares_does():
    rng = np.random.default_rng(1)
    regressors, number = rng.standard_normal((600, 4)), rng.integers(0, 3, 600)
    output = regressors @ np.array([1.0, -2.0, 0.5, 3.0]) + number + 0.1 * rng.standard_normal(600)
    _, spread, theta, covariance = recursion(regressors, output, number, 3, 1e8, 1.0)
    for section in range(3):
        own, wanted = regressors[number == section], output[number == section]
        batch, rest, *_ = np.linalg.lstsq(own, wanted, rcond=None)
        assert np.allclose(theta[section], batch, atol=1e-6)
        variance = rest[0] / (len(own) - 4) * np.linalg.inv(own.T @ own)
        assert np.allclose(covariance[section], variance, rtol=1e-3)
    assert spread[-1, 0] ** 2 == pytest.approx(covariance[number[-1], 0, 0], rel=1e-6)


def test_terms_of_a_section():
    assert powers(0, True) == [(0, 0)]
    assert powers(2, False) == [(0, 0), (1, 0), (2, 0)]
    assert set(powers(2, True)) == {(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)}


@pytest.fixture(scope="module")
def cone():
    parameters = WheelsetParameters(lateral_creep=1.1e7)
    run = simulate_wheelset(parameters, conical(CONICITY, R0), waves(900.0), 25.0, 25.0, start=40.0)
    return ideal_signals(parameters, run, 25.0)


def test_known_parts_leave_what_equations_11_and_12_say(cone: tuple):
    signals, known = cone
    first, second = known_parts(signals, known)
    c = known
    lateral = (2 * (c.f22 - c.f11) + 2 * c.f11) / c.m * signals.yaw - 2 * c.f22 * R0 / (c.m * 25.0) * signals.roll_rate
    assert np.allclose(first, lateral, atol=1e-6 * np.abs(lateral).max())
    steering = -c.l * c.f11 * 2 * CONICITY * signals.shift / (c.I * R0)
    turning = (c.l * c.W * CONICITY - c.k_psi - 2 * c.f23) / c.I * signals.yaw + steering
    turning += (2 * c.f23 * R0 / 25.0 - c.I_wy * 25.0 / R0) / c.I * signals.roll_rate
    assert np.allclose(second, turning + c.f33 * 0.0, atol=1e-5 * np.abs(turning).max())


def test_cone_is_found_in_every_section(cone: tuple):
    signals, known = cone
    sections = regress(signals, known, 5e-4, 1, False)
    found = geometry(sections.coefficients, known)
    visited = sections.samples > 500
    assert np.allclose(found.sum_of_radii[visited], 2 * R0, atol=2e-5)
    assert np.allclose(found.difference_of_radii[visited], 2 * CONICITY * sections.centres[visited], atol=1e-5)
    assert np.allclose(found.sum_of_angles[visited], 2 * CONICITY, atol=0.02)
    assert np.allclose(found.difference_of_angles[visited], 0.0, atol=1e-3)


def test_wrong_creep_coefficient_spoils_the_sum_of_radii_and_hardly_the_difference(cone: tuple):
    signals, known = cone
    wrong = known._replace(f22=1.03 * known.f22)
    found = geometry(regress(signals, wrong, 5e-4, 1, False).coefficients, wrong)
    assert np.abs(found.sum_of_radii - 2 * R0).max() > 5e-3
    assert np.abs(np.nanmedian(found.difference_of_angles)) < 0.05


def test_estimator_finds_the_difference_of_radii_with_stated_uncertainty():
    measured, run = recording(conical(CONICITY, R0), waves(900.0), 25.0, 30.0)
    settings = RollingRadiiRls(creep=1.0)
    series = settings.estimate(measured).series
    late = series[series["time [s]"] > 15.0]
    shift = np.interp(late["time [s]"], run["time [s]"], run["wheelset.y [m]"] - run["track.left_lateral [m]"])
    error = late["difference_of_radii [m]"] - 2 * CONICITY * shift
    assert np.std(error) < 0.2 * np.std(2 * CONICITY * shift)
    assert np.mean(np.abs(error) <= 2 * late["difference_of_radii_std [m]"]) > 0.8
    assert np.mean(np.abs(late["sum_of_radii [m]"] - 2 * R0) <= 2 * late["sum_of_radii_std [m]"]) > 0.9
