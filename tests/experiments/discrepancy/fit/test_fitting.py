"""A run of the model teaches the derivatives: they predict it afterwards, and know as much as before across it."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.discrepancy.baseline.evidence import Evidence
from experiments.discrepancy.baseline.forward import Forward, Registration
from experiments.discrepancy.baseline.frames import Frames
from experiments.discrepancy.baseline.noise import whitener
from experiments.discrepancy.fit.candidates import Context, candidates
from experiments.discrepancy.fit.fitting import (
    Fit,
    Problem,
    at_values,
    broyden_update,
    effect_columns,
    linearised,
    restarted,
    starting_fit,
    with_candidates,
)
from experiments.discrepancy.fit.hypothesis import concluded
from experiments.discrepancy.fit.scores import Shares
from experiments.discrepancy.select.refining import nuisances_alone, polished
from railsim.errors import InputError

SPRINGS = (
    ("air_spring_stiffness", "vehicle.secondary_vertical_stiffness"),
    ("primary_vertical_stiffness", "vehicle.primary_vertical_stiffness"),
)
K, F, C = 5, 4, 2
REACH = 0.1  # m, that start and end of the run are off


def _problem() -> Problem:
    """White noise of density 4 in two channels; no model behind it."""
    unit = np.broadcast_to(4.0 * np.eye(C, dtype=complex), (K, F, C, C))
    measured = np.zeros((K, F, C), complex)
    frames = Frames(np.arange(float(K)), 2.0, np.arange(F) / 2.0)
    nothing: Evidence = None  # type: ignore[assignment]
    forward = Forward(nothing, Registration(0.0), None)  # type: ignore[arg-type]
    train = np.ones(K, bool)
    return Problem(forward, frames, measured, train, ~train, white=whitener(unit, measured))


def _fit(problem: Problem, z: np.ndarray, stacked: np.ndarray, columns: np.ndarray) -> Fit:
    residual = problem.whitened(problem.measured - stacked)
    return Fit(z, (), np.zeros(0), (), residual, stacked, columns, problem.whitened_columns(columns))


def test_taught_derivatives_predict_the_run_that_taught_them():
    rng = np.random.default_rng(4)
    problem = _problem()
    problem.__dict__["informed"] = np.ones(3)
    columns = (rng.standard_normal((3, K, F, C)) + 1j * rng.standard_normal((3, K, F, C))).astype(np.complex64)
    old = _fit(problem, np.zeros(3), rng.standard_normal((K, F, C)) + 0j, columns)
    move = np.array([0.6, -0.3, 0.2])
    new = _fit(problem, move, old.stacked + np.tensordot(move, 1.5 * columns, axes=1) + 0.2, columns)
    taught = broyden_update(problem, old, new)
    assert np.allclose(np.tensordot(move, taught.columns, axes=1), new.stacked - old.stacked, atol=1e-4)
    bare = replace(taught, jacobian=None)
    assert np.allclose(problem.jacobian(taught), problem.jacobian(bare), atol=1e-4)
    assert problem.jacobian(bare) is problem.jacobian(bare)  # made once
    across = np.array([0.3, 0.6, 0.0])  # at right angles to the move
    assert np.allclose(np.tensordot(across, taught.columns - columns, axes=1), 0.0, atol=1e-4)
    problem.__dict__["informed"] = np.array([0.9, 0.4, 0.0])  # nothing shows the third: it learns nothing
    taught = broyden_update(problem, old, new)
    assert np.allclose(np.tensordot(move, taught.columns, axes=1), new.stacked - old.stacked, atol=1e-4)
    assert np.array_equal(taught.columns[2], columns[2])


def test_nuisances_explain_a_recording_that_nuisances_made(problem: Problem):
    """Without noise the truth costs its prior only, so the minimum costs no more."""
    rng = np.random.default_rng(12)
    least, most = problem.forward.bounds
    truth = np.clip(rng.standard_normal(len(least)), 0.9 * least, 0.9 * most)
    for number, one in enumerate(problem.forward.nuisances):
        if one.kind in ("start", "speed"):
            truth[number] *= REACH / max(one.std * (1.0 if one.kind == "start" else 100.0), REACH)  # decimetres
    recording = problem.but(measured=problem.stacked(problem.forward.predict(truth)))
    found = polished(recording, nuisances_alone(recording, np.zeros(len(truth)), print), print)
    assert found.fit.cost(problem.train) <= 0.5 * float(truth @ truth)


def test_derivatives_made_at_a_point_predict_what_a_small_step_away_is_like(problem: Problem):
    """Along the track above all: sections a little later or earlier look much alike, so errors of a few per cent in the
    large derivatives by start and speed would drown all else, and fits would stop where nothing is.
    """
    rng = np.random.default_rng(3)
    least, most = problem.forward.bounds
    along = np.array([one.kind in ("start", "speed") for one in problem.forward.nuisances])
    z = np.where(along, 0.0, np.clip(rng.standard_normal(len(least)), 0.8 * least, 0.8 * most))
    fit = linearised(problem, starting_fit(problem, z))
    for which, off in ((along, 0.01), (~along, 0.03)):
        step = np.clip(z + np.where(which, 0.01 * rng.standard_normal(len(z)), 0.0), least, most) - z
        change = restarted(problem, fit, z + step).stacked - fit.stacked
        told = np.tensordot(step, fit.columns, axes=1)
        white = [np.linalg.norm(problem.whitened(one)[problem.train]) for one in (change - told, change)]
        assert white[0] < off * white[1]


@pytest.mark.parametrize(("name", "nuisance"), SPRINGS)
def test_a_springs_factor_is_known_no_better_than_the_tolerance_of_the_same_spring(
    problem: Problem, name: str, nuisance: str
):
    """Both scale one stiffness, so that the recording tells their product only: in the limit of good data the factor's
    relative standard deviation is the tolerance's, 0.06. Derivatives by unequal steps, or old ones, make two of them.
    """
    context = Context(("body.acceleration_y",), (0.0, 700.0), (0.0, 9.0), ((0.0, 0.0),))
    spring = next(one for one in candidates(context) if one.name == name)
    home = starting_fit(problem, np.zeros(len(problem.forward.nuisances)))
    shares = Shares((spring,)).of([{"factor": 1.5}])
    begun = with_candidates(problem, home, (spring,), [(home.z, shares)])
    fit = linearised(problem, begun)
    span = spring.parameters["factor"].high - spring.parameters["factor"].low
    own = next(one for one in problem.forward.nuisances if one.label == nuisance)
    deviation = float(np.sqrt(concluded(problem, fit).covariance[0, 0])) * span / 1.5
    assert 0.9 * own.std < deviation < 1.5 * own.std
    labels = [one.label for one in problem.forward.nuisances]
    softer = at_values(problem, fit, [{"factor": 1.45}])
    there = linearised(problem, softer, 0.5)
    again = [label for label, new, old in zip(labels, there.columns, fit.columns, strict=False) if (new != old).any()]
    assert nuisance in again
    assert len(again) < 0.5 * len(labels)


class _Edge:
    """A model that runs at one point alone."""

    def predict(self, z: np.ndarray, effects: object) -> np.ndarray:
        raise InputError("the run leaves the rails")


def test_a_size_at_its_bound_whose_smaller_runs_fail_has_no_derivative():
    context = Context(("body.acceleration_y",), (0.0, 700.0), (0.0, 9.0), ((0.0, 0.0),))
    one = next(one for one in candidates(context) if one.name == "air_spring_stiffness")
    problem = replace(_problem(), forward=_Edge())  # type: ignore[arg-type]
    here = _fit(problem, np.zeros(0), problem.measured, np.zeros((0, K, F, C), np.complex64))
    with pytest.raises(InputError, match="leaves the rails"):
        effect_columns(problem, replace(here, candidates=(one,), shares=np.ones(len(one.parameters))))
