"""A second effect is looked for where the first needs nuisances far from their data sheets."""

import numpy as np
import pytest

from experiments.discrepancy.fit.candidates import candidates
from experiments.discrepancy.fit.fitting import Problem, starting_fit
from experiments.discrepancy.fit.hypothesis import concluded, hypothesis
from experiments.discrepancy.screen.locate import locate
from experiments.discrepancy.select.further import with_further
from experiments.discrepancy.select.stand import Stand
from experiments.discrepancy.workflow import context_of

KNOWN = ("low_adhesion", "creep_shape", "secondary_lateral_stiffness", "payload")


def test_nuisances_that_must_help_the_first_call_the_effect_that_they_stand_for(problem: Problem):
    """Softer springs on rails with four tenths of the adhesion: friction at its least takes it, no signature gains."""
    home = starting_fit(problem, np.zeros(len(problem.forward.nuisances)))
    found = {one.name: one for one in candidates(context_of(problem, locate(problem, home))) if one.name in KNOWN}
    springs, rails = found["secondary_lateral_stiffness"], found["low_adhesion"]
    hidden = (springs.build({"factor": 0.5}), rails.build({"factor": 0.4}))
    there = problem.but(measured=problem.stacked(problem.forward.predict(home.z, hidden)))
    home = starting_fit(there, home.z)
    first = hypothesis(there, home, (springs,), [(home.z, [{"factor": 0.5}])], lambda text: None)
    assert first is not None
    stand = Stand(there, concluded(there, home), [first])
    assert stand.far and not stand.unexplained
    after = with_further(stand, list(found.values()), lambda text: None)
    best = max(after.fitted, key=lambda one: one.log_evidence)
    assert best.classes == {springs.equivalence, rails.equivalence}
    assert best.log_evidence > first.log_evidence + 50.0
    assert best.values[1]["factor"] == pytest.approx(0.4, abs=0.05)
