"""FASTSIM against Kalker's printed values, CONTACT's FASTSIM and the Manchester contact benchmark; its limits."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from railsim.contact.fastsim import (
    FULL_SLIDING,
    creep_gradient,
    equivalent_slope,
    fastsim_band,
    fastsim_force,
    fastsim_reduced,
    kalker_1982,
    spiryagin_slope,
)
from railsim.contact.hertz import hertz_ellipse
from railsim.contact.kalker import kalker_coefficients
from railsim.contact.linear import linear_force
from railsim.contact.polach import SHEAR, friction_coefficient, polach_force

REFERENCE = Path(__file__).parents[3] / "shared" / "reference"
needs_reference = pytest.mark.skipif(not REFERENCE.exists(), reason="../shared/reference is not there")

# Eurosprinter case of Polach (2005) as CONTACT's example tractcurv states it
A, B, LOAD, FRICTION, SPEED = 6.304e-3, 12.61e-3, 106.7e3, 0.33, 10.0
KALKER = kalker_coefficients(0.5, 0.28)

CREEPAGE = st.floats(-0.1, 0.1)
AXIS = st.floats(2e-3, 12e-3)
NORMAL = st.floats(1e3, 2e5)
FACTOR = st.floats(0.05, 1.0)


def eurosprinter(series: str) -> np.ndarray:
    """(points, 2): creepage and size of Fx / N."""
    text = (REFERENCE / "contact" / "creep_curves_eurosprinter.csv").read_text()
    rows = [row for row in csv.DictReader(text.splitlines()) if row["series"] == series]
    return np.array([(float(row["creepage_x [-]"]), -float(row["Fx/Fn [-]"])) for row in rows])


def contact_grid(creepage: float, friction: float, slope: float) -> float:
    """Fx / N on the grid of CONTACT's example: 48 x 44 equal cells over 1.1 times the ellipse, backward Euler."""
    columns, rows, scale = 48, 44, 1.1
    step, height = 2.0 * scale / columns, 2.0 * scale / rows
    x = scale - (np.arange(columns) + 0.5) * step
    y = -scale + (np.arange(rows) + 0.5) * height
    bound_0 = friction * 2.0 / (math.pi * A * B)
    growth = creepage * step * A * slope * 3.0 * SHEAR * KALKER[0] / (8.0 * A) / LOAD
    traction, total = np.zeros(rows), 0.0
    for place in x:
        inside = place**2 + y**2 < 1.0
        traction = np.where(inside, np.minimum(traction + growth, bound_0 * (1.0 - place**2 - y**2)), 0.0)
        total += traction.sum()
    return total * step * height * A * B


@pytest.mark.parametrize(
    ("given_values", "x", "y"),
    [
        ((0.0, -2.0, 2.0, 4.0), (0.0, 0.0), (0.1843, 0.1843)),
        ((1.0, -2.0, 2.0, 4.0), (0.5684, 0.5720), (0.1838, 0.1857)),
        ((1.0, -2.0, 2.0, 1.0), (0.4530, 0.4530), (0.8299, 0.8299)),
    ],
)
def test_values_printed_by_kalker(
    given_values: tuple[float, float, float, float], x: tuple[float, float], y: tuple[float, float]
) -> None:
    """Kalker (1982), 5 x 5 grid: sizes; ours opposes the creepage, so Tx is negative for ux = 1."""
    force_x, force_y = kalker_1982(*given_values, 5, 5)
    half_a_digit = 5.1e-5
    assert x[0] - half_a_digit <= -force_x <= x[1] + half_a_digit
    assert y[0] - half_a_digit <= force_y <= y[1] + half_a_digit


@needs_reference
def test_coulomb_series_of_contact() -> None:
    """Within 2 % of mu N with our grid; within 0.2 % of every value on the series' own grid."""
    series = eurosprinter("fastsim_coulomb")
    assert len(series) == 30
    ours = [-fastsim_force(c, 0.0, 0.0, A, B, *KALKER, LOAD, FRICTION, 1.0, 1.0)[0] / LOAD for c in series[:, 0]]
    assert np.abs(np.array(ours) - series[:, 1]).max() < 0.02 * FRICTION
    same_grid = np.array([contact_grid(c, FRICTION, 1.0) for c in series[:, 0]])
    assert np.abs(same_grid / series[:, 1] - 1.0).max() < 0.002


@needs_reference
def test_backward_first_step_explains_the_series_slope() -> None:
    """Kalker's strips of 44 cells with a whole first step, as in CONTACT: every value of the series within 1 %."""
    series = eurosprinter("fastsim_coulomb")
    scale = 0.75 * math.pi * SHEAR * A * B * KALKER[0] / (4.0 * FRICTION * LOAD)
    for creepage, expected in series:
        part, _, full = fastsim_band(scale * creepage, 0.0, 0.0, 0.0, -1.0, 1.0, 40, 44, 1.0, 1.0)
        assert -FRICTION * part / full == pytest.approx(expected, rel=0.01)


@needs_reference
def test_modified_series_of_contact() -> None:
    """Slope reduction of Spiryagin et al. (2013) and falling friction, parameters of CONTACT's example tractcurv."""
    series = eurosprinter("fastsim_modified_falling_friction")
    ours, same_grid = [], []
    for creepage in series[:, 0]:
        friction = friction_coefficient(0.36, 0.38, math.log(2.0) / 0.99, SPEED * creepage)
        gradient = creep_gradient(creepage, 0.0, 0.0, A, B, *KALKER[:2], LOAD, friction)
        slope = spiryagin_slope(0.54 * gradient, 0.54, 0.02, 0.62)
        ours.append(-fastsim_reduced(creepage, 0.0, 0.0, A, B, *KALKER, LOAD, friction, slope, 10, 16)[0] / LOAD)
        same_grid.append(contact_grid(creepage, friction, slope))
    assert len(series) == 30
    assert np.abs(np.array(ours) - series[:, 1]).max() < 0.02 * FRICTION
    assert np.abs(np.array(same_grid) / series[:, 1] - 1.0).max() < 0.002


def profile(name: str) -> np.ndarray:
    """(points, 2): y and z [mm], z down, of a SIMPACK profile."""
    text = (REFERENCE / "profiles" / name).read_text()
    lines = text.split("point.begin")[1].split("point.end")[0].splitlines()
    return np.array([[float(v) for v in line.split()[:2]] for line in lines if line.strip() and "!" not in line])


def curvature(points: np.ndarray, y: float, reach: float = 2.5) -> float:
    """d2z/dy2 over the arc, of a cubic through the points within `reach` of y [1/mm]."""
    near = points[np.abs(points[:, 0] - y) < reach]
    coefficients = np.polyfit(near[:, 0] - y, near[:, 1], 3)
    return float(2.0 * coefficients[1] / (1.0 + coefficients[2] ** 2) ** 1.5)


@needs_reference
def test_manchester_contact_benchmark() -> None:
    """Case A-2.2, left wheel: FASTSIM within 10 %, Polach within 15 % of mu N of CONTACT, at all 21 positions.

    From 2 mm on, where the pair is no longer conformal, FASTSIM is within 0.5 %.
    Creepages and normal force as given; ellipse by Hertz from the rolling radius and the curvatures of both profiles at
    the given contact points. Forces and creepages stay in CONTACT's frame: turned about x, both laws are the same.
    """
    wheel, rail = profile("MBench_S1002_v3.prw"), profile("MBench_UIC60_v3.prr")
    rows = list(csv.DictReader((REFERENCE / "contact" / "mbench_a22_left.csv").read_text().splitlines()))
    assert len(rows) == 21
    for row in rows:
        normal, friction = float(row["Fn_N"]), 0.3
        across = 1e3 * (curvature(rail, -float(row["ycp_rail_mm"])) - curvature(wheel, float(row["ycp_w_mm"])))
        ellipse = hertz_ellipse(1e3 / (460.0 + float(row["zcp_w_mm"])), across)
        a, b = ellipse.longitudinal * math.cbrt(normal), ellipse.lateral * math.cbrt(normal)
        creep = (float(row["creepage_x"]), float(row["creepage_y"]), 1e3 * float(row["spin_rad_mm"]))
        expected = np.array([float(row["Fx_over_muN"]), float(row["Fy_over_muN"])])
        conformal = float(row["y_ws_mm"]) < 2.0
        for law, most in ((fastsim_force, 0.10 if conformal else 0.005), (polach_force, 0.15)):
            force = law(*creep, a, b, *kalker_coefficients(a / b), normal, friction, 1.0, 1.0)
            deviation = np.abs(np.array(force) / (friction * normal) - expected).max()
            assert deviation < most, row["y_ws_mm"]


@settings(max_examples=150)
@given(CREEPAGE, CREEPAGE, st.floats(-2.0, 2.0), AXIS, AXIS, NORMAL, FACTOR, FACTOR)
def test_force_is_odd_mirrored_and_bounded(
    x: float, y: float, spin: float, a: float, b: float, normal: float, k_a: float, k_s: float
) -> None:
    c = kalker_coefficients(a / b)
    f_x, f_y = fastsim_force(x, y, spin, a, b, *c, normal, 0.3, k_a, k_s)
    assert fastsim_force(-x, -y, -spin, a, b, *c, normal, 0.3, k_a, k_s) == pytest.approx((-f_x, -f_y), rel=1e-9)
    mirrored = fastsim_force(x, -y, -spin, a, b, *c, normal, 0.3, k_a, k_s)
    assert mirrored == pytest.approx((f_x, -f_y), rel=1e-9, abs=1e-6)
    assert math.hypot(f_x, f_y) <= 0.3 * normal * (1.0 + 1e-12)
    without_spin = fastsim_force(x, y, 0.0, a, b, *c, normal, 0.3, k_a, k_s)
    assert without_spin[0] * x + without_spin[1] * y <= 0.0


@settings(max_examples=60)
@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), AXIS, AXIS, NORMAL, FACTOR, FACTOR)
def test_small_creepage_and_spin_together_follow_kalker(
    x: float, y: float, spin: float, a: float, b: float, normal: float, k_a: float, k_s: float
) -> None:
    """The whole linear law, creepages and spin combined, times (kA + kS) / 2; within 1 % of its size."""
    c = kalker_coefficients(a / b)
    small = 1e-5 * 0.3 * normal / (SHEAR * a * b)
    creep = (small * x, small * y, small * spin / math.sqrt(a * b))
    expected = 0.5 * (k_a + k_s) * np.array(linear_force(*creep, a, b, *c))
    size = 0.5 * (k_a + k_s) * SHEAR * a * b * small * (c[0] * abs(x) + c[1] * abs(y) + c[2] * abs(spin))
    found = np.array(fastsim_force(*creep, a, b, *c, normal, 0.3, k_a, k_s, 24, 24))
    assert np.abs(found - expected).max() <= 0.01 * size + 1e-12


@pytest.mark.parametrize(("strips", "cells"), [(3, 4), (10, 16), (40, 40)])
def test_full_sliding_is_friction_times_load_against_the_slip_on_any_grid(strips: int, cells: int) -> None:
    force = fastsim_force(0.3, -0.4, 0.0, 6e-3, 5e-3, 4.2, 3.7, 1.5, 5e4, 0.3, 1.0, 1.0, strips, cells)
    assert force == pytest.approx((-0.6 * 0.3 * 5e4, 0.8 * 0.3 * 5e4), rel=0.005)
    assert math.hypot(*force) == pytest.approx(0.3 * 5e4, rel=1e-6)


def test_lifted_wheel_has_no_force() -> None:
    assert fastsim_force(0.01, 0.01, 0.1, 6e-3, 5e-3, 4.2, 3.7, 1.5, 0.0, 0.3, 1.0, 1.0) == (0.0, 0.0)


def test_reduced_force_is_continuous_where_only_spin_is_left() -> None:
    c = kalker_coefficients(1.2)
    spin_only = fastsim_force(0.0, 0.0, 0.5, 6e-3, 5e-3, *c, 5e4, 0.3, 1.0, 0.4)
    for x, y in ((1e-9, 0.0), (0.0, 1e-9), (-1e-9, -1e-9)):
        assert fastsim_force(x, y, 0.5, 6e-3, 5e-3, *c, 5e4, 0.3, 1.0, 0.4) == pytest.approx(spin_only, abs=0.1)


@settings(max_examples=100)
@given(st.floats(1e-3, 1e4), FACTOR, FACTOR)
def test_equivalent_slope_gives_the_force_of_both_factors(gradient: float, k_a: float, k_s: float) -> None:
    reached = gradient * equivalent_slope(gradient, k_a, k_s)
    adhesion = k_a * gradient
    expected = adhesion / (1.0 + adhesion**2) + math.atan(k_s * gradient)
    found = reached / (1.0 + reached**2) + math.atan(reached)
    if k_a == k_s:
        assert reached == pytest.approx(k_a * gradient)
    else:
        assert found == pytest.approx(min(expected, FULL_SLIDING), rel=1e-6)


@pytest.mark.parametrize(("k_a", "k_s"), [(1.0, 1.0), (1.0, 0.4), (0.3, 0.1), (0.25, 0.28)])
def test_longitudinal_curve_follows_polach_with_the_same_factors(k_a: float, k_s: float) -> None:
    """Both laws share one set of adhesion parameters: within 5 % of mu N over the whole curve."""
    for creepage in np.geomspace(1e-6, 0.3, 40):
        arguments = (creepage, 0.0, 0.0, A, B, *KALKER, LOAD, FRICTION, k_a, k_s)
        assert abs(fastsim_force(*arguments)[0] - polach_force(*arguments)[0]) < 0.05 * FRICTION * LOAD
