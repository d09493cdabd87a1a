"""The latent force finds a force that was put in: its place, its law and its size."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.discrepancy.fit.fitting import Fit, Problem, starting_fit
from experiments.discrepancy.result.planning import nominal_problem
from experiments.discrepancy.screen.latent import LatentForce, latent_forces
from railsim import load_scenario
from railsim.effects.empirical_force import EmpiricalForce

DAMPING = 150e3  # N m s/rad
FAST = 0.2  # rad/s, beyond what happens


@pytest.fixture(scope="module")
def forces() -> list[LatentForce]:
    """What is found where a further yaw damper of 150 kN m s/rad has been hidden."""
    exact = {"vertical_std": 0.0, "lateral_std": 0.0, "cross_level_std": 0.0, "gauge_std": 0.0}
    problem = nominal_problem(load_scenario("yaw_dampers", {"duration": 16.0, "track_errors": exact}))
    hidden = EmpiricalForce(
        upper="body",
        lower="bogie",
        axis="yaw",
        displacement=(-1.0, 1.0),
        velocity=(-FAST, FAST),
        force=((-DAMPING * FAST, DAMPING * FAST),) * 2,
    )
    z = np.zeros(len(problem.forward.nuisances))
    base = problem.stacked(problem.forward.predict(z))
    true = problem.stacked(problem.forward.predict(z, (hidden,)))
    found: Problem = replace(problem, measured=true + _noise(problem))
    empty = np.zeros((0, *problem.measured.shape))
    residual = found.whitened(found.measured - base)
    return latent_forces(found, Fit(z, (), np.zeros(0), (), residual, base, empty, empty))


@pytest.mark.parametrize("known", [False, True])
def test_a_law_that_changes_the_motion_much_is_seen_over_the_motion_with_it(problem: Problem, known: bool):
    """A yaw moment that grows with the square of the rate seems to follow the angle that there would be without it."""
    rate = np.linspace(-0.06, 0.06, 13)
    moment = tuple((2.5e8 * rate * np.abs(rate)).tolist())
    hidden = EmpiricalForce(
        upper="body",
        lower="bogie",
        axis="yaw",
        displacement=(-1.0, 1.0),
        velocity=tuple(rate.tolist()),
        force=(moment, moment),
    )
    home = starting_fit(problem, np.zeros(len(problem.forward.nuisances)))
    there = problem.but(measured=problem.stacked(problem.forward.predict(home.z, (hidden,))))
    found = latent_forces(there, home, motion=replace(home, effects=(hidden,)) if known else None)
    curve = next(one for one in found if (one.place.upper, one.place.lower) == ("body", "bogie"))
    assert curve.state == ("relative velocity [rad/s]" if known else "relative displacement [rad]")


def _noise(problem: Problem) -> np.ndarray:
    """Coefficients of the stated noise."""
    rng = np.random.default_rng(5)
    real, imaginary = rng.standard_normal((2, *problem.measured.shape)) / np.sqrt(2.0)
    assert problem.white is not None
    return np.linalg.solve(problem.white.inverse, (real + 1j * imaginary)[..., None])[..., 0]


def test_the_place_is_the_joint_that_it_acts_in(forces: list[LatentForce]):
    """The body's yaw is held, so that between body and bogie and on the bogie alone are the same."""
    best = forces[0].place
    assert best.direction == "yaw"
    assert "bogie" in (best.upper, best.lower)
    assert forces[0].explained > 0.8


def test_the_curve_is_the_dampers(forces: list[LatentForce]):
    """Force on the body that opposes its velocity relative to the bogie; the smoother shrinks it a little. The state
    is the nominal model's, whose yaw the damper makes smaller.
    """
    curve = next(one for one in forces if (one.place.upper, one.place.lower) == ("body", "bogie"))
    assert "velocity" in curve.state
    slope = np.polyfit(curve.curve[:, 0], curve.curve[:, 1], 1)[0]
    assert -1.1 * DAMPING < slope < -0.6 * DAMPING
