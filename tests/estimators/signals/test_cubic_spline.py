"""Splines and means in rows, against SciPy and NumPy."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from estimators.signals.cubic_spline import at_even_places, means


@pytest.mark.parametrize("count", [2, 3, 4, 5, 500])
def test_splines_are_those_of_scipy(count: int):
    generator = np.random.default_rng(count)
    places, values = np.cumsum(generator.uniform(0.01, 1.0, count)), generator.normal(size=(3, count))
    asked = round(places[-1] / 0.07) + 5  # beyond both ends
    expected = CubicSpline(places, values, axis=-1)(np.clip(0.07 * np.arange(asked), places[0], places[-1]))
    assert at_even_places(places, values, 0.07, asked) == pytest.approx(expected, abs=1e-10)
    assert at_even_places(places, values[1], 0.07, asked) == pytest.approx(expected[1], abs=1e-10)


def test_means_of_runs():
    values = np.arange(14.0).reshape(2, 7) ** 2
    first = np.array([0, 1, 4])
    expected = [[row[0], row[1:4].mean(), row[4:].mean()] for row in values]
    assert means(values, first) == pytest.approx(np.array(expected))
    assert means(values[1], first) == pytest.approx(expected[1])
