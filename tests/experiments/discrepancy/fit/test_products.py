"""Products in pieces are those of the whole."""

import numpy as np

from experiments.discrepancy.fit.products import WEIGHT, added, normal_equations


def test_normal_equations_are_those_of_the_frames_in_one_piece():
    rng = np.random.default_rng(12)
    jacobian, residual = rng.standard_normal((4, 9, 5, 6)).astype(np.float32), rng.standard_normal((9, 5, 6))
    frames = np.array([True, False, True, True, False, True, True, False, True])
    flat = WEIGHT * jacobian[:, frames].astype(float).reshape(4, -1)
    normal, gradient = normal_equations(jacobian, residual, frames)
    assert np.allclose(normal, flat @ flat.T, rtol=1e-12)
    assert np.allclose(gradient, flat @ (WEIGHT * residual[frames]).ravel(), rtol=1e-12)
    assert not normal_equations(jacobian, residual, np.zeros(9, bool))[0].any()


def test_what_is_added_to_each_row_is_so_many_times_the_one():
    rng = np.random.default_rng(13)
    rows, factors, one = rng.standard_normal((7, 3, 2)), rng.standard_normal(7), rng.standard_normal((3, 2))
    before = rows.copy()
    assert np.allclose(added(rows, factors, one), rows + factors[:, None, None] * one)
    assert np.array_equal(rows, before)
