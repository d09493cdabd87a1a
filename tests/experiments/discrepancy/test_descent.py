"""The descent of the mean: products, secants, and its end against an optimiser that shares no code."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.optimize import minimize

from experiments.discrepancy.core.descent import Descent
from experiments.discrepancy.core.fitting import fit
from experiments.discrepancy.core.levels import sums
from experiments.discrepancy.core.model import Coordinate, Effect, Group, Hypothesis, Level, Still
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.priors import LogNormal
from experiments.discrepancy.core.problem import Problem, between, whitened


@dataclass(frozen=True, eq=False)
class Decay(Still):
    """size exp(-rate t) with white noise: bent in both coordinates."""

    seen: np.ndarray
    cheap: bool = False
    levels: tuple[Level, ...] = (Level("noise", "sensor", LogNormal(1.0, 0.3)),)
    time: np.ndarray = field(default_factory=lambda: np.linspace(0.0, 3.0, 40))

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return (Coordinate("log size", "-", 0.0, 0.5, cheap=self.cheap), Coordinate("log rate", "-", 0.0, 0.5))

    @property
    def observed(self) -> tuple[np.ndarray, ...]:
        return (self.seen[None, None],)

    def starts(self) -> np.ndarray:
        return np.zeros((1, 2))

    def predict(self, points: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        size, rate = np.exp(points).T
        return ((size[:, None] * np.exp(-rate[:, None] * self.time))[:, None, None],)

    def covariances(self, x: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        return (0.01**2 * np.eye(len(self.time))[None, None],)


def decay(cheap: bool = False) -> Problem:
    """Of a record far from the priors' means."""
    rng = np.random.default_rng(5)
    time = np.linspace(0.0, 3.0, 40)
    seen = 2.0 * np.exp(-2.5 * time) + 0.01 * rng.standard_normal(len(time))
    return Problem(Decay(seen, cheap), Hypothesis(), Policy())


def descent(problem: Problem, *, thorough: bool = False) -> Descent:
    """At the nominal build, levels held."""
    x = np.zeros(2)
    groups = problem.groups(x, problem.system.covariances(x, ()))
    slopes = problem.slopes(x, groups)
    return Descent(problem, x, np.zeros(1), groups, slopes, free=False, fresh=True, thorough=thorough)


def test_products_in_the_inverse_covariance_are_those_of_whitened_values() -> None:
    rng = np.random.default_rng(1)
    draw = lambda *shape: rng.standard_normal(shape) + 1j * rng.standard_normal(shape)  # noqa: E731
    root = draw(3, 2, 4, 4)
    components = root @ np.conj(np.swapaxes(root, -1, -2))
    parts, psi = sums([Group(draw(2, 5, 4), components)]), np.array([0.1, -0.4, 0.3])
    left, right = [draw(20, 2, 5, 4)], [draw(3, 2, 5, 4)]
    expected = whitened(parts, psi, left) @ whitened(parts, psi, right).T
    assert between(parts, psi, left, right) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("cheap", [False, True])
def test_after_a_step_the_slopes_say_what_it_did(cheap: bool) -> None:
    way = descent(decay(cheap))
    before, slopes = way.groups[0].residual, way.slopes[0].copy()
    way.run(1)
    missed = before - way.groups[0].residual - np.tensordot(way.x, way.slopes[0], 1)
    plain = before - way.groups[0].residual - np.tensordot(way.x, slopes, 1)
    if cheap:  # its slope is that of the new point: half of what changed in it belongs to the step
        missed += 0.5 * way.x[0] * (way.slopes[0] - slopes)[0]
    assert np.abs(missed).max() < 1e-9 < 1e-3 < np.abs(plain).max()


def test_curvature_follows_the_slopes() -> None:
    way = descent(decay(cheap=True)).run(1)
    assert way.curvature == pytest.approx(between(way.parts, way.psi, way.slopes, way.slopes), rel=1e-6)


def test_it_ends_where_another_optimiser_ends() -> None:
    problem = decay()
    seen, time = problem.system.observed[0][0, 0], np.linspace(0.0, 3.0, 40)

    def cost(x: np.ndarray) -> float:
        left = seen - np.exp(x[0] - np.exp(x[1]) * time)
        return 0.5 * float(np.sum(left**2)) / 0.01**2 + 0.5 * float(np.sum(x**2)) / 0.5**2

    best = minimize(cost, np.zeros(2), method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-9}).x
    assert descent(problem, thorough=True).run(40).x == pytest.approx(best, abs=2e-3)
    found = fit(problem, np.zeros(2))
    assert found is not None
    assert found.x == pytest.approx([np.log(2.0), np.log(2.5)], abs=0.02)
