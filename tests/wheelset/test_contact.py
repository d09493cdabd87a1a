"""Rolling tables: splines through the given functions, mirrored sides, bad tables refused."""

import numpy as np
import pytest

from railsim.errors import InputError
from railsim.wheelset import WheelsetParameters, cone, cone_conicity, conical, rolling_table
from railsim.wheelset.equations import LEFT, RIGHT, wheel_at

SHIFT = np.linspace(-0.01, 0.01, 81)
RADIUS = 0.45 + 0.1 * SHIFT + 40.0 * SHIFT**3
ANGLE = 0.1 + 120.0 * SHIFT**2


def test_cubics_are_reproduced_on_both_sides():
    table = rolling_table(SHIFT, RADIUS, ANGLE, RADIUS + 1e-3, 2 * ANGLE)
    for u in (-0.01, -0.0043, 0.0, 0.00771, 0.01):
        expected = (0.45 + 0.1 * u + 40 * u**3, 0.1 + 120 * u**2, 240 * u, 0.1 + 120 * u**2)
        np.testing.assert_allclose(wheel_at(table, LEFT, u), expected, rtol=1e-9, atol=1e-9)
        radius, _, _, angle = wheel_at(table, RIGHT, u)
        assert radius == pytest.approx(expected[0] + 1e-3, rel=1e-12)
        assert angle == pytest.approx(2 * expected[3], rel=1e-12)
    assert table.reach == pytest.approx(0.01)


def test_conical_is_equation_1():
    table = conical(0.15, 0.45)
    for y in (-0.02, 0.0, 0.003):
        left, right = wheel_at(table, LEFT, y), wheel_at(table, RIGHT, -y)
        assert (left[0] - right[0]) / 2 == pytest.approx(0.15 * y, abs=1e-16)
        assert (left[0] + right[0]) / 2 == pytest.approx(0.45, rel=1e-15)
        assert (left[3], right[3]) == (0.15, 0.15)


def test_cone_counts_the_shift_of_the_contact_by_roll():
    """Solve phi = slope (y + r0 phi) / l by iteration, as the geometry states it."""
    parameters, slope, y, phi = WheelsetParameters(), 0.1, 1e-3, 0.0
    for _ in range(60):
        phi = slope * (y + parameters.wheel_radius * phi) / parameters.half_width
    assert cone_conicity(slope, parameters) == pytest.approx(phi * parameters.half_width / y, rel=1e-12)
    assert wheel_at(cone(slope, parameters), LEFT, 0.0)[1] == cone_conicity(slope, parameters)


@pytest.mark.parametrize(
    ("shift", "radius", "complaint"),
    [
        (SHIFT**3, RADIUS, "equally spaced"),
        (SHIFT[:3], RADIUS[:3], "at least four"),
        (SHIFT[::-1], RADIUS, "enclose zero"),
        (SHIFT + 0.02, RADIUS, "enclose zero"),
        (SHIFT, RADIUS[:-1], "one finite value"),
        (SHIFT, np.where(SHIFT > 0, np.nan, RADIUS), "one finite value"),
    ],
)
def test_bad_tables_are_refused(shift: np.ndarray, radius: np.ndarray, complaint: str):
    with pytest.raises(InputError, match=complaint):
        rolling_table(shift, radius, np.zeros_like(shift))
