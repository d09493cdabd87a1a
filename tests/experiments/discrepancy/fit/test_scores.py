"""Steps of the fit keep to the tolerances and still find the best point within them."""

import numpy as np

from experiments.discrepancy.fit.scores import TOLERATED, at_bound, bounded_step, share_of, value_at
from railsim.effects.weak_yaw_damper import WeakYawDamper
from railsim.effects.yaw_damper_blow_off import YawDamperBlowOff


def test_a_free_step_is_newtons():
    matrix = np.array([[4.0, 1.0], [1.0, 3.0]])
    slope = np.array([1.0, -2.0])
    assert np.allclose(bounded_step(matrix, slope, np.zeros(2), 1.0), np.linalg.solve(matrix, slope))


def test_scores_beyond_tolerance_stop_at_it_and_the_others_follow():
    """Minimum of a quadratic with one score at its bound: what the others do follows from their own equations."""
    matrix = np.array([[2.0, 1.5], [1.5, 2.0]])
    aim = np.array([10.0, 0.0])
    z = bounded_step(matrix, matrix @ aim, np.zeros(2), 1.0)
    assert np.isclose(z[0], TOLERATED)
    assert np.isclose(z[1], min(TOLERATED, 1.5 / 2.0 * (10.0 - TOLERATED)))


def test_every_share_of_a_step_lowers_the_cost_where_bounds_cut_it():
    """The first can hardly move; the second, which would make up for it, must not go where it would go beside it."""
    matrix = np.array([[1.0, 0.99], [0.99, 1.0]])
    slope = matrix @ np.array([40.0, -40.0])
    z = np.array([2.99, 0.0])
    for share in (1.0, 0.4, 0.1):
        step = bounded_step(matrix, slope, z, share) - z
        assert slope @ step - 0.5 * step @ matrix @ step > 0.0


def test_a_score_keeps_to_bounds_of_its_own():
    """The first may not rise above nought and may fall to -5; the second has the usual tolerance."""
    bounds = np.array([[-5.0], [0.0]])
    matrix = np.eye(2)
    assert np.allclose(bounded_step(matrix, np.array([2.0, 9.0]), np.zeros(2), 1.0, bounds), [0.0, TOLERATED])
    assert np.allclose(bounded_step(matrix, np.array([-4.0, -9.0]), np.zeros(2), 1.0, bounds), [-4.0, -TOLERATED])
    assert at_bound(np.array([0.0, 0.0]), bounds).tolist() == [1, 0]
    assert at_bound(np.array([-5.0, -TOLERATED]), bounds).tolist() == [-1, -1]


def test_shares_go_evenly_through_decades_where_there_are_decades():
    velocity = YawDamperBlowOff.parameters()["velocity"]
    assert np.isclose(value_at(velocity, 0.5), np.sqrt(velocity.low * velocity.high))
    factor = WeakYawDamper.parameters()["factor"]
    assert value_at(factor, 0.5) == 0.5
    for one in (velocity, factor):
        assert np.isclose(share_of(one, value_at(one, 0.3)), 0.3)
