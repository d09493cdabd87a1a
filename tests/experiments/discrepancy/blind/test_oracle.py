"""What a hidden effect could bring: nothing where it is absent, more where it is larger; and where it acts."""

import numpy as np
import pytest

from experiments.discrepancy.blind.oracle import acting, effect_of, evidence_over_named, expected_evidence
from experiments.discrepancy.fit.candidates import candidates
from experiments.discrepancy.fit.fitting import starting_fit, with_candidates
from experiments.discrepancy.fit.scores import Shares
from experiments.discrepancy.screen.locate import locate
from experiments.discrepancy.workflow import context_of
from railsim import load_scenario


def test_larger_is_easier(problem):
    sizes = [effect_of({"kind": "weak_yaw_damper", "factor": factor}) for factor in (1.0, 0.5, 0.1)]
    found = [expected_evidence(problem, [one], "polach", {})[0] for one in sizes]
    assert found[0] == pytest.approx(0.0, abs=1e-6)
    assert found[-1] > 1.0
    assert np.all(np.diff(found) > 0.0)


def test_what_the_build_hides(problem):
    """Worn wheels of a vehicle that was built with little conicity are like new ones with much."""
    worn = [effect_of({"kind": "worn_profile", "severity": 0.3})]
    slender, usual = (expected_evidence(problem, worn, "polach", {"pair.conicity": score})[0] for score in (-1.9, 0.0))
    assert slender < 0.2 * usual


def test_an_effect_is_valued_under_the_vehicles_own_creep_law(problem):
    """Under Polach's law nuisances would have to stand for the law as well, and the effect for some of it."""
    slipping = [effect_of({"kind": "reduced_creep_slope", "factor": 0.6})]
    found = [expected_evidence(problem, slipping, law, {})[0] for law in ("polach", "fastsim")]
    assert found[0] > 0.0 and found[1] > 0.0 and abs(found[0] - found[1]) > 0.02 * found[0]


def test_what_was_named_is_behind_the_truth_by_what_it_cannot_do(problem):
    """The true kind catches up from another size; another kind is little better than nuisances alone."""
    true = effect_of({"kind": "weak_yaw_damper", "factor": 0.1})
    hidden = problem.but(
        measured=problem.stacked(problem.forward.predict(np.zeros(len(problem.forward.nuisances)), (true,)))
    )
    located = locate(hidden, starting_fit(hidden, np.zeros(len(problem.forward.nuisances))))
    found = {one.name: one for one in candidates(context_of(hidden, located))}
    behind = []
    for name in ("weak_yaw_damper", "payload"):
        start = starting_fit(hidden, np.zeros(len(problem.forward.nuisances)))
        shares = Shares((found[name],)).of([next(iter(found[name].sizes()))])
        named = with_candidates(hidden, start, (found[name],), [(start.z, shares)])
        behind.append(evidence_over_named(hidden, named, [true], "polach", {}))
    assert behind[0] < 0.05 * behind[1]
    assert behind[1] > 0.5 * expected_evidence(problem, [true], "polach", {})[0]


def test_places_of_effects():
    setup = load_scenario("yaw_dampers").setup
    assert acting(setup, effect_of({"kind": "weak_yaw_damper", "factor": 0.2})) == [["body", "bogie"]]
    assert acting(setup, effect_of({"kind": "payload", "mass": 2000.0})) == [["body"]]
    assert acting(setup, effect_of({"kind": "rail_joints"})) == [["wheelset1"], ["wheelset2"]]
    faulty = effect_of({"kind": "sensor_gain", "channel": "bogie.rate_yaw", "factor": 1.1})
    assert acting(setup, faulty) == [["bogie.rate_yaw"]]


def test_the_loudest_sections_take_no_more_than_there_is(problem):
    """Their share of what the nuisances cannot take: something is left of every effect that a few sections do not make
    up. Bodies' dampers, of which nuisances take most, were valued as nothing by another formula.
    """
    for kind in ("weak_lateral_damper", "weak_roll_bar"):
        assert expected_evidence(problem, [effect_of({"kind": kind, "factor": 0.1})], "polach", {})[0] > 1.0, kind
