"""A wave over a part of the way is found with its length, its phase and its begin."""

from dataclasses import replace

import numpy as np

from experiments.discrepancy.fit.candidates import Candidate, candidates
from experiments.discrepancy.fit.fitting import Problem, starting_fit
from experiments.discrepancy.screen.locate import locate
from experiments.discrepancy.screen.placing import stretches
from experiments.discrepancy.screen.projection import Projection
from experiments.discrepancy.workflow import context_of

WAVE = {"amplitude": 2e-5, "wavelength": 0.62, "place": 90.3, "length": 1000.0}


def test_corrugation_is_found_in_phase(problem: Problem):
    """The tone is known to a part in a thousand; the run is 285 m long."""
    z = np.zeros(len(problem.forward.nuisances))
    context = replace(context_of(problem, locate(problem, starting_fit(problem, z))), tones=((48.4, 0.6204),))
    one = next(found for found in candidates(context) if found.name == "rail_corrugation")
    hidden = problem.but(measured=problem.stacked(problem.forward.predict(z, (one.build(WAVE),))))
    fit = starting_fit(hidden, z)

    def change_of(candidate: Candidate, values: dict[str, float]) -> np.ndarray | None:
        return hidden.stacked(hidden.forward.predict(z, (candidate.build(values),))) - fit.stacked

    projection = Projection(hidden.differentiated(fit), hidden.train, hidden.forward.bounds)
    (found,) = stretches(hidden, fit, projection, one, change_of)
    ahead = np.array([150.0, 200.0, 250.0])
    turns = [(ahead - wave["place"]) / wave["wavelength"] for wave in (found, WAVE)]
    apart = (turns[0] - turns[1] + 0.5) % 1.0 - 0.5
    assert np.abs(apart).max() < 0.15
    assert abs(found["place"] - WAVE["place"]) < 35.0  # to a section
    assert found["place"] + found["length"] > 250.0
