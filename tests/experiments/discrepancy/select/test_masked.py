"""Masked: a wider gauge is found where nuisances have followed it, and a healthy recording is left alone."""

import numpy as np
import pytest

from experiments.discrepancy.fit.candidates import candidates
from experiments.discrepancy.fit.fitting import Problem
from experiments.discrepancy.screen.locate import locate
from experiments.discrepancy.select.masked import unmasked
from experiments.discrepancy.select.refining import nuisances_alone
from experiments.discrepancy.select.stand import Stand
from experiments.discrepancy.workflow import context_of
from railsim.effects.gauge_variation import GaugeVariation
from railsim.effects.interface import Effect


def _stand(problem: Problem, effects: tuple[Effect, ...], rng: np.random.Generator) -> Stand:
    """Nuisances alone beside what the effects do at the nominal build, with the stated noise."""
    n = len(problem.forward.nuisances)
    measured = problem.stacked(problem.forward.predict(np.zeros(n), effects))
    assert problem.white is not None
    shape = measured.shape
    noise = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)
    there = problem.but(measured=measured + problem.white.deviation * noise)
    return Stand(there, nuisances_alone(there, np.zeros(n), lambda text: None), [])


@pytest.mark.parametrize(("widening", "found"), [(0.005, True), (0.0, False)])
def test_a_wider_gauge_is_found_behind_the_nuisances_that_followed_it(problem: Problem, widening: float, found: bool):
    """5 mm: of 3.3 mm these 9.5 s say 18 nats less what its numbers cost, too little."""
    effects = (GaugeVariation(widening=widening, amplitude=0.0),) if widening else ()
    stand = _stand(problem, effects, np.random.default_rng(11))
    context = context_of(stand.problem, locate(stand.problem, stand.null.fit))
    after = unmasked(stand, candidates(context), lambda text: None)
    assert bool(after.fitted) is found
    if not found:
        assert after is stand
        return
    without = [one for one in candidates(context) if one.name != "gauge_variation"]
    assert unmasked(stand, without, lambda text: None) is stand  # its rivals are looked for beside it only
    assert after.most is not None and after.most.candidate.name == "gauge_variation"
    assert after.most.values[0]["widening"] == pytest.approx(widening, rel=0.3)
    names = {one.candidate.name for one in after.fitted}
    assert {"conicity_change", "reduced_creep_slope"} <= names  # it is held against what looks like it
