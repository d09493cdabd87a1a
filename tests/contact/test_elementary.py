"""Branch-free elementary functions against NumPy's."""

import numpy as np
import pytest

from railsim.contact.elementary import arc_tangent, cube_root, cubic, falling_exponential

SIZES = np.concatenate((np.linspace(0.0, 12.0, 3001), 10.0 ** np.linspace(-12.0, 12.0, 3001)))


def test_arc_tangent():
    found = np.array([arc_tangent(x) for x in SIZES])
    assert np.all(np.abs(found - np.arctan(SIZES)) <= 2.0 * np.spacing(np.arctan(SIZES)))


def test_falling_exponential():
    sizes = np.concatenate((SIZES, np.linspace(12.0, 40.0, 3001)))
    found = np.array([falling_exponential(x) for x in sizes])
    below = sizes < 40.0
    assert found[below] == pytest.approx(np.exp(-sizes[below]), rel=1e-13, abs=0.0)
    assert np.all((found[~below] > 0.0) & (found[~below] < 1e-17))
    assert falling_exponential(0.0) == 1.0


def test_cube_root():
    found = np.array([cube_root(x) for x in SIZES])
    assert found == pytest.approx(np.cbrt(SIZES), rel=1e-15, abs=0.0)
    assert cube_root(0.0) == 0.0


def test_cubic():
    assert cubic(np.array([1.0, -2.0, 3.0, 0.5]), 2.0) == 1.0 - 4.0 + 12.0 + 4.0
