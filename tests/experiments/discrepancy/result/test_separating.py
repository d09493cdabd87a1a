"""What would tell two effects apart: nothing tells one from itself, fewer sensors never tell more."""

import numpy as np

from experiments.discrepancy.fit.fitting import Problem
from experiments.discrepancy.result.separating import closest_evidence, unexplained_nats, with_channels
from railsim.effects.weak_lateral_damper import WeakLateralDamper
from railsim.effects.weak_yaw_damper import WeakYawDamper

YAW, LATERAL = (WeakYawDamper(factor=0.2),), (WeakLateralDamper(factor=0.2),)


def test_what_is_left_of_a_signature_beside_another():
    """Lengths 5 and 2 at 60 degrees: 5 sin 60 is left, half its square is 75 / 8."""
    a, b = np.array([5.0, 0.0]), 2.0 * np.array([0.5, np.sqrt(0.75)])
    table = np.stack([a, b, 3.0 * a])
    assert np.isclose(unexplained_nats(table @ table.T, 0, 1), 75.0 / 8.0)
    assert unexplained_nats(table @ table.T, 0, 2) < 1e-9


def test_fewer_sensors_tell_no_more(problem: Problem):
    channels = set(problem.evidence.channels)
    whole = closest_evidence(problem, [YAW, LATERAL])
    few = closest_evidence(
        with_channels(problem, {name for name in channels if name.startswith("primary1")}), [YAW, LATERAL]
    )
    assert whole > 10.0 > few
    assert closest_evidence(problem, [YAW, YAW]) < 1e-3 * whole
