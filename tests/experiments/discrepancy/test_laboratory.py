"""Both laboratory systems: measured records where they are at hand, simulated ones by another scheme everywhere."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments.discrepancy.core.curve import curve
from experiments.discrepancy.core.model import Hypothesis
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import Problem
from experiments.discrepancy.core.search import infer
from experiments.discrepancy.systems import balls, double_pendulum, laboratory, pendulum
from railsim.errors import InputError
from tests.profiles.reference import REFERENCE, needs_reference

SHORT = 900  # samples of 4 ms
UNKNOWING = pendulum.LIBRARY.without(*pendulum.FRICTIONS)


def swinging(seed: int, dry: float = 0.0, viscous: float = 0.0, amplitude: float = 0.8) -> np.ndarray:
    """Angle by an encoder, by leapfrog with steps of a quarter millisecond (symplectic without friction)."""
    rng, h = np.random.default_rng(seed), 2.5e-4
    angle, rate, seen = amplitude, 0.0, []

    def acceleration(angle: float, rate: float) -> float:
        return -61.0 * np.sin(angle) - dry * np.sign(rate) - viscous * rate

    for step in range(16 * SHORT):
        if step % 16 == 0:
            seen.append(angle)
        half = rate + 0.5 * h * acceleration(angle, rate)
        angle += h * half
        rate = half + 0.5 * h * acceleration(angle, half)
    return pendulum.HANGS + np.array(seen) + 1e-3 * rng.standard_normal(len(seen))


@pytest.mark.parametrize(("seed", "amplitude"), [(1, 0.8), (4, 1.4)])
def test_a_frictionless_pendulum_misses_nothing(seed: int, amplitude: float):
    assert str(infer(pendulum.Pendulum(swinging(seed, amplitude=amplitude)), pendulum.LIBRARY).action) == "none"


def test_dry_friction_is_named_with_its_size():
    verdict = infer(pendulum.Pendulum(swinging(2, dry=0.5)), pendulum.LIBRARY)
    assert verdict.action.families == ("dry friction",)
    row = next(row for row in verdict.rows if row.fit.hypothesis.name == "dry friction")
    assert np.exp(row.fit.x[-1]) == pytest.approx(0.5, rel=0.15)


def test_friction_of_four_records_predicts_two_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Swings of 1.2 to 0.5 rad by one joint; of two frictions the one that is there."""
    monkeypatch.setattr(laboratory, "ENCODER", 1e-3)
    for number, name in enumerate((*laboratory.LEARNED, *laboratory.PREDICTED)):
        angle = swinging(20 + number, dry=0.4, amplitude=1.2 - 0.14 * number)
        told = pd.DataFrame({"time [s]": 0.004 * np.arange(len(angle)), "angle [rad]": angle})
        told.to_csv(tmp_path / laboratory.PENDULUM.format(name), index=False)
    for nothing, friction in laboratory.predicted_powers(tmp_path, ("dry friction", "viscous friction")).values():
        assert nothing > 2.0
        assert friction == pytest.approx(1.0, abs=0.2)


def test_friction_that_the_library_lacks_is_an_unknown_law_of_the_rate_with_its_curve():
    system = pendulum.Pendulum(swinging(3, dry=0.4, viscous=0.1))
    verdict = infer(system, UNKNOWING)
    assert verdict.action.place == "law of the rate"
    row = next(row for row in verdict.rows if row.fit.hypothesis.name == "unknown: law of the rate")
    states = np.array([-4.0, -2.0, 2.0, 4.0])
    cross = system.law(row.fit.x, (), "law of the rate", states)
    own = np.full(4, (pendulum.TORQUE * np.exp(row.fit.x[0])) ** 2)
    found = curve(row.fit, [level.name for level in system.levels].index("law of the rate"), states, cross, own)
    true = -0.4 * np.sign(states) - 0.1 * states
    assert (np.abs(found.mean - true) < 3.0 * found.deviation + 0.05).all()
    assert (found.deviation < 0.5 * np.abs(true)).all()


def test_the_linearised_pendulum_is_that_of_itsmotion():
    """Responses to a start's error and to a torque against differences of the nonlinear motion."""
    system = pendulum.Pendulum(swinging(4))
    x = system.starts()[0]
    problem = Problem(system, Hypothesis(), Policy())
    motion = system.motion(x[None], ())[0]
    start, _ = system.response(x, motion, ())
    moved = pendulum.Pendulum(system.angle)
    moved.__dict__["begins"] = system.begins + np.array([0.01 * pendulum.START_ERROR[0], 0.0])
    difference = problem.residuals(x[None])[0] - Problem(moved, Hypothesis(), Policy()).residuals(x[None])[0]
    windows = len(system.windows)
    predicted = 0.01 * start[:, 0::2].sum(axis=1)
    assert windows > 2 and difference.ravel() == pytest.approx(predicted, abs=0.03 * np.abs(predicted).max())


def test_a_falling_ball_reaches_its_terminal_speed():
    """Quadratic drag: v = v_t tanh(g t / v_t), height falls by v_t^2 / g log cosh(g t / v_t)."""
    time = np.arange(0.0, 3.0, 1.0 / 15.0)
    drop = np.column_stack([time, np.zeros_like(time)])
    ball = balls.Ball("whiffle_1", (drop,))
    x = np.array([one.mean for one in ball.coordinates])
    x[2] = 0.0
    quadratic = balls.LIBRARY.effects[0]
    height = ball.predict(np.append(x, np.log(0.5))[None], (quadratic,))[0].ravel()
    gravity = balls.GRAVITY * ball.weight
    terminal = np.sqrt(gravity / (0.5 * balls.AIR * 0.5 * ball.area_by_mass))
    fallen = terminal**2 / gravity * np.log(np.cosh(gravity * time / terminal))
    assert height == pytest.approx(-fallen, abs=5e-3)


def swung(seed: int = 3) -> tuple[double_pendulum.DoublePendulum, np.ndarray]:
    """A record that begins anywhere, and a point of the model."""
    rng = np.random.default_rng(seed)
    angles = np.pi + 0.3 * np.cumsum(rng.standard_normal((2, 1200)), axis=1) / 100.0
    x = np.concatenate([np.log([0.45, 0.5, 60.0, 25.0]), np.zeros(4)])
    return double_pendulum.DoublePendulum(angles), x


def test_a_double_pendulum_without_friction_keeps_its_energy():
    """Kinetic energy v^2 / 2 + B cos(p - q) v w + C w^2 / 2, potential energy -G cos p - H cos q."""
    system, x = swung()
    p, q, v, w = np.moveaxis(system.motion(x[None], ())[0], -1, 0)
    energy = 0.5 * v**2 + 0.45 * np.cos(p - q) * v * w + 0.25 * w**2 - 60.0 * np.cos(p) - 25.0 * np.cos(q)
    assert np.ptp(energy, axis=1).max() < 1e-4 * 60.0
    dry = double_pendulum.LIBRARY.effects[1]
    p, q, v, w = np.moveaxis(system.motion(np.append(x, np.log(0.5))[None], (dry,))[0], -1, 0)
    lost = 0.5 * v**2 + 0.45 * np.cos(p - q) * v * w + 0.25 * w**2 - 60.0 * np.cos(p) - 25.0 * np.cos(q)
    assert (lost[:, -1] < lost[:, 0]).all()


def test_small_oscillations_of_a_double_pendulum_have_its_two_frequencies():
    """Eigenvalues of [[G, 0], [0, H]] by [[1, B], [B, C]]."""
    mass, stiffness = np.array([[1.0, 0.45], [0.45, 0.5]]), np.diag([60.0, 25.0])
    values, shapes = np.linalg.eig(np.linalg.solve(mass, stiffness))
    build = double_pendulum.built(np.log([[0.45, 0.5, 60.0, 25.0]]), ())[0, 0]
    for value, shape in zip(values, shapes.T, strict=True):
        slope = double_pendulum.slope(np.array([*(1e-4 * shape), 0.0, 0.0]), build, 0.0)
        assert slope[2:] == pytest.approx(-value * 1e-4 * shape, rel=1e-5)


def test_the_linearised_double_pendulum_is_that_of_its_motion():
    system, x = swung()
    motion = system.motion(x[None], ())[0]
    start, _ = system.response(x, motion, ())
    moved = double_pendulum.DoublePendulum(system.angles)
    moved.__dict__["begins"] = system.begins + 0.01 * np.repeat(double_pendulum.START_ERROR, 2)
    difference = (moved.predict(x[None], ())[0] - system.predict(x[None], ())[0]).ravel()
    predicted = 0.01 * start.sum(axis=1)
    assert difference == pytest.approx(predicted, abs=0.03 * np.abs(predicted).max())


@needs_reference
def test_a_measured_ball_of_plastic_has_drag():
    drops = balls.read_drops(REFERENCE / "lab" / "ball_drops.csv")
    verdict = infer(balls.Ball("whiffle_1", tuple(drops["whiffle_1"])), balls.LIBRARY)
    assert verdict.action.families == ("drag",)


def test_files_that_are_not_there_are_refused(tmp_path: Path):
    with pytest.raises(InputError, match="cannot read drops of balls"):
        balls.read_drops(tmp_path / "none.csv")
    (tmp_path / "other.csv").write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match="cannot read a pendulum's record"):
        pendulum.read_pendulum(tmp_path / "other.csv")
