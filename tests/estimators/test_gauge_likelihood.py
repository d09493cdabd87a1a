"""Rails and gauge integrated out by particles: against the Kalman filter where that is exact, and found again."""

import numpy as np
import pytest

from estimators._gauge_kernel import EVERY, LAG, Process, over
from estimators._gauge_likelihood import GaugeLikelihood, Rails, parabola
from estimators._wheel_basis import HALF, SPACING, wheel_basis

RAIL = Process(0.0206, 0.8246, 7.6e-4)
GAUGE = Process(0.438, 0.8246, 1.9e-3)
LENGTH = 0.3
BASIS = wheel_basis(4e-3, 8, 0.6, 1e-3)


def path(process: Process, count: int, rng: np.random.Generator) -> np.ndarray:
    """A realisation of a process, m."""
    step, state, found = over(process, LENGTH), np.zeros(2), np.empty(count)
    for k in range(count):
        first = np.sqrt(step.variance) * rng.standard_normal()
        second = step.slope * first + step.rest * rng.standard_normal()
        state = np.array([step.stay * state[0] + step.cross * state[1] + first, step.fast * state[1] + second])
        found[k] = state[0]
    return found


def record(table: np.ndarray, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """D and y of a wheel F on random rails and gauge."""
    rng = np.random.default_rng(seed)
    d, g = path(RAIL, count, rng), path(GAUGE, count, rng)
    s = LENGTH * np.arange(count)
    x = 1.5e-3 * np.sin(2 * np.pi * s / 11.0) * (1.0 + 0.5 * np.sin(2 * np.pi * s / 170.0)) - d
    u = SPACING * np.arange(-HALF, HALF + 1)
    half = 0.5 * (np.interp(x - g / 2, u, table) - np.interp(-x - g / 2, u, table))
    return half + 5e-6 * rng.standard_normal(count), x + d


def likelihood(half: np.ndarray, y: np.ndarray, particles: int, conicity: float) -> GaugeLikelihood:
    rails = Rails(RAIL, GAUGE, (1.5, 0.3))
    rng = np.random.default_rng(1)
    return GaugeLikelihood(half, y, LENGTH, rails, BASIS, conicity, 0.3, 3.0, rng, particles)


def kalman(half: np.ndarray, y: np.ndarray, conicity: float, rail: Process, noise: float) -> float:
    """Log likelihood of D = conicity (y - d) + noise: linear, so exact."""
    step = over(rail, LENGTH)
    F = np.array([[step.stay, step.cross], [0.0, step.fast]])
    Q = step.variance * np.array([[1.0, step.slope], [step.slope, step.slope**2]])
    Q[1, 1] += step.rest**2
    H = np.array([-conicity, 0.0])
    x, P, total = np.array([y[0], 0.0]), np.diag([1e-6, rail.level**2 / (2.0 * rail.fast)]), 0.0
    for k in range(1, len(y)):
        x, P = F @ x, F @ P @ F.T + Q
        S = H @ P @ H + noise**2
        error = half[k] - conicity * y[k] - H @ x
        total -= 0.5 * (error**2 / S + np.log(S))
        gain = P @ H / S
        x, P = x + gain * error, P - np.outer(gain, H @ P)
    return total


@pytest.fixture(scope="module")
def cone() -> tuple[np.ndarray, np.ndarray]:
    return record(0.2 * SPACING * np.arange(-HALF, HALF + 1), 600, 3)


def test_likelihood_of_a_cone_is_the_kalman_filters(cone: tuple):
    half, y = cone
    one = likelihood(half, y, 2000, 0.2)
    parameters = np.append(np.full(len(BASIS.cone), 0.2), np.log([RAIL.level, GAUGE.level]))
    noise = 2e-5
    prior = parameters - one.mean
    value, score, _ = one.objective(parameters, BASIS, noise / one.scale)
    found = -value + 0.5 * prior @ one.precision @ prior
    exact = kalman(half, y, 0.2, RAIL, noise)
    assert found == pytest.approx(exact, abs=3.0)
    # gradient by the rails' level; the first and last steps' paths are not traced
    step = 0.05
    ends = [kalman(half, y, 0.2, RAIL._replace(level=RAIL.level * np.exp(one)), noise) for one in (step, -step)]
    traced = (len(y) - LAG) // EVERY * EVERY / len(y)
    assert score[:, -2].sum() == pytest.approx(traced * (ends[0] - ends[1]) / (2 * step), abs=0.12 * len(y))
    # a cone tells nothing of the gauge
    assert abs(score[:, -1].sum()) < 0.12 * len(y)


def test_a_wheel_that_bends_is_found_with_the_gauge_unknown():
    table = BASIS.radius @ (0.2 * BASIS.cone)
    half, y = record(table, 2400, 5)
    one = likelihood(half, y, 80, 0.15)
    wheel, paths = one.fit()
    inner = (BASIS.shift > 5e-4) & (BASIS.shift < 2.5e-3)
    true = (BASIS.conicity @ (0.2 * BASIS.cone))[inner]
    error, std = wheel.conicity[inner] - true, np.sqrt(np.diag(wheel.covariance)[inner])
    assert np.sqrt(np.mean(error**2)) < 0.03
    assert np.abs(error / std).max() < 3.0
    assert std.max() < 0.03
    assert np.all(wheel.parameters[-2:] == pytest.approx(np.log([RAIL.level, GAUGE.level]), abs=0.4))
    assert np.isfinite(paths[EVERY + 1 : len(y) - LAG - EVERY]).all()


def test_a_shifted_wheel_is_the_same_on_another_gauge():
    """F(u - c) at gauge deviation g is F(u) at g + 2 c."""
    moved = BASIS.moved(3e-4)
    u = SPACING * np.arange(-HALF, HALF + 1)
    x, g = 1.2e-3, 0.8e-3
    for column, other in zip(BASIS.radius.T, moved.radius.T, strict=True):
        one = np.interp(x - g / 2 - 3e-4, u, column) - np.interp(-x - g / 2 - 3e-4, u, column)
        assert np.interp(x - g / 2, u, other) - np.interp(-x - g / 2, u, other) == pytest.approx(one, abs=1e-12)


def test_conicity_of_a_cone_is_its_slope():
    assert pytest.approx(0.17) == BASIS.conicity @ np.full(len(BASIS.cone), 0.17)


def test_parabola_has_the_place_and_width_of_a_normal_density():
    places = np.linspace(-8e-4, 8e-4, 9)
    best, deviation = parabola(places, 0.5 * ((places - 1.3e-4) / 9e-5) ** 2 + 40.0)
    assert best == pytest.approx(1.3e-4, rel=1e-6)
    assert deviation == pytest.approx(9e-5, rel=1e-6)
