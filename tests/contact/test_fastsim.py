"""FASTSIM against Kalker's printed values, CONTACT's FASTSIM and the Manchester contact benchmark; its limits."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.reporting.size import Size
from experiments.validation.contact_benchmark import BENCHMARK, law_alone, profiles
from experiments.validation.eurosprinter import (
    COULOMB,
    FRICTION,
    KALKER,
    LOAD,
    MODIFIED,
    A,
    B,
    contact_grid,
    coulomb,
    modified,
    reduced,
    reference_curve,
)
from experiments.validation.kalker_1982 import Kalker1982
from experiments.validation.reference import read
from railsim.contact.fastsim import (
    FULL_SLIDING,
    creep_gradient,
    equivalent_slope,
    fastsim_band,
    fastsim_force,
    kalker_1982,
    spiryagin_slope,
)
from railsim.contact.kalker import kalker_coefficients
from railsim.contact.linear import linear_force
from railsim.contact.polach import SHEAR, polach_force
from tests.profiles.reference import needs_reference

CREEPAGE = st.floats(-0.1, 0.1)
AXIS = st.floats(2e-3, 12e-3)
NORMAL = st.floats(1e3, 2e5)
FACTOR = st.floats(0.05, 1.0)


def test_values_printed_by_kalker() -> None:
    """Kalker (1982), 5 x 5 grid: ours opposes the creepage, so Tx is negative for ux = 1."""
    section = Kalker1982()
    assert [row.what for row in section.rows(section.compute(Size.FULL)) if not row.held] == []
    assert kalker_1982(1.0, -2.0, 2.0, 4.0, 5, 5)[0] < 0.0 < kalker_1982(1.0, -2.0, 2.0, 4.0, 5, 5)[1]


@needs_reference
def test_coulomb_series_of_contact() -> None:
    """Within 2 % of mu N with our grid; within 0.2 % of every value on the series' own grid."""
    series = reference_curve(COULOMB)
    assert len(series) == 30
    ours = [coulomb(creepage) for creepage in series[:, 0]]
    assert np.abs(np.array(ours) - series[:, 1]).max() < 0.02 * FRICTION
    same_grid = np.array([contact_grid(c, FRICTION, 1.0) for c in series[:, 0]])
    assert np.abs(same_grid / series[:, 1] - 1.0).max() < 0.002


@needs_reference
def test_backward_first_step_explains_the_series_slope() -> None:
    """Kalker's strips of 44 cells with a whole first step, as in CONTACT: every value of the series within 1 %."""
    series = reference_curve(COULOMB)
    scale = 0.75 * math.pi * SHEAR * A * B * KALKER[0] / (4.0 * FRICTION * LOAD)
    for creepage, expected in series:
        part, _, full = fastsim_band(scale * creepage, 0.0, 0.0, 0.0, -1.0, 1.0, 40, 44, 1.0, 1.0)
        assert -FRICTION * part / full == pytest.approx(expected, rel=0.01)


@needs_reference
def test_modified_series_of_contact() -> None:
    """Slope reduction of Spiryagin et al. (2013) and falling friction, parameters of CONTACT's example tractcurv."""
    series = reference_curve(MODIFIED)
    ours = [reduced(creepage) for creepage in series[:, 0]]
    same_grid = [contact_grid(creepage, *modified(creepage)) for creepage in series[:, 0]]
    assert len(series) == 30
    assert np.abs(np.array(ours) - series[:, 1]).max() < 0.02 * FRICTION
    assert np.abs(np.array(same_grid) / series[:, 1] - 1.0).max() < 0.002


@needs_reference
def test_manchester_contact_benchmark() -> None:
    """Case A-2.2, left wheel: FASTSIM within 10 %, Polach within 15 % of mu N of CONTACT, at all 21 positions.

    From 2 mm on, where the pair is no longer conformal, FASTSIM is within 0.5 %.
    Creepages and normal force as given; ellipse by Hertz from the rolling radius and the curvatures of both profiles at
    the given contact points. Forces and creepages stay in CONTACT's frame: turned about x, both laws are the same.
    """
    pair, rows = profiles(), read(BENCHMARK).to_dict("records")
    assert len(rows) == 21
    for row in rows:
        found = law_alone(pair, row)
        conformal = row["y_ws_mm"] < 2.0
        for law, most in (("FASTSIM", 0.10 if conformal else 0.005), ("Polach", 0.15)):
            for column in (f"{law} law alone Fx", f"{law} law alone Fy"):
                assert abs(found[f"{column}, ours"] - found[f"{column}, CONTACT"]) < most, row["y_ws_mm"]


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


def test_gradient_is_the_linear_force_and_spin_counts_where_it_adds_to_the_lateral_creepage() -> None:
    """Polach (1999): e = pi / 4 times the linear force over mu N; spin makes vy + phi a of vy where that is larger."""
    a, b, limit = 6e-3, 5e-3, 0.3 * 5e4
    along, across, spin = 2e-4, 3e-4, 0.1
    c = kalker_coefficients(a / b)

    def expected(creep_x: float, creep_y: float) -> float:
        return 0.25 * math.pi * math.hypot(*linear_force(creep_x, creep_y, 0.0, a, b, *c)) / limit

    def found(creep_x: float, creep_y: float, phi: float) -> float:
        return creep_gradient(creep_x, creep_y, phi, a, b, c[0], c[1], 5e4, 0.3)

    assert found(along, across, 0.0) == pytest.approx(expected(along, across))
    assert found(0.0, 0.0, spin) == pytest.approx(expected(0.0, spin * a))
    assert found(along, across, spin) == pytest.approx(expected(along, across + spin * a))
    assert found(along, across, -spin / 2.0) == pytest.approx(expected(along, across))
    assert found(along, across, -2.0 * spin) == pytest.approx(expected(along, across - 2.0 * spin * a))
    assert creep_gradient(along, across, spin, a, b, c[0], c[1], 0.0, 0.3) == 0.0


@pytest.mark.parametrize(("decay", "gradient"), [(0.62, 3.0), (2.0, 0.25), (1e-3, 1e4)])
def test_slope_of_the_modified_fastsim_falls_from_its_initial_to_its_last_value(decay: float, gradient: float) -> None:
    """Spiryagin et al. (2013): k0 at e = 0, alpha k0 at large e, and of their difference 1 / (1 + beta e) is left."""
    initial, last = 0.54, 0.54 * 0.02
    assert spiryagin_slope(0.0, initial, 0.02, decay) == pytest.approx(initial)
    assert spiryagin_slope(1e9 / decay, initial, 0.02, decay) == pytest.approx(last, rel=1e-6)
    assert spiryagin_slope(1.0 / decay, initial, 0.02, decay) == pytest.approx(0.5 * (initial + last))
    left = (spiryagin_slope(gradient, initial, 0.02, decay) - last) / (initial - last)
    assert 1.0 / left - 1.0 == pytest.approx(decay * gradient)


@pytest.mark.parametrize(("k_a", "k_s"), [(1.0, 1.0), (1.0, 0.4), (0.3, 0.1), (0.25, 0.28)])
def test_longitudinal_curve_follows_polach_with_the_same_factors(k_a: float, k_s: float) -> None:
    """Both laws share one set of adhesion parameters: within 5 % of mu N over the whole curve."""
    for creepage in np.geomspace(1e-6, 0.3, 40):
        arguments = (creepage, 0.0, 0.0, A, B, *KALKER, LOAD, FRICTION, k_a, k_s)
        assert abs(fastsim_force(*arguments)[0] - polach_force(*arguments)[0]) < 0.05 * FRICTION * LOAD
