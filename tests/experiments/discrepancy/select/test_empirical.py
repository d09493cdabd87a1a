"""A law without a name: its points are the force at the states that they stand for."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.discrepancy.fit.candidates import Context
from experiments.discrepancy.fit.fitting import Problem, starting_fit
from experiments.discrepancy.screen.latent import LatentForce
from experiments.discrepancy.screen.linear import Place
from experiments.discrepancy.select import empirical
from experiments.discrepancy.select.empirical import tabled_law
from railsim.effects.empirical_force import EmpiricalForce

CONTEXT = Context(("bogie.rate_yaw",), (0.0, 300.0), (0.0, 10.0), ((150.0, 5.0),))


def _force(state: str, slope: float, follows: float = 0.9) -> LatentForce:
    """A force that falls with the state."""
    states = np.linspace(-0.02, 0.03, 16)
    curve = np.column_stack([states, -slope * states, np.full(16, 1.0)])
    return LatentForce(Place("body", "bogie", "yaw"), 0.9, 100.0, np.zeros(1), np.zeros(1), state, curve, follows)


@pytest.mark.parametrize("state", ["relative velocity [rad/s]", "relative displacement [rad]"])
def test_a_law_says_at_every_state_what_its_points_say(problem: Problem, state: str):
    made = tabled_law(
        CONTEXT, _force(state, 2e5), problem.forward.setup(np.zeros(len(problem.forward.nuisances))).model
    )
    assert made is not None
    law, values = made
    assert np.allclose(list(values.values()), 2e5 * np.array(law.states))
    assert list(law.parameters) == list(values)
    effect = law.build(values)
    assert isinstance(effect, EmpiricalForce)
    over = np.array(effect.velocity if law.velocity else effect.displacement)
    table = np.array(effect.force)
    assert np.allclose(table[0] if law.velocity else table[:, 0], 2e5 * over)
    assert over[0] < law.states[0] < law.states[-1] < over[-1]


def test_a_law_that_stiffens_is_followed_between_and_beyond_its_points(problem: Problem):
    """A cubic spring: to a few per cent of its largest force within what was seen, on straight beyond."""
    states = np.linspace(-0.02, 0.02, 16)
    curve = np.column_stack([states, -3e9 * states**3, np.full(16, 1.0)])
    force = LatentForce(
        Place("body", "bogie", "y"), 0.9, 100.0, np.zeros(1), np.zeros(1), "relative displacement [m]", curve, 0.9
    )
    made = tabled_law(CONTEXT, force, problem.forward.setup(np.zeros(len(problem.forward.nuisances))).model)
    assert made is not None
    effect = made[0].build(made[1])
    assert isinstance(effect, EmpiricalForce)
    over, table = np.array(effect.displacement), np.array(effect.force)[:, 0]
    inside = np.abs(over) <= 0.02
    assert np.abs(table - 3e9 * over**3)[inside].max() < 0.02 * 3e9 * 0.02**3
    steepest = np.diff(table)[-2] / np.diff(over)[-2]
    assert np.diff(table)[-1] / np.diff(over)[-1] == pytest.approx(steepest, rel=0.2)


def test_a_force_that_follows_no_state_makes_no_law(problem: Problem):
    model = problem.forward.setup(np.zeros(len(problem.forward.nuisances))).model
    assert tabled_law(CONTEXT, _force("relative velocity [rad/s]", 2e5, follows=0.0), model) is None


def test_a_law_can_be_fitted_as_any_effect(problem: Problem):
    """Twice the force, twice what it changes, while it is small."""
    z = np.zeros(len(problem.forward.nuisances))
    made = tabled_law(CONTEXT, _force("relative velocity [rad/s]", 2e3), problem.forward.setup(z).model)
    assert made is not None
    law, values = made
    base = problem.stacked(problem.forward.predict(z))
    once, twice = (
        problem.stacked(problem.forward.predict(z, (law.build({k: size * v for k, v in values.items()}),))) - base
        for size in (1.0, 2.0)
    )
    assert np.linalg.norm(twice - 2.0 * once) < 0.05 * np.linalg.norm(twice)
    assert np.linalg.norm(once) > 0.0


@pytest.mark.parametrize(("lower", "follows", "count"), [("", 0.5, 1), ("", 0.3, 2), ("wheelset1", 0.5, 1)])
def test_of_two_places_that_are_the_same_the_joint_is_kept(
    monkeypatch: pytest.MonkeyPatch, problem: Problem, lower: str, follows: float, count: int
):
    """The body's yaw is held: on the bogie from outside is between body and bogie."""
    outside = replace(_force("velocity [rad/s]", 2e5, follows), place=Place("bogie", lower, "yaw"), gain=100.01)
    between = _force("relative velocity [rad/s]", 2e5, 0.5)
    monkeypatch.setattr(empirical, "latent_forces", lambda *given: [outside, between])
    found = empirical.likely_forces(problem, starting_fit(problem, np.zeros(len(problem.forward.nuisances))))
    assert len(found) == count
    assert found[0].place.lower
