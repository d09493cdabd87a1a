"""A run of the model teaches the derivatives: they predict it afterwards, and know as much as before across it."""

import numpy as np

from experiments.discrepancy.evidence import Evidence
from experiments.discrepancy.fitting import Fit, Problem, _taught
from experiments.discrepancy.forward import Alignment, Forward
from experiments.discrepancy.frames import Frames
from experiments.discrepancy.noise import whitener
from experiments.discrepancy.refining import nuisances_alone, unbiased

K, F, C = 5, 4, 2
REACH = 0.1  # m, that start and end of the run are off


def _problem() -> Problem:
    """White noise of density 4 in two channels; no model behind it."""
    unit = np.broadcast_to(4.0 * np.eye(C, dtype=complex), (K, F, C, C))
    measured = np.zeros((K, F, C), complex)
    frames = Frames(np.arange(float(K)), 2.0, np.arange(F) / 2.0)
    nothing: Evidence = None  # type: ignore[assignment]
    forward = Forward(nothing, Alignment(0.0), None)  # type: ignore[arg-type]
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
    taught = _taught(problem, old, new)
    assert np.allclose(np.tensordot(move, taught.columns, axes=1), new.stacked - old.stacked, atol=1e-4)
    assert np.allclose(taught.jacobian, problem.whitened_columns(taught.columns), atol=1e-4)
    across = np.array([0.3, 0.6, 0.0])  # at right angles to the move
    assert np.allclose(np.tensordot(across, taught.columns - columns, axes=1), 0.0, atol=1e-4)
    problem.__dict__["informed"] = np.array([0.9, 0.4, 0.0])  # nothing shows the third: it learns nothing
    taught = _taught(problem, old, new)
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
    found = unbiased(recording, nuisances_alone(recording, np.zeros(len(truth)), print), print)
    assert found.fit.cost(problem.train) <= 0.5 * float(truth @ truth)
