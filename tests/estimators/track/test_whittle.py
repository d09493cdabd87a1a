"""Fisher scoring of Whittle's likelihood on processes of known spectra."""

import numpy as np
import pytest

from estimators.signals.bands import Band
from estimators.track.whittle import HANN, Problem, Spectra, chi_square, fit

K = np.geomspace(0.1, 2.5, 40)
NUMBER = np.full(len(K), 30.0)
LEVEL, GAIN = 3.0, 1.4


def _parts(u: np.ndarray) -> np.ndarray:
    """Two readings of one process, the second through a gain; and a second process in the first reading alone."""
    gain = np.stack([np.ones(len(K)), np.exp(u[0]) / (1.0 + K**2)], axis=1).astype(complex)
    first = gain[:, :, None] * gain[:, None, :].conj() / K[:, None, None] ** 2
    second = np.zeros_like(first)
    second[:, 0, 0] = 1.0
    return np.array([first, second])


def _problem(density: np.ndarray, spread: float = 2.0) -> Problem:
    noise = np.broadcast_to(0.05 * np.eye(2), (len(K), 2, 2)).astype(complex)
    seen = Spectra(K, NUMBER, density, ((1.0, slice(0, len(K))),))
    return Problem(
        seen, noise, np.array([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]), _parts, 1,
        np.array([0.0, -1.0, 0.0]), np.array([np.inf, 3.0, spread]), np.full(3, -8.0), np.full(3, 8.0),
    )  # fmt: skip


def _truth(problem: Problem) -> np.ndarray:
    return problem.spectrum(np.array([np.log(LEVEL), np.log(0.3), 0.0]), _parts(np.log([GAIN])))


def _drawn(rng: np.random.Generator) -> np.ndarray:
    """Averaged periodograms of `NUMBER` / `HANN` independent coefficients."""
    S, count = _truth(_problem(np.zeros((len(K), 2, 2)))), round(NUMBER[0] / HANN)
    root = np.linalg.cholesky(S)
    white = rng.normal(size=(count, len(K), 2)) + 1j * rng.normal(size=(count, len(K), 2))
    Y = np.einsum("bml,nbl->nbm", root, white) / np.sqrt(2.0)
    return np.einsum("nbm,nbl->bml", Y, Y.conj()) / count


def test_slope_is_that_of_the_cost():
    problem = _problem(_drawn(np.random.default_rng(1)))
    x = np.array([0.7, -0.8, 0.2])
    parts = _parts(x[2:])
    slope, _ = problem.slopes(x, parts, problem.changes(x[2:], parts))
    for number, step in enumerate(1e-5 * np.eye(3)):
        costs = [problem.cost(x + side * step, _parts((x + side * step)[2:])) for side in (1.0, -1.0)]
        assert slope[number] == pytest.approx((costs[0] - costs[1]) / 2e-5, rel=2e-3)


def test_what_made_the_spectra_is_found_within_what_is_stated():
    """Normalised errors of 40 draws have variance 1; the whitened readings are as large as chance lets them be."""
    errors, ratios = [], []
    for seed in range(40):
        problem = _problem(_drawn(np.random.default_rng(seed)))
        found = fit(problem, [problem.mean, problem.mean + np.array([0.0, 2.0, 0.5])])
        off = found.x - np.array([np.log(LEVEL), np.log(0.3), np.log(GAIN)])
        errors.append(off / np.sqrt(np.diag(found.covariance)))
        ratios.append(chi_square(problem.seen, found, Band(2.0, 70.0)))
    assert np.sqrt(np.mean(np.square(errors), axis=0)) == pytest.approx(np.ones(3), abs=0.35)
    assert np.mean([ratio for ratio, _ in ratios]) == pytest.approx(1.0, abs=0.02)
    assert max(abs(deviations) for _, deviations in ratios) < 3.7


def test_readings_that_the_model_cannot_make_are_beyond_chance():
    density = _drawn(np.random.default_rng(2))
    density[10:20, 1, 1] *= 4.0
    problem = _problem(density)
    ratio, deviations = chi_square(problem.seen, fit(problem, [problem.mean]), Band(2.0, 70.0))
    assert ratio > 1.1 and deviations > 3.7


def test_a_parameter_stays_nominal_unless_the_record_says_otherwise():
    """Cauchy's prior: a scale of 0.03 does not hold back what is far off, and pulls in what may be chance."""
    problem = _problem(_drawn(np.random.default_rng(3)), spread=0.03)
    assert fit(problem, [problem.mean]).x[2] == pytest.approx(np.log(GAIN), abs=0.1)
    few = problem.seen._replace(number=np.full(len(K), 0.2))
    far = Problem(few, *(getattr(problem, name) for name in list(problem.__dataclass_fields__)[1:]))
    assert abs(fit(far, [far.mean]).x[2]) < 0.5 * np.log(GAIN)
