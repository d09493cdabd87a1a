"""Nuisances keep to what there is: reduction factors end at 1, sensors are not sorted out at a limit."""

import numpy as np

from experiments.discrepancy.baseline.nuisances import FURTHEST, STEP, TOLERATED
from experiments.discrepancy.fit.fitting import Problem


def test_a_reduction_factor_that_is_one_already_can_only_fall(problem: Problem):
    """Varied to the other side its derivative would be nought, and a steeper creep curve would pass for an effect."""
    forward = problem.forward
    number = next(i for i, one in enumerate(forward.nuisances) if one.name == "k_adhesion")
    one = forward.nuisances[number]
    assert getattr(forward.evidence.scenario.vehicle, "adhesion").k_adhesion == 1.0  # noqa: B009
    assert one.most == 0.0
    assert one.step(0.0) == -STEP
    assert problem.bank is not None
    sizes = np.abs(problem.bank.columns).sum(axis=(1, 2, 3))
    assert sizes[number] > 0.01 * np.median(sizes)


def test_every_number_of_the_contact_moves_something(problem: Problem):
    assert problem.bank is not None
    sizes = np.abs(problem.bank.columns).sum(axis=(1, 2, 3))
    built = [one.kind in ("pair", "adhesion") for one in problem.forward.nuisances]
    assert (sizes[built] > 0.0).all()


def test_sensors_reach_further_than_a_builds_tolerance(problem: Problem):
    for one in problem.forward.nuisances:
        assert one.least == (-FURTHEST if one.of_sensor or one.kind in ("start", "speed") else -TOLERATED), one.label


def test_derivatives_by_the_registration_foretell_a_shift_of_centimetres(problem: Problem):
    """A difference over a third of the shortest wave would point anywhere: fits ended far above the minimum."""
    assert problem.bank is not None
    forward = problem.forward
    base = problem.stacked(forward.predict(np.zeros(len(forward.nuisances))))
    piece = (
        0.15 * forward.evidence.duration * float(forward.evidence.speed[1].mean())
    )  # m to which the first one applies
    for label, reach in (("start.distance", 1.0), ("speed.wander.0", piece)):
        number = next(i for i, one in enumerate(forward.nuisances) if one.label == label)
        z = np.zeros(len(forward.nuisances))
        z[number] = 0.02 / (forward.nuisances[number].std * reach)
        change = problem.stacked(forward.predict(z)) - base
        missed = change - z[number] * problem.bank.columns[number]
        assert np.linalg.norm(missed) < 0.2 * np.linalg.norm(change), label
