"""Units by name against their definitions."""

import numpy as np
import pytest

from railsim.errors import InputError
from railsim.field.units import converter, parse_unit

# NIST SP 811 (2008), Appendix B.8, and definitions
VALUES = [
    ("deg/s", "rad/s", 180.0, np.pi),
    ("°/s", "rad/s", 90.0, np.pi / 2),
    ("rpm", "rad/s", 60.0, 2 * np.pi),
    ("rev/min", "rad/s", 60.0, 2 * np.pi),
    ("g", "m/s2", 1.0, 9.80665),
    ("mg", "m/s²", 1000.0, 9.80665),
    ("m/s/s", "m/s2", 3.0, 3.0),
    ("m s-2", "m/s2", 3.0, 3.0),
    ("mm/s^2", "m/s2", 1000.0, 1.0),
    ("mm", "m", 1.5, 0.0015),
    ("µm", "m", 1.0, 1e-6),
    ("km/h", "m/s", 36.0, 10.0),
    ("mph", "m/s", 1.0, 0.44704),
    ("ft", "m", 1.0, 0.3048),
    ("inch", "m", 1.0, 0.0254),
    ("kn", "m/s", 1.0, 1852 / 3600),
    ("1/km", "1/m", 2.0, 0.002),
    ("kN/mm", "N/m", 1.0, 1e6),
    ("‰", "-", 12.0, 0.012),
    ("degC", "K", 20.0, 293.15),
    ("degF", "K", 32.0, 273.15),
    ("ms", "s", 250.0, 0.25),
    ("min", "s", 2.0, 120.0),
]


@pytest.mark.parametrize(("given", "wanted", "value", "result"), VALUES)
def test_conversion(given: str, wanted: str, value: float, result: float):
    assert converter(given, wanted, "x").to_si(np.array([value]))[0] == pytest.approx(result, rel=1e-14)


@pytest.mark.parametrize(
    ("given", "wanted", "line"),
    [
        ("m/s", "rad/s", "x: 'm/s' cannot become 'rad/s', it is another quantity"),
        ("Hz", "rad/s", "another quantity"),
        ("deg", "rad/s", "another quantity"),
        ("furlong", "m", "unknown unit 'furlong'.*known are"),
        ("", "m", "is not a unit"),
        ("m//", "rad", "another quantity"),
        ("m/s", "km/h", "kept in SI units"),
        ("m^9^9", "m", "unknown unit"),
    ],
)
def test_wrong_unit_is_one_clear_line(given: str, wanted: str, line: str):
    with pytest.raises(InputError, match=line) as caught:
        converter(given, wanted, "x")
    assert "\n" not in str(caught.value)


def test_prefixes_do_not_hide_whole_units():
    assert parse_unit("min").factor == 60.0
    assert parse_unit("ft").factor == 0.3048
    assert parse_unit("mg").factor == pytest.approx(9.80665e-3)
