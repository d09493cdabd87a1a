"""Lag over distance gives start and scale; a few wrong windows do not matter."""

import numpy as np

from experiments.discrepancy.baseline.registration import robust_line


def test_offset_and_slope_despite_wrong_windows():
    rng = np.random.default_rng(4)
    x = np.linspace(0.0, 1500.0, 40)
    y = 0.7 + 0.004 * x + 0.01 * rng.standard_normal(40)
    y[[5, 20, 33]] += 6.0
    offset, slope = robust_line(x, y, np.ones(40))
    assert abs(offset - 0.7) < 0.05
    assert abs(slope - 0.004) < 1e-4
