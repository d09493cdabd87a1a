"""A change that was run serves again at a build near by, and only there."""

from dataclasses import replace

import numpy as np

from experiments.discrepancy.fit.candidates import candidates
from experiments.discrepancy.fit.changes import NEAR, Changes
from experiments.discrepancy.fit.fitting import Problem, starting_fit
from experiments.discrepancy.screen.locate import locate
from experiments.discrepancy.screen.screening import screen
from experiments.discrepancy.workflow import context_of


def test_a_change_serves_at_builds_near_by():
    changes, made = Changes(), []

    def make() -> np.ndarray:
        made.append(len(made))
        return np.full((2, 3, 1), 1.0 + len(made), complex)

    home, near, far = np.zeros(3), np.array([0.0, 0.9 * NEAR, 0.0]), np.array([0.0, 1.1 * NEAR, 0.0])
    first = changes.of("wind", home, make)
    assert changes.of("wind", near, make) is first
    assert changes.of("wind", far, make) is not first
    assert changes.of("sleepers", home, make) is not first
    assert len(made) == 3
    assert first is not None and first.dtype == np.complex64


def test_what_the_model_cannot_have_is_not_tried_again():
    changes, tried = Changes(), []
    for _ in range(2):
        assert changes.of("wind", np.zeros(1), lambda: tried.append(1)) is None
    assert len(tried) == 1


def test_a_tone_that_no_effect_may_have_is_left_out(problem: Problem):
    """Waves beside it are a little longer than that of a track's stiffness may be."""
    fit = starting_fit(problem, np.zeros(len(problem.forward.nuisances)))
    context = replace(context_of(problem, locate(problem, fit)), tones=((0.6, 49.9),))
    waves = [one for one in candidates(context) if one.name == "soft_track"]
    found = screen(problem, fit, waves)
    assert found
    assert all(one.tried["wavelength"] <= 50.0 for one in found)


def test_screening_again_after_a_slight_change_of_the_build_costs_no_run(problem: Problem):
    """And says what a screening there from nothing says, but for the signature's own change with the build."""
    z = np.zeros(len(problem.forward.nuisances))
    context = context_of(problem, locate(problem, starting_fit(problem, z)))
    chosen = [one for one in candidates(context) if one.name == "local_low_adhesion"]
    hidden = chosen[0].build({"factor": 0.3, "place": context.distance[0] + 30.0, "length": 60.0})
    measured = problem.stacked(problem.forward.predict(z, (hidden,)))
    problem = problem.but(measured=measured, changes=Changes())
    screen(problem, starting_fit(problem, z), chosen)
    labels = [one.label for one in problem.forward.nuisances]
    z[labels.index("vehicle.body_mass")] = 0.5
    moved = starting_fit(problem, z)
    before = problem.forward.meter.spent
    again = screen(problem, moved, chosen)
    assert problem.forward.meter.spent == before
    anew = screen(problem.but(changes=Changes()), moved, chosen)
    assert problem.forward.meter.spent > before
    best, other = (max(found, key=lambda one: one.gain) for found in (again, anew))
    assert other.gain > 10.0
    assert abs(best.gain - other.gain) < 0.05 * other.gain
