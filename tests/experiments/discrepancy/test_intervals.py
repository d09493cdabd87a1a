"""Intervals of a fit: from drawn errors, against closed forms of least squares with other errors than assumed."""

from dataclasses import dataclass

import numpy as np
import pytest

from experiments.discrepancy.core import intervals
from experiments.discrepancy.core.fitting import fit
from experiments.discrepancy.core.model import Effect, Hypothesis
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import Problem
from tests.experiments.discrepancy.toy import Line, line


@dataclass(frozen=True, eq=False)
class Loud(Line):
    """A line whose errors are `times` as large as its covariances say."""

    times: float = 1.0

    def errors(
        self, x: np.ndarray, effects: tuple[Effect, ...], psi: np.ndarray, count: int, rng: np.random.Generator
    ) -> tuple[np.ndarray, ...]:
        covariance = np.tensordot(np.exp(2.0 * psi), self.covariances(x, effects)[0][:, 0], 1)
        return (self.times * rng.multivariate_normal(np.zeros(len(self.seen)), covariance, count)[:, None, None],)


def diagonal(system: Line) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Variances: by drawn errors, by second derivatives, and by least squares with errors of twice the size."""
    found = fit(Problem(system, Hypothesis(), Policy()), np.zeros(2))
    assert found is not None
    design = np.stack([np.ones_like(system.time), system.time], axis=1)
    assumed = np.tensordot(np.exp(2.0 * found.psi), system.covariances(found.x, ())[0][:, 0], 1)
    prior, gain = np.diag([1.0, 100.0]), np.linalg.solve(assumed, design)
    inverse = np.linalg.inv(prior + design.T @ gain)
    twice = inverse @ (prior + 4.0 * gain.T @ assumed @ gain) @ inverse
    spread = intervals.covariance(found, np.random.default_rng(2))
    return np.diag(spread), np.diag(np.linalg.inv(found.precision)), np.diag(twice)


def test_errors_as_assumed_leave_the_interval_as_it_is(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(intervals, "DRAWS", 4000)
    drawn, curvature, _ = diagonal(Loud(line(3, drift=0.1)))
    assert drawn == pytest.approx(curvature, rel=0.1)


def test_errors_of_twice_the_size_widen_it_as_least_squares_says(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(intervals, "DRAWS", 4000)
    drawn, curvature, twice = diagonal(Loud(line(3, drift=0.1), times=2.0))
    assert drawn == pytest.approx(twice, rel=0.1)
    assert (drawn > 1.5 * curvature).any()


def test_a_system_that_draws_no_errors_has_its_second_derivatives():
    drawn, curvature, _ = diagonal(Line(line(3, drift=0.1)))
    assert drawn == pytest.approx(curvature, rel=1e-12)
