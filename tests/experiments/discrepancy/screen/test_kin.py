"""A nuisance far from its data sheet calls the effect that it may stand for."""

import numpy as np

from experiments.discrepancy.fit.candidates import candidates
from experiments.discrepancy.fit.fitting import Problem, lost_within, starting_fit, with_candidates
from experiments.discrepancy.fit.hypothesis import concluded
from experiments.discrepancy.screen.kin import kin, like_law
from experiments.discrepancy.screen.locate import locate
from experiments.discrepancy.screen.screening import screen
from experiments.discrepancy.workflow import context_of

KNOWN = ("low_adhesion", "payload", "weak_yaw_damper", "weak_roll_bar", "primary_yaw_stiffness")


def test_friction_at_its_least_calls_low_adhesion(problem: Problem):
    z = np.zeros(len(problem.forward.nuisances))
    labels = [one.label for one in problem.forward.nuisances]
    z[labels.index("adhesion.friction")] = -3.0
    fit = starting_fit(problem, z)
    located = locate(problem, fit)
    assert list(located.surprising) == ["adhesion.friction"]
    found = [one for one in candidates(context_of(problem, located)) if one.name in KNOWN]
    named = [one.candidate.name for one in kin(problem, located, screen(problem, fit, found))]
    assert "low_adhesion" in named
    assert "weak_roll_bar" not in named


def test_a_law_that_is_an_effect_under_another_name_calls_it(problem: Problem):
    """Less yaw damping, found by a vehicle with other springs than the nominal one."""
    home = starting_fit(problem, np.zeros(len(problem.forward.nuisances)))
    found = [one for one in candidates(context_of(problem, locate(problem, home))) if one.name in KNOWN]
    screened = screen(problem, home, found)
    damper = next(one for one in found if one.name == "weak_yaw_damper")
    z = np.zeros(len(home.z))
    z[[one.label for one in problem.forward.nuisances].index("vehicle.primary_vertical_stiffness")] = 1.0
    law = with_candidates(problem, home, (damper,), [(z, np.array([0.3]))])
    assert like_law(problem, concluded(problem, law), screened)[0].candidate.name == "weak_yaw_damper"


def test_what_is_lost_within_the_data_sheets(problem: Problem):
    """Nothing of a build that stands there; else what the quadratic model says, which is exact at the edge itself."""
    z = np.zeros(len(problem.forward.nuisances))
    fit = starting_fit(problem, z)
    at_home = problem.but(measured=fit.stacked)
    assert lost_within(at_home, starting_fit(at_home, z)) < 1e-6
    number = int(np.argmax([np.sum(one[problem.train] ** 2) for one in problem.bank_jacobian]))
    nuisance = problem.forward.nuisances[number]
    z[number] = nuisance.most
    there = problem.but(measured=starting_fit(problem, z).stacked)
    lost = lost_within(there, starting_fit(there, z))
    assert lost > 0.0
