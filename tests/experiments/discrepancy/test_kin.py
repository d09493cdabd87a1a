"""A nuisance far from its data sheet calls the effect that it may stand for."""

import numpy as np

from experiments.discrepancy.candidates import candidates
from experiments.discrepancy.fitting import Problem, lost_within, starting_fit
from experiments.discrepancy.kin import kin
from experiments.discrepancy.locate import locate
from experiments.discrepancy.screening import screen
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
