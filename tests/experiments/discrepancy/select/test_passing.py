"""Passing: an effect that makes the track file's errors loud is found by the noise that it passes on itself."""

import numpy as np
import pytest

from experiments.discrepancy.baseline.noise import perturbed_tracks
from experiments.discrepancy.fit.candidates import Candidate, candidates
from experiments.discrepancy.fit.fitting import Problem
from experiments.discrepancy.fit.hypothesis import Hypothesis
from experiments.discrepancy.screen.locate import locate
from experiments.discrepancy.screen.spectra import by_power
from experiments.discrepancy.select.decide import held_out_gap
from experiments.discrepancy.select.passing import with_passing
from experiments.discrepancy.select.refining import nuisances_alone
from experiments.discrepancy.select.stand import Stand
from experiments.discrepancy.workflow import context_of
from railsim.effects.primary_friction import PrimaryFriction

FORCE = 3000.0  # N
NAMES = ("primary_friction", "weak_primary_damper", "primary_vertical_stiffness", "weak_yaw_damper")


@pytest.fixture(scope="module")
def rough(problem: Problem) -> Problem:
    """Sticking axlebox guides over the track as it is, of which the file says little at short waves."""
    forward = problem.forward.but(track=perturbed_tracks(problem.evidence, 4, 1)[0])
    measured = problem.stacked(forward.predict(np.zeros(len(forward.nuisances)), (PrimaryFriction(force=FORCE),)))
    test = np.arange(len(measured)) >= len(measured) - 2
    return problem.but(measured=measured, train=~test, test=test)


@pytest.fixture(scope="module")
def null(rough: Problem) -> Hypothesis:
    return nuisances_alone(rough, np.zeros(len(rough.forward.nuisances)), lambda text: None)


@pytest.fixture(scope="module")
def found(rough: Problem, null: Hypothesis) -> list[Candidate]:
    context = context_of(rough, locate(rough, null.fit))
    return [one for one in candidates(context) if one.name in NAMES]


def test_power_tells_friction_from_what_is_not(rough: Problem, null: Hypothesis, found: list[Candidate]):
    ranked = by_power(rough, rough.stacked(rough.forward.predict(np.zeros(len(null.fit.z)))), found)
    (first, _), gain = ranked[0]
    assert first.name == "primary_friction"
    assert gain > 1.2 * max(other for (one, _), other in ranked if one.name != "primary_friction")


def test_friction_is_found_with_the_noise_that_it_passes_on(rough: Problem, null: Hypothesis, found: list[Candidate]):
    assert held_out_gap(rough, null.fit) > 1.3
    said: list[str] = []
    after = with_passing(Stand(rough, null, []), found, said.append)
    assert after.most is not None and after.most.candidate.name == "primary_friction", said
    assert after.most.log_evidence > after.null.log_evidence + 100.0
    assert held_out_gap(after.problem, after.most.fit) < 0.5 * held_out_gap(after.problem, after.null.fit)
    assert after.most.values[0]["force"] == pytest.approx(FORCE, rel=0.15)
