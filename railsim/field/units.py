"""Units by name: "deg/s", "g", "mm", "km/h" ... to SI."""

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import pydantic

from railsim.errors import InputError, nearest
from railsim.field.durations import HOUR

STANDARD_GRAVITY = 9.80665
"""m/s2, 3rd General Conference on Weights and Measures, 1901."""

Dimension = tuple[float, float, float, float, float, float]
"""Exponents of length, mass, time, electric current, temperature and plane angle."""

_NONE: Dimension = (0, 0, 0, 0, 0, 0)
_LENGTH: Dimension = (1, 0, 0, 0, 0, 0)
_MASS: Dimension = (0, 1, 0, 0, 0, 0)
_TIME: Dimension = (0, 0, 1, 0, 0, 0)
_CURRENT: Dimension = (0, 0, 0, 1, 0, 0)
_TEMPERATURE: Dimension = (0, 0, 0, 0, 1, 0)
_ANGLE: Dimension = (0, 0, 0, 0, 0, 1)
_SPEED: Dimension = (1, 0, -1, 0, 0, 0)
_ACCELERATION: Dimension = (1, 0, -2, 0, 0, 0)
_TURNING: Dimension = (0, 0, -1, 0, 0, 1)
_FREQUENCY: Dimension = (0, 0, -1, 0, 0, 0)
_FORCE: Dimension = (1, 1, -2, 0, 0, 0)
_PRESSURE: Dimension = (-1, 1, -2, 0, 0, 0)
_VOLTAGE: Dimension = (2, 1, -3, -1, 0, 0)
_FLUX: Dimension = (0, 1, -2, -1, 0, 0)
_CURVATURE: Dimension = (-1, 0, 0, 0, 0, 0)
_TURN: Dimension = (-1, 0, 0, 0, 0, 1)


@dataclass(frozen=True)
class Unit:
    """SI value = `factor` * value + `offset`; the offset serves temperatures only."""

    dimension: Dimension
    factor: float
    offset: float = 0.0

    def to_si(self, values: np.ndarray) -> np.ndarray:
        """Values in SI units; the same array where this is an SI unit."""
        if self.factor == 1.0 and self.offset == 0.0:
            return values
        return values * self.factor + self.offset


# NIST Special Publication 811 (2008), Appendix B.8, unless a definition follows from SI.
_WITH_PREFIX = MappingProxyType(
    {
        "m": Unit(_LENGTH, 1.0),
        "s": Unit(_TIME, 1.0),
        "A": Unit(_CURRENT, 1.0),
        "V": Unit(_VOLTAGE, 1.0),
        "N": Unit(_FORCE, 1.0),
        "Pa": Unit(_PRESSURE, 1.0),
        "Hz": Unit(_FREQUENCY, 1.0),
        "rad": Unit(_ANGLE, 1.0),
        "g": Unit(_ACCELERATION, STANDARD_GRAVITY),
        "G": Unit(_ACCELERATION, STANDARD_GRAVITY),
        "dps": Unit(_TURNING, np.pi / 180),
        "T": Unit(_FLUX, 1.0),
        "bar": Unit(_PRESSURE, 1e5),
        "Gal": Unit(_ACCELERATION, 0.01),
    }
)
_WHOLE = MappingProxyType(
    {
        "-": Unit(_NONE, 1.0),
        "1": Unit(_NONE, 1.0),
        "count": Unit(_NONE, 1.0),
        "counts": Unit(_NONE, 1.0),
        "LSB": Unit(_NONE, 1.0),
        "%": Unit(_NONE, 1e-2),
        "‰": Unit(_NONE, 1e-3),
        "kg": Unit(_MASS, 1.0),
        "t": Unit(_MASS, 1e3),
        "lb": Unit(_MASS, 0.45359237),
        "K": Unit(_TEMPERATURE, 1.0),
        "degC": Unit(_TEMPERATURE, 1.0, 273.15),
        "°C": Unit(_TEMPERATURE, 1.0, 273.15),
        "degF": Unit(_TEMPERATURE, 5 / 9, 459.67 * 5 / 9),
        "deg": Unit(_ANGLE, np.pi / 180),
        "°": Unit(_ANGLE, np.pi / 180),
        "degree": Unit(_ANGLE, np.pi / 180),
        "degrees": Unit(_ANGLE, np.pi / 180),
        "radian": Unit(_ANGLE, 1.0),
        "radians": Unit(_ANGLE, 1.0),
        "gon": Unit(_ANGLE, np.pi / 200),
        "rev": Unit(_ANGLE, 2 * np.pi),
        "U": Unit(_ANGLE, 2 * np.pi),
        "rpm": Unit(_TURNING, 2 * np.pi / 60),
        "gn": Unit(_ACCELERATION, STANDARD_GRAVITY),
        "milli-g": Unit(_ACCELERATION, 1e-3 * STANDARD_GRAVITY),
        "sec": Unit(_TIME, 1.0),
        "second": Unit(_TIME, 1.0),
        "seconds": Unit(_TIME, 1.0),
        "msec": Unit(_TIME, 1e-3),
        "min": Unit(_TIME, 60.0),
        "h": Unit(_TIME, HOUR),
        "hr": Unit(_TIME, HOUR),
        "hour": Unit(_TIME, HOUR),
        "meter": Unit(_LENGTH, 1.0),
        "metre": Unit(_LENGTH, 1.0),
        "meters": Unit(_LENGTH, 1.0),
        "metres": Unit(_LENGTH, 1.0),
        "inches": Unit(_LENGTH, 0.0254),
        "feet": Unit(_LENGTH, 0.3048),
        "miles": Unit(_LENGTH, 1609.344),
        "usec": Unit(_TIME, 1e-6),
        "gee": Unit(_ACCELERATION, STANDARD_GRAVITY),
        "g's": Unit(_ACCELERATION, STANDARD_GRAVITY),
        "G's": Unit(_ACCELERATION, STANDARD_GRAVITY),
        "r": Unit(_ANGLE, 2 * np.pi),
        "rps": Unit(_TURNING, 2 * np.pi),
        "mdeg": Unit(_ANGLE, np.pi / 180e3),
        "in": Unit(_LENGTH, 0.0254),
        "inch": Unit(_LENGTH, 0.0254),
        "ft": Unit(_LENGTH, 0.3048),
        "yd": Unit(_LENGTH, 0.9144),
        "chain": Unit(_LENGTH, 20.1168),
        "mi": Unit(_LENGTH, 1609.344),
        "mile": Unit(_LENGTH, 1609.344),
        "mph": Unit(_SPEED, 0.44704),
        "kph": Unit(_SPEED, 1 / 3.6),
        "kmh": Unit(_SPEED, 1 / 3.6),
        "kn": Unit(_SPEED, 1852 / 3600),
        "kt": Unit(_SPEED, 1852 / 3600),
        "kts": Unit(_SPEED, 1852 / 3600),
        "knot": Unit(_SPEED, 1852 / 3600),
        "knots": Unit(_SPEED, 1852 / 3600),
        "lbf": Unit(_FORCE, 4.4482216152605),
        "psi": Unit(_PRESSURE, 6894.757293168),
    }
)
_PREFIXES = MappingProxyType({"n": 1e-9, "u": 1e-6, "m": 1e-3, "c": 1e-2, "d": 0.1, "k": 1e3, "M": 1e6, "G": 1e9})
_FOR: Mapping[tuple[str, Dimension], Unit] = MappingProxyType(
    {
        ("g", _MASS): Unit(_MASS, 1e-3),
        ("mg", _MASS): Unit(_MASS, 1e-6),
        ("G", _FLUX): Unit(_FLUX, 1e-4),
        ("mG", _FLUX): Unit(_FLUX, 1e-7),
        ("1/min", _TURNING): Unit(_TURNING, 2 * np.pi / 60),
        ("min^-1", _TURNING): Unit(_TURNING, 2 * np.pi / 60),
        ("1000/m", _CURVATURE): Unit(_CURVATURE, 1e-3),
        ("10000/m", _CURVATURE): Unit(_CURVATURE, 1e-4),
        ("1e3/m", _CURVATURE): Unit(_CURVATURE, 1e-3),
        ("1e4/m", _CURVATURE): Unit(_CURVATURE, 1e-4),
    }
)
"""Names whose meaning goes by the channel's quantity: gram or gravity, gauss or gravity, revolutions a minute, and a
curvature times 10000 as track-recording cars state it (no track is as curved as 10000 times 1/m)."""
_CAPITALS = MappingProxyType(
    {
        name.lower(): name
        for name in (
            "km/h",
            "kph",
            "kmh",
            "mph",
            "rpm",
            "m/s",
            "m/s2",
            "m/s^2",
            "deg/s",
            "deg",
            "dps",
            "knots",
            "kts",
            "rps",
            "sec",
            "meter",
            "metre",
        )
    }
)
"""Units that stay what they are in capitals."""
_SIMPLE = re.compile(r"(?:(\d+)(?=[A-Za-z]))?([^\d^*/·\s-]+|1|-|milli-g)(?:\^?(-?\d))?")
_SIGNS = MappingProxyType({"º": "°", "µ": "u", "μ": "u", "−": "-", "**": "^", "·": "*", "⋅": "*", "×": "*", "∙": "*"})
_RAISED = re.compile(r"[⁺⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]")
_GEOGRAPHIC = re.compile(r".*\.(latitude|longitude) \[deg\]")
_EXAMPLES: Mapping[Dimension, str] = MappingProxyType(
    {
        _LENGTH: "m, mm, inch, ft",
        _SPEED: "m/s, km/h, mph, kn",
        _ACCELERATION: "m/s2, g, mg",
        _TURNING: "rad/s, deg/s, rpm, rev/s",
        _ANGLE: "rad, deg, rev",
        _CURVATURE: "1/m, 1/km, 10000/m, deg/100ft",
        _TIME: "s, ms, min",
        _NONE: "-, %, mm/m",
    }
)


def parse_unit(text: str, like: Dimension | None = None) -> Unit:
    """The unit that `text` names: a product or quotient of known units, powers as "m/s2", "m/s^2", "m/s**2" or "m s⁻²".

    `like` : dimension of the quantity that is wanted, which decides between meanings of one name (`g`, `G`, `1/min`).

    Raises
    ------
    InputError : a part of it is not known; the line gives the nearest, and those that are known.
    """
    plain = _plain(text)
    if not plain or len(plain) > 40:
        raise InputError(f"'{text[:40]}' is not a unit; write '-' for a pure number")
    if like is not None and (plain, like) in _FOR:
        return _FOR[plain, like]
    if plain in _WHOLE:
        return _WHOLE[plain]
    try:
        return _product(plain, text)
    except InputError:
        other = next((unit for (name, _), unit in _FOR.items() if name == plain), None)
        if other is not None:
            return other
        small = _CAPITALS.get(plain.lower())
        if small is None or small == plain:
            raise
        return parse_unit(small, like)


def _plain(text: str) -> str:
    """One way of writing: no superscripts, one sign for products and powers, no brackets."""
    plain = text.strip().removeprefix("[").removesuffix("]").strip()
    for sign, written in _SIGNS.items():
        plain = plain.replace(sign, written)
    plain = _RAISED.sub(lambda found: "^" + unicodedata.normalize("NFKC", found[0]).replace("−", "-"), plain)
    plain = re.sub(r"(?<=[A-Za-z°])\.(?=[A-Za-z°])", "*", plain)
    if "(" in plain and not re.search(r"\)\s*\^|/\s*\([^)]*/", plain):
        plain = plain.replace("(", "").replace(")", "")
    return plain.replace("km/hr", "km/h")


def _product(plain: str, text: str) -> Unit:
    dimension, factor, below = np.zeros(6), 1.0, False
    for part in re.split(r"([*/\s]+)", plain):
        if not part.strip(" *"):
            continue
        if "/" in part:
            below = True  # all that follows a slash stands below it
            continue
        unit, power = _simple(part, text)
        power = -power if below else power
        dimension += power * np.array(unit.dimension)
        factor *= unit.factor**power
    d = [float(value) for value in dimension]
    return Unit((d[0], d[1], d[2], d[3], d[4], d[5]), factor)


def unit_of(wanted: str) -> pydantic.AfterValidator:
    """For a field that holds a unit: one whose values can go to the SI unit `wanted`."""

    def checked(given: str) -> str:
        converter(given, wanted, "unit")
        return given

    return pydantic.AfterValidator(checked)


def converter(given: str, wanted: str, where: str) -> Unit:
    """The unit `given`, from which values go to the SI unit `wanted`; `where` stands in front of messages.

    Latitude and longitude alone are kept in degrees.

    Raises
    ------
    InputError : either is unknown, they differ in dimension, or `wanted` is no SI unit.
    """
    try:
        target = parse_unit(wanted)
        unit = parse_unit(given, target.dimension)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    if _GEOGRAPHIC.fullmatch(where) and unit.dimension == _ANGLE:
        return Unit(_ANGLE, unit.factor / target.factor)
    if target.factor != 1.0 or target.offset != 0.0:
        raise InputError(f"{where}: channels are kept in SI units; name the target in one, not in '{wanted}'")
    if unit.dimension == _TURN and target.dimension == _CURVATURE:
        return Unit(_CURVATURE, unit.factor)
    if unit.dimension != target.dimension:
        raise InputError(
            f"{where}: '{given}' cannot become '{wanted}', it is another quantity; {_cure(given, unit, target)}"
        )
    return unit


def _cure(given: str, unit: Unit, target: Unit) -> str:
    """What may have been meant."""
    if unit.dimension == _FREQUENCY and target.dimension == _TURNING:
        return "write 'rad/s', or 'rev/s' where it counts revolutions"
    if unit.dimension == _ANGLE and target.dimension == _LENGTH:
        return "keep degrees as '<sensor>.latitude [deg]' and '<sensor>.longitude [deg]'"
    if unit.dimension == _NONE:
        return "counts need 'scale' (unit per count) and the unit of what that gives"
    if target.dimension == _ACCELERATION and re.fullmatch(r"ms[⁻^-].*", given):
        return "'ms' is a millisecond: write 'm s⁻²' or 'm/s2'"
    example = _EXAMPLES.get(target.dimension)
    return f"correct the unit ({example}, ...)" if example else "correct the unit"


def known_units() -> str:
    """All names, for messages."""
    return ", ".join(sorted([*_WITH_PREFIX, *_WHOLE]))


def _simple(part: str, whole: str) -> tuple[Unit, int]:
    match = _SIMPLE.fullmatch(part)
    if match:
        times, name, power = float(match[1] or 1), match[2], int(match[3] or 1)
        base = _WHOLE.get(name) or _WITH_PREFIX.get(name)
        if base is not None:
            return Unit(base.dimension, times * base.factor), power
        base = _WITH_PREFIX.get(name[1:])
        if base is not None and name[0] in _PREFIXES:
            return Unit(base.dimension, times * base.factor * _PREFIXES[name[0]]), power
    meant = nearest(part, [*_WITH_PREFIX, *_WHOLE, *_CAPITALS])
    raise InputError(
        f"unknown unit '{whole}' (at '{part}'); {meant}known are {known_units()}, their products and powers"
    )
