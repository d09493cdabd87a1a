"""Moving: joints of which training sections hold one lie where held-out sections show them."""

from dataclasses import replace

import numpy as np

from experiments.discrepancy.fit.candidates import candidates
from experiments.discrepancy.fit.fitting import Problem, starting_fit, with_candidates
from experiments.discrepancy.fit.hypothesis import concluded
from experiments.discrepancy.fit.scores import Shares
from experiments.discrepancy.screen.locate import locate
from experiments.discrepancy.screen.places import distance_at
from experiments.discrepancy.select.decide import held_out_gap
from experiments.discrepancy.select.moving import moved
from experiments.discrepancy.workflow import context_of


def test_held_out_sections_say_the_spacing_of_joints_that_training_sections_do_not_hold(problem: Problem):
    """Two joints, one in either kind of section, 30 cm nearer to each other than what was fitted says."""
    home = starting_fit(problem, np.zeros(len(problem.forward.nuisances)))
    joints = next(one for one in candidates(context_of(problem, locate(problem, home))) if one.name == "rail_joints")
    s = distance_at(problem, problem.frames.middles)
    kinds = np.arange(len(s))
    half = problem.but(train=kinds < len(s) // 2 - 1, test=kinds > len(s) // 2)
    first, second = float(s[half.train].mean()), float(s[half.test].mean())
    true = {"depth": 4e-3, "spacing": second - first, "first": first}
    effect = joints.build(true)
    there = half.but(measured=half.stacked(half.forward.predict(home.z, (effect,))))
    shares = Shares((joints,)).of([{**true, "spacing": true["spacing"] + 0.3}])
    begun = with_candidates(there, replace(home, residual=home.residual), (joints,), [(home.z, shares)])
    said: list[str] = []
    found = moved(there, concluded(there, begun), said.append)
    assert "by held-out sections" in said[0]
    assert abs(found.values[0]["spacing"] - true["spacing"]) < 0.02
    assert held_out_gap(there, found.fit) < 0.2 * held_out_gap(there, begun)
