"""Lag over distance gives start and scale; neither a few wrong windows nor channels that do not follow matter."""

import numpy as np

from experiments.discrepancy.railway.cases import ALL, as_measured, nominal
from experiments.discrepancy.railway.registration import register, robust_line
from experiments.discrepancy.recording.evidence import evidence_of
from railsim.scenario import Scenario


def test_offset_and_slope_despite_wrong_windows():
    rng = np.random.default_rng(4)
    x = np.linspace(0.0, 1500.0, 40)
    y = 0.7 + 0.004 * x + 0.01 * rng.standard_normal(40)
    y[[5, 20, 33]] += 6.0
    offset, slope = robust_line(x, y, np.ones(40))
    assert abs(offset - 0.7) < 0.05
    assert abs(slope - 0.004) < 1e-4


def test_vertical_channels_that_show_joints_alone_leave_it_to_the_lateral_ones():
    told = nominal(sensors=ALL)
    joints = {"kind": "rail_joints", "depth": 8e-3, "spacing": 18.8, "first": told.start}
    true = Scenario.build(told.values() | {"effects": [joints], "start": told.start + 1.5})
    found = register(evidence_of(as_measured(true, told, "compiled"), told))
    assert abs(found.start - true.start) < 0.1
