"""Moving: joints lie where held-out sections show them; a stretch over the whole way is what acts everywhere."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.discrepancy.fit.candidates import candidates
from experiments.discrepancy.fit.fitting import Problem, starting_fit, with_candidates
from experiments.discrepancy.fit.hypothesis import concluded, intervals
from experiments.discrepancy.fit.scores import Shares
from experiments.discrepancy.screen.locate import locate
from experiments.discrepancy.screen.places import distance_at
from experiments.discrepancy.select.decide import held_out_gap
from experiments.discrepancy.select.moving import everywhere, moved
from experiments.discrepancy.workflow import context_of


@pytest.mark.parametrize("other", ["later", "earlier"])
def test_held_out_sections_say_where_joints_are_that_training_sections_do_not_hold(problem: Problem, other: str):
    """Two joints, one in either kind of section, 30 cm nearer to each other than what was fitted says; or, fitted, none
    before the one that training sections hold.
    """
    home = starting_fit(problem, np.zeros(len(problem.forward.nuisances)))
    joints = next(one for one in candidates(context_of(problem, locate(problem, home))) if one.name == "rail_joints")
    s = distance_at(problem, problem.frames.middles)
    early = np.arange(len(s)) < len(s) // 2 - 1
    late = np.arange(len(s)) > len(s) // 2
    half = problem.but(train=early, test=late) if other == "later" else problem.but(train=late, test=early)
    first, second = float(s[early].mean()), float(s[late].mean())
    true = {"depth": 4e-3, "spacing": second - first, "first": first}
    effect = joints.build(true)
    there = half.but(measured=half.stacked(half.forward.predict(home.z, (effect,))))
    wrong = {"spacing": true["spacing"] + 0.3} if other == "later" else {"spacing": 190.0, "first": second}
    shares = Shares((joints,)).of([{**true, **wrong}])
    begun = with_candidates(there, replace(home, residual=home.residual), (joints,), [(home.z, shares)])
    said: list[str] = []
    found = moved(there, concluded(there, begun), said.append)
    assert "by held-out sections" in said[-1]
    assert abs(found.values[0]["spacing"] - true["spacing"]) < 0.02
    assert abs(found.values[0]["first"] - first) < 0.02
    assert held_out_gap(there, found.fit) < 0.2 * held_out_gap(there, begun)


def test_held_out_sections_say_how_deep_a_dip_is_of_which_training_sections_see_the_end(problem: Problem):
    """Sleepers that hang by 4 mm over 6 m, begun as a longer and shallower dip beside it; the interval is that of all
    sections.
    """
    home = starting_fit(problem, np.zeros(len(problem.forward.nuisances)))
    dip = next(one for one in candidates(context_of(problem, locate(problem, home))) if one.name == "hanging_sleepers")
    s = distance_at(problem, problem.frames.middles)
    seen = np.abs(s - float(s.mean())) < 15.0
    half = problem.but(train=~seen, test=seen)
    true = {"deflection": 4e-3, "place": float(s.mean()), "length": 6.0}
    there = half.but(measured=half.stacked(half.forward.predict(home.z, (dip.build(true),))))
    wrong = {**true, "deflection": 1e-3, "place": true["place"] + 1.0, "length": 20.0}
    begun = with_candidates(
        there, replace(home, residual=home.residual), (dip,), [(home.z, Shares((dip,)).of([wrong]))]
    )
    found = moved(there, concluded(there, begun), lambda text: None)
    assert found.values[0]["deflection"] == pytest.approx(4e-3, rel=0.02)
    assert abs(found.values[0]["place"] - true["place"]) < 0.05
    assert held_out_gap(there, found.fit) < 0.2 * held_out_gap(there, begun)
    stated = intervals(there, found)["deflection"]
    assert 3e-3 < float(stated["low"]) < 4e-3 < float(stated["high"]) < 5e-3


@pytest.mark.parametrize(("share", "name"), [(1.0, "low_adhesion"), (0.5, "local_low_adhesion")])
def test_a_stretch_over_the_whole_way_is_the_effect_that_acts_everywhere(problem: Problem, share: float, name: str):
    home = starting_fit(problem, np.zeros(len(problem.forward.nuisances)))
    found = candidates(context_of(problem, locate(problem, home)))
    stretch = next(one for one in found if one.name == "local_low_adhesion")
    s = distance_at(problem, problem.frames.middles)
    values = {"factor": 0.3, "place": float(s[0]), "length": share * float(s[-1] - s[0])}
    whole = next(one for one in found if one.name == "low_adhesion")
    effect = whole.build({"factor": 0.3}) if share == 1.0 else stretch.build(values)
    there = problem.but(measured=problem.stacked(problem.forward.predict(home.z, (effect,))))
    begun = with_candidates(
        there, replace(home, residual=home.residual), (stretch,), [(home.z, Shares((stretch,)).of([values]))]
    )
    made = everywhere(there, concluded(there, begun), found, lambda text: None)
    assert made.candidate.name == name
    assert made.values[0]["factor"] == pytest.approx(0.3, abs=0.02)
    assert everywhere(there, made, [], lambda text: None) is made
