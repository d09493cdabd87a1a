"""A wave over a part of the way is found with its length, its phase and its begin; one about a mean beside its tone."""

from dataclasses import replace

import numpy as np

from experiments.discrepancy.fit.candidates import Candidate, candidates
from experiments.discrepancy.fit.fitting import Problem, starting_fit
from experiments.discrepancy.screen.locate import locate
from experiments.discrepancy.screen.placing import beside_tone, stretches, waves_about_means
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


def test_a_wave_about_a_mean_beside_its_tone_is_as_if_it_had_been_run_there(problem: Problem):
    """Soft track with a wave of 12 m: two runs stand for ten; at the ends of the run it is two thirds of a turn off,
    and by a quarter within a section.
    """
    z = np.zeros(len(problem.forward.nuisances))
    fit = starting_fit(problem, z)
    context = replace(context_of(problem, locate(problem, fit)), tones=((2.5, 12.0),))
    one = next(found for found in candidates(context) if found.name == "soft_track")
    runs: list[dict[str, float]] = []

    def change_of(candidate: Candidate, values: dict[str, float]) -> np.ndarray | None:
        runs.append(values)
        return problem.stacked(problem.forward.predict(z, (candidate.build(values),))) - fit.stacked

    (waves,) = waves_about_means(one)
    made = list(beside_tone(problem, one, waves, change_of))
    assert len(runs) == 2 and len(made) == 10
    assert len({values["wavelength"] for values, _ in made}) == 5
    for values, change in made:
        true = change_of(one, values)
        assert true is not None
        made_white, true_white = problem.whitened(change).ravel(), problem.whitened(true).ravel()
        size = float(np.linalg.norm(true_white))
        assert made_white @ true_white > 0.95 * size * np.linalg.norm(made_white), values
        assert abs(np.linalg.norm(made_white) - size) < 0.1 * size, values
