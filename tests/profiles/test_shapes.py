"""Analytic profiles, wear and smoothing."""

import numpy as np
import pytest

from railsim.profiles.s1002 import depth, s1002
from railsim.profiles.uic60 import uic60
from railsim.profiles.wear import FLANGE_LOSS, HOLLOW_DEPTH, worn


def test_s1002_sections_join() -> None:
    for joint in (-62.764705882, -49.662510381, -39.764473993, -38.426669071, -35.0, -26.0, 32.15796):
        before, after = depth(np.array([joint - 1e-7, joint + 1e-7]))
        assert before == pytest.approx(after, abs=2e-4)  # mm; the published constants leave 0.12 micrometre at -35
    assert depth(np.array([0.0, -55.0])) == pytest.approx([0.0, 28.0])
    wheel = s1002()
    assert wheel.y[[0, -1]] == pytest.approx([-0.070, 0.060])
    slope = wheel.surface().height(-0.039, 1)
    assert np.degrees(np.arctan(slope)) == pytest.approx(70.0, abs=0.01)


def test_uic60_head() -> None:
    rail = uic60()
    assert rail.y == pytest.approx(-rail.y[::-1], abs=1e-12)
    assert 2e3 * np.interp(-0.0143, rail.z[: rail.y.size // 2], rail.y[: rail.y.size // 2]) == pytest.approx(
        -72.0, abs=0.01
    )  # head width 72 mm where the last arcs end
    curvature = rail.surface().height(np.array([0.0, 0.015]), 2)
    slope = rail.surface().height(0.015, 1)
    assert -1 / curvature[0] == pytest.approx(0.3, rel=0.01)
    assert -((1 + slope**2) ** 1.5) / curvature[1] == pytest.approx(0.08, rel=0.01)


@pytest.mark.parametrize("inclination", [1 / 20, 1 / 40])
def test_inclined_rail_leans_to_the_gauge_side(inclination: float) -> None:
    rail = uic60(inclination)
    surface = rail.surface()
    assert surface.top() == pytest.approx(0.0, abs=1e-9)
    assert float(surface.height(0.0)) == pytest.approx(0.0, abs=1e-12)
    if inclination == 1 / 40:  # the axis of the head lies R 300 / 40 to the gauge side of the highest point
        assert float(surface.height(-7.5e-3, 1)) == pytest.approx(inclination, rel=1e-3)
    assert rail.gauge_point(0.014) < -0.04
    with pytest.raises(ValueError, match="does not reach"):
        rail.gauge_point(0.05)
    with pytest.raises(ValueError, match="only rails"):
        s1002().inclined(inclination)


def test_wear_is_linear_smooth_and_leaves_the_ends() -> None:
    new, half, full = (worn(s1002(), severity) for severity in (0.0, 0.5, 1.0))
    assert np.array_equal(new.y, s1002().y)
    assert half.y - new.y == pytest.approx(0.5 * (full.y - new.y), abs=1e-15)
    surface = full.surface()
    assert float(surface.height(0.0)) == pytest.approx(0.0, abs=1e-9)
    rise = full.z - new.z
    assert rise.max() - rise[-1] == pytest.approx(HOLLOW_DEPTH, rel=1e-3)
    assert (new.y - full.y).max() == pytest.approx(FLANGE_LOSS, rel=1e-3)
    assert np.all(np.diff(full.y) > 0.0)
    steepest = np.degrees(np.arctan(np.diff(full.z) / np.diff(full.y)))[full.y[1:] > -0.045].max()
    assert 70.0 < steepest < 80.0
    with pytest.raises(ValueError, match="severity"):
        worn(s1002(), 1.1)


def test_smoothing_keeps_the_tolerance_and_removes_noise() -> None:
    wheel = s1002(spacing=4e-4)
    rng = np.random.default_rng(7)
    noisy = type(wheel)("wheel", wheel.y, wheel.z + rng.normal(0.0, 2e-5, wheel.z.size), "noisy")
    smooth = noisy.smoothed(2e-5).surface()
    tread = np.linspace(-0.03, 0.05, 50)
    exact = wheel.surface().height
    assert smooth.height(tread) - smooth.height(0.02) == pytest.approx(exact(tread) - exact(0.02), abs=3e-5)
    rough = noisy.surface().height(tread, 2)
    assert np.std(smooth.height(tread, 2) - exact(tread, 2)) < 0.05 * np.std(rough - exact(tread, 2))
