"""Hertzian contact against closed forms and published values."""

import warnings

import numpy as np
import pytest

from railsim.contact.hertz import STEEL_POISSON, STEEL_YOUNG, hertz_ellipse

MODULUS = STEEL_YOUNG / (2.0 * (1.0 - STEEL_POISSON**2))
"""Effective modulus of two equal bodies, Pa."""


def test_sphere_on_plane_has_the_closed_form() -> None:
    """Johnson 1985, eqs. 4.22 and 4.23: a^3 = 3 P R / (4 E*), approach = a^2 / R."""
    radius = 0.3
    found = hertz_ellipse(1.0 / radius, 1.0 / radius)
    a = (3.0 * radius / (4.0 * MODULUS)) ** (1.0 / 3.0)
    assert found.longitudinal == pytest.approx(a, rel=1e-9)
    assert found.lateral == pytest.approx(a, rel=1e-9)
    assert found.stiffness == pytest.approx(4.0 / 3.0 * MODULUS * np.sqrt(radius), rel=1e-9)


@pytest.mark.parametrize(
    ("angle", "m", "n"),
    [(30.0, 2.731, 0.493), (50.0, 1.754, 0.641), (60.0, 1.486, 0.717), (75.0, 1.202, 0.846), (90.0, 1.0, 1.0)],
)
def test_ellipse_matches_hertz_table(angle: float, m: float, n: float) -> None:
    """Hertz's table as in Johnson and Timoshenko: semi-axes m, n times (3 P (1 - nu^2) / (2 E (A + B)))^(1/3) with
    cos(angle) = (B - A) / (A + B), sums of curvatures 2 A and 2 B.
    """
    total, difference = 4.0, 4.0 * np.cos(np.radians(angle))
    low, high = 0.5 * (total - difference), 0.5 * (total + difference)
    found = hertz_ellipse(low, high)
    unit = (3.0 * (1.0 - STEEL_POISSON**2) / (STEEL_YOUNG * total)) ** (1.0 / 3.0)
    assert found.longitudinal == pytest.approx(m * unit, rel=2e-3)
    assert found.lateral == pytest.approx(n * unit, rel=2e-3)


def test_axes_follow_the_curvatures() -> None:
    along, across = hertz_ellipse(2.0, 5.0), hertz_ellipse(5.0, 2.0)
    assert along.longitudinal > along.lateral
    assert (along.longitudinal, along.lateral) == (across.lateral, across.longitudinal)
    assert along.stiffness == across.stiffness


def test_conformal_pair_is_refused() -> None:
    with pytest.raises(ValueError, match="positive"):
        hertz_ellipse(2.0, 0.0)


def test_axis_ratio_is_found_without_dividing_rounding_errors():
    """Ratios at which the search's default tolerance, below the mismatch's rounding, made it warn."""
    for ratio in (1.0059497747290904, 1.1105946616582418, 1.2065568902354566, 1.221405728771448, 1.2489311112033876):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            ellipse = hertz_ellipse(1.0, ratio)
        assert ellipse.longitudinal > ellipse.lateral
