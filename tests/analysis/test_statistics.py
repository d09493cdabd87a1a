"""Statistics that scores and figures share."""

import numpy as np
import pytest

from railsim.analysis.statistics import root_mean_square


def test_root_mean_square_of_a_sine_and_of_plain_numbers():
    assert root_mean_square(3.0 * np.sin(2.0 * np.pi * np.arange(100) / 100)) == pytest.approx(3.0 / np.sqrt(2.0))
    assert root_mean_square([3, -4, 0, 0]) == 2.5


def test_root_mean_square_shows_what_is_missing():
    assert np.isnan(root_mean_square(np.array([1.0, np.nan])))
