"""Units by name: "deg/s", "g", "mm", "km/h" ... to SI."""

import re
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from railsim.errors import InputError

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
        "bar": Unit(_PRESSURE, 1e5),
    }
)
_WHOLE = MappingProxyType(
    {
        "-": Unit(_NONE, 1.0),
        "1": Unit(_NONE, 1.0),
        "count": Unit(_NONE, 1.0),
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
        "gon": Unit(_ANGLE, np.pi / 200),
        "rev": Unit(_ANGLE, 2 * np.pi),
        "rpm": Unit(_TURNING, 2 * np.pi / 60),
        "min": Unit(_TIME, 60.0),
        "h": Unit(_TIME, 3600.0),
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
        "knot": Unit(_SPEED, 1852 / 3600),
        "Gal": Unit(_ACCELERATION, 0.01),
        "lbf": Unit(_FORCE, 4.4482216152605),
        "psi": Unit(_PRESSURE, 6894.757293168),
    }
)
_PREFIXES = MappingProxyType(
    {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "c": 1e-2, "d": 0.1, "k": 1e3, "M": 1e6, "G": 1e9}
)
_SIMPLE = re.compile(r"([^\d^*/·\s-]+|1|-)(?:\^?(-?\d))?")
_SIGNS = MappingProxyType({"²": "^2", "³": "^3", "⁻¹": "^-1", "⁻²": "^-2"})


def parse_unit(text: str) -> Unit:
    """The unit that `text` names: a product or quotient of known units, powers as "m/s2", "m/s^2" or "m/s²".

    Raises
    ------
    InputError : a part of it is not known; the line gives those that are.
    """
    plain = text.strip()
    for sign, written in _SIGNS.items():
        plain = plain.replace(sign, written)
    if not plain or len(plain) > 40:
        raise InputError(f"'{text[:40]}' is not a unit; write '-' for a pure number")
    if plain in _WHOLE:
        return _WHOLE[plain]
    dimension, factor, below = np.zeros(6), 1.0, False
    for part in re.split(r"([*/·\s]+)", plain):
        if not part.strip(" *·/"):
            below = below or "/" in part  # all that follows a slash stands below it
            continue
        unit, power = _simple(part, text)
        power = -power if below else power
        dimension += power * np.array(unit.dimension)
        factor *= unit.factor**power
    d = [float(value) for value in dimension]
    return Unit((d[0], d[1], d[2], d[3], d[4], d[5]), factor)


def converter(given: str, wanted: str, where: str) -> Unit:
    """The unit `given`, from which values go to the SI unit `wanted`; `where` stands in front of messages.

    Raises
    ------
    InputError : either is unknown, they differ in dimension, or `wanted` is no SI unit.
    """
    try:
        unit, target = parse_unit(given), parse_unit(wanted)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    if target.factor != 1.0 or target.offset != 0.0:
        raise InputError(f"{where}: channels are kept in SI units; name the target in one, not in '{wanted}'")
    if unit.dimension != target.dimension:
        raise InputError(f"{where}: '{given}' cannot become '{wanted}', it is another quantity; correct the unit")
    return unit


def known_units() -> str:
    """All names, for messages."""
    return ", ".join(sorted([*_WITH_PREFIX, *_WHOLE]))


def _simple(part: str, whole: str) -> tuple[Unit, int]:
    match = _SIMPLE.fullmatch(part)
    if match:
        name, power = match[1], int(match[2] or 1)
        if name in _WHOLE:
            return _WHOLE[name], power
        if name in _WITH_PREFIX:
            return _WITH_PREFIX[name], power
        base = _WITH_PREFIX.get(name[1:])
        if base is not None and name[0] in _PREFIXES:
            return Unit(base.dimension, base.factor * _PREFIXES[name[0]]), power
    raise InputError(f"unknown unit '{whole}' (at '{part}'); known are {known_units()}, their products and powers")
