"""Vertical reduction of the half vehicle: bounce of bogie and body and pitch of the bogie, wheelsets as given motions.

With w_1, w_2 the heights of the leading and trailing wheelset, primary stiffness k_p and damping c_p of an axlebox,
secondary k_s and c_s of a side, semi wheelbase b, bogie of mass m and inertia I, body of mass M, z up, pitch nose down:

    m z'' + (4 c_p s + 4 k_p) z + Z(s) z = (2 k_p + 2 c_p s) (w_1 + w_2)
    Z(s) = 2 (k_s + c_s s) M s^2 / (M s^2 + 2 c_s s + 2 k_s)
    I pitch'' + 4 b^2 (c_p s + k_p) pitch = -b (2 k_p + 2 c_p s) (w_1 - w_2)

A bogie that a traction rod joins to the body also surges on it, and its height over the rod turns that into pitch.
Bogie and wheelsets then have a coordinate along the track each; the body holds its speed. A wheelset rolls: to its mass
comes I / r^2.

After section 5.1 of Ward et al. 2011 (Fig. 17; references 38-41 there). Two uses: the equations of motion over the
rails, and their inverse, the wheelsets' motion from that of the bogie.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from estimators.vehicle.linear_model import Element, Kinematics, reduce
from estimators.vehicle.parameters import VEHICLES, numbers, positive_numbers
from estimators.vehicle.state_space import Output, System
from estimators.vehicle.suspension import (
    half_vehicle_bogies,
    longitudinal_springs,
    masses,
    primary_vertical_springs,
    secondary_vertical_springs,
    vertical_springs,
)

BOUNCE, BODY_BOUNCE, PITCH = COORDINATES = ("bogie.z", "body.z", "bogie.pitch")
ALONG = ("bogie.x", "wheelset1.x", "wheelset2.x")
WHEELSETS = ("wheelset1.z", "wheelset2.z")
NEEDED_IN_BOUNCE = (
    "bogie_mass", "body_mass", "semi_wheelbase", "primary_vertical_stiffness", "primary_vertical_damping",
    "secondary_vertical_stiffness", "secondary_vertical_damping",
)  # fmt: skip
NEEDED_IN_PITCH = (
    "bogie_pitch_inertia", "semi_wheelbase", "primary_vertical_stiffness", "primary_vertical_damping",
)  # fmt: skip
NEEDED = tuple(dict.fromkeys((*NEEDED_IN_PITCH, *NEEDED_IN_BOUNCE)))
"""Nominal parameters, SI units; all positive."""


def vertical(vehicle: Mapping[str, Any], outputs: Sequence[Output]) -> System:
    """States: heights of bogie and body, bogie's pitch (m, rad), with a traction rod `ALONG` after them, then their
    rates. u is the mean height of the rails.
    """
    return _vertical(frozenset(numbers(vehicle, ()).items()), tuple(outputs))


@lru_cache(maxsize=VEHICLES)
def _vertical(parameters: frozenset[tuple[str, float]], outputs: tuple[Output, ...]) -> System:
    """The same of parameters that can be looked up."""
    vehicle = dict(parameters)
    coordinates = coordinates_of(vehicle)
    bogies, moving = half_vehicle_bogies(vehicle), Kinematics(coordinates, WHEELSETS)
    springs = vertical_springs(vehicle, bogies)
    if coordinates != COORDINATES:
        springs += longitudinal_springs(vehicle, bogies)
    A, B, E = reduce(springs, masses(vehicle, bogies, coordinates), moving).first_order()
    n, bounce, pitch = len(coordinates), COORDINATES.index(BOUNCE), COORDINATES.index(PITCH)
    rows, twice, feels = [], np.zeros((len(outputs), len(WHEELSETS))), np.zeros((len(outputs), n))
    still = np.zeros(len(WHEELSETS))
    for number, output in enumerate(outputs):
        x, wheelset = output.position[0], 0 if output.position[0] > 0 else 1
        if output.kind == "rate":
            rows.append((np.eye(2 * n)[n + pitch], still, still))
        elif output.kind == "acceleration":
            rows.append(tuple(part[n + bounce] - x * part[n + pitch] for part in (A, B, E)))
            feels[number, [bounce, pitch]] = 1.0, -x
        elif output.kind == "body acceleration":
            rows.append(tuple(part[n + COORDINATES.index(BODY_BOUNCE)] for part in (A, B, E)))
            feels[number, COORDINATES.index(BODY_BOUNCE)] = 1.0
        elif output.kind == "height":
            rows.append((np.eye(2 * n)[bounce] - x * np.eye(2 * n)[pitch], still, still))
        elif output.kind == "axlebox":
            rows.append((np.zeros(2 * n), still, still))
            twice[number, wheelset] = 1.0
        else:
            moved, of_wheelsets = moving.row(primary_vertical_springs(vehicle, bogies)[wheelset].motion)
            rows.append((np.append(moved, np.zeros(n)), of_wheelsets, still))
    C, D, G = (np.stack(part) for part in zip(*rows, strict=True))
    return System(A, B, E, C, D, G, twice if twice.any() else None, feels)


def coordinates_of(vehicle: Mapping[str, Any]) -> tuple[str, ...]:
    """Those along the track are there where a traction rod is given."""
    return (*COORDINATES, *ALONG) if vehicle.get("traction_rod_stiffness", 0.0) > 0.0 else COORDINATES


class Ratio(NamedTuple):
    """Rational function of s: coefficients of numerator and denominator, highest power first."""

    numerator: np.ndarray
    denominator: np.ndarray

    def __call__(self, omega: np.ndarray) -> np.ndarray:
        """Complex values at angular frequencies, rad/s."""
        return _at_frequencies(self.numerator, omega) / _at_frequencies(self.denominator, omega)

    def times(self, other: "Ratio") -> "Ratio":
        """Product."""
        return Ratio(np.polymul(self.numerator, other.numerator), np.polymul(self.denominator, other.denominator))


class Inverse(NamedTuple):
    """The wheelsets' motion over that of the bogie.

    Attributes
    ----------
    whole : the ratio. inertial : what inertia adds to 1; it shows where a parameter is wrong.
    """

    whole: Ratio
    inertial: Ratio


def bounce_inverse(vehicle: Mapping[str, Any]) -> Inverse:
    """Mean height of both wheelsets over the height of the bogie; raise `InputError` for a missing parameter."""
    p, both = positive_numbers(vehicle, NEEDED_IN_BOUNCE), (BOUNCE, BODY_BOUNCE)
    dynamic = _polynomials(p, both, secondary_vertical_springs(p, half_vehicle_bogies(p)))
    primary = _polynomials(p, both, primary_vertical_springs(p, half_vehicle_bogies(p)))[0, 0, 1:]
    body = dynamic[1, 1]
    load = np.polysub(np.polymul(dynamic[0, 0], body), np.polymul(dynamic[0, 1], dynamic[1, 0]))
    load[-2:] = 0.0  # uniform motion needs no force
    below = np.polymul(primary, body)
    return Inverse(Ratio(np.polyadd(below, load), below), Ratio(load, below))


def pitch_inverse(vehicle: Mapping[str, Any]) -> Inverse:
    """Rotation of the line through both wheelsets over the pitch of the bogie; raise `InputError` likewise."""
    p = positive_numbers(vehicle, NEEDED_IN_PITCH)
    whole = _polynomials(p, (PITCH,), primary_vertical_springs(p, half_vehicle_bogies(p)))[0, 0]
    primary, inertia = whole[1:], np.array([whole[0], 0.0, 0.0])
    return Inverse(Ratio(whole, primary), Ratio(inertia, primary))


def pitch_frequency(vehicle: Mapping[str, Any]) -> float:
    """Natural frequency of the bogie's pitch on its primary suspension, Hz."""
    inertia, _, stiffness = pitch_inverse(vehicle).whole.numerator
    return float(np.sqrt(stiffness / inertia) / (2.0 * np.pi))


def _polynomials(p: Mapping[str, float], coordinates: Sequence[str], elements: Sequence[Element]) -> np.ndarray:
    """M s^2 + C s + K, powers of s along the last axis, shape (n, n, 3); the wheelsets at rest."""
    reduced = reduce(elements, masses(p, half_vehicle_bogies(p), coordinates), Kinematics(coordinates))
    return np.stack([reduced.mass, reduced.damping, reduced.stiffness], axis=-1)


def _at_frequencies(polynomial: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Polynomial of s at i omega: even powers of s are real, odd ones imaginary."""
    square, even, odd = -(np.asarray(omega) ** 2), polynomial[-1::-2][::-1], polynomial[-2::-2][::-1]
    return np.polyval(even, square) + 1j * omega * np.polyval(odd, square)
