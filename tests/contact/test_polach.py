"""Polach's creep force: saturation, symmetry, Kalker's limit, and FASTSIM's curve."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.validation import eurosprinter
from experiments.validation.eurosprinter import COULOMB, polach, reference_curve
from railsim.contact.kalker import kalker_coefficients
from railsim.contact.polach import SHEAR, friction_coefficient, polach_force
from tests.profiles.reference import needs_reference

CREEPAGE = st.floats(-0.3, 0.3)
SPIN = st.floats(-2.0, 2.0)
AXIS = st.floats(1e-3, 12e-3)
LOAD = st.floats(1e3, 2e5)
FRICTION = st.floats(0.02, 0.7)
FACTOR = st.floats(0.05, 1.0)


def force(
    x: float,
    y: float,
    spin: float,
    a: float,
    b: float,
    load: float,
    friction: float,
    k_a: float = 1.0,
    k_s: float = 1.0,
) -> tuple[float, float]:
    """Creep force with Kalker's coefficients of the ellipse."""
    return polach_force(x, y, spin, a, b, *kalker_coefficients(a / b), load, friction, k_a, k_s)


@settings(max_examples=300)
@given(CREEPAGE, CREEPAGE, SPIN, AXIS, AXIS, LOAD, FRICTION, FACTOR, FACTOR)
def test_force_is_odd_bounded_and_dissipates_in_translation(
    x: float, y: float, spin: float, a: float, b: float, load: float, friction: float, k_a: float, k_s: float
) -> None:
    f_x, f_y = force(x, y, spin, a, b, load, friction, k_a, k_s)
    assert force(-x, -y, -spin, a, b, load, friction, k_a, k_s) == pytest.approx((-f_x, -f_y), rel=1e-12, abs=1e-9)
    assert force(x, -y, -spin, a, b, load, friction, k_a, k_s) == pytest.approx((f_x, -f_y), rel=1e-12, abs=1e-9)
    assert math.hypot(f_x, f_y) <= friction * load * (1.0 + 1e-12)
    assert f_x * x <= 0.0
    without_spin = force(x, y, 0.0, a, b, load, friction, k_a, k_s)
    assert without_spin[0] * x + without_spin[1] * y <= 0.0


@settings(max_examples=100)
@given(st.floats(0.0, 2.0 * math.pi), AXIS, AXIS, st.floats(1e4, 1e5), FRICTION)
def test_large_slip_saturates_at_friction(angle: float, a: float, b: float, load: float, friction: float) -> None:
    slip = 1e6 * friction * load / (SHEAR * a * b)
    f_x, f_y = force(slip * math.cos(angle), slip * math.sin(angle), 0.0, a, b, load, friction)
    assert math.hypot(f_x, f_y) == pytest.approx(friction * load, rel=1e-4)
    assert (f_x, f_y) == pytest.approx(
        (-friction * load * math.cos(angle), -friction * load * math.sin(angle)), rel=1e-3, abs=1e-3 * friction * load
    )


@settings(max_examples=100)
@given(AXIS, AXIS, st.floats(1e4, 1e5), st.floats(0.1, 0.7), FACTOR, FACTOR)
def test_small_pure_creepages_follow_kalker(
    a: float, b: float, load: float, friction: float, k_a: float, k_s: float
) -> None:
    """The slope of translation is (kA + kS) / 2 of Kalker's; spin keeps his."""
    c11, c22, c23 = kalker_coefficients(a / b)
    small = 1e-4 * friction * load / (SHEAR * a * b)
    slope = 0.5 * (k_a + k_s) * SHEAR * a * b
    assert force(small, 0.0, 0.0, a, b, load, friction, k_a, k_s)[0] == pytest.approx(-slope * c11 * small, rel=0.01)
    assert force(0.0, small, 0.0, a, b, load, friction, k_a, k_s)[1] == pytest.approx(-slope * c22 * small, rel=0.01)
    spin = small / math.sqrt(a * b)
    expected = -SHEAR * (a * b) ** 1.5 * c23 * spin
    assert force(0.0, 0.0, spin, a, b, load, friction, k_a, k_s)[1] == pytest.approx(expected, rel=0.01)


def test_direction_at_small_creepage_lies_between_the_pure_slopes() -> None:
    """Not Kalker's: the resultant's slope goes from C11 to C22 with the direction, and the force opposes the slip."""
    a, b, small = 6e-3, 5e-3, 1e-8
    c11, c22, _ = kalker_coefficients(a / b)
    f_x, f_y = force(small, small, 0.0, a, b, 7e4, 0.4)
    assert f_x == pytest.approx(f_y, rel=1e-12)
    assert -f_x / (SHEAR * a * b * small) == pytest.approx(math.sqrt(0.5 * (c11**2 + c22**2)), rel=1e-4)


def test_lifted_wheel_has_no_force() -> None:
    assert force(0.01, 0.01, 0.1, 6e-3, 5e-3, 0.0, 0.4) == (0.0, 0.0)


def test_friction_falls_with_slip_speed() -> None:
    """Polach 2005, eq. 9."""
    assert friction_coefficient(0.55, 0.4, 0.6, 0.0) == pytest.approx(0.55)
    assert friction_coefficient(0.55, 0.4, 0.6, 1e3) == pytest.approx(0.22)
    assert friction_coefficient(0.55, 0.4, 0.6, 1.0) == pytest.approx(0.55 * (0.6 * math.exp(-0.6) + 0.4))
    assert friction_coefficient(0.55, 1.0, 0.6, 1.0) == 0.55


@needs_reference
@pytest.mark.parametrize(("series", "most"), [(COULOMB, 0.04), ("contact_coulomb", 0.07)])
def test_longitudinal_curve_is_near_fastsim_and_contact(series: str, most: float) -> None:
    """Eurosprinter wheel of Polach 2005 with Coulomb friction: largest deviation as a share of mu N."""
    curve = reference_curve(series)
    found = np.array(
        [polach(creepage, eurosprinter.FRICTION, np.array([1.0, 1.0, 1.0, 0.0])) for creepage in curve[:, 0]]
    )
    assert len(curve) > 20
    assert np.abs(found - curve[:, 1]).max() < most * eurosprinter.FRICTION
