"""What a wheelset on a track of unknown stiffness does to its axleboxes: the density of their vertical acceleration.

Mean of both axleboxes: half the wheelset (mass m) on its contact spring k_H and on a rail. With the time's factor
exp(i omega t), the roughness r of the rails' mean gives

    z = r / (1 + (1 / k_H + alpha) (k_p + i omega c_p - omega^2 m))

where k_p, c_p are the primary suspension of one axlebox, whose upper end stands still at these frequencies. alpha is
the receptance of a beam on a foundation of two layers, sleepers of mass m_s a metre between pads and ballast:

    alpha = 1 / (2 sqrt(2) B^(1/4) (S - m_r omega^2)^(3/4))
    1 / S = 1 / (p + i omega c) + 1 / (b + i omega d - m_s omega^2).

At rest the stiffness under the wheel is K = 2 sqrt(2) B^(1/4) s^(3/4), s = p b / (p + b) (Zimmermann; Hetenyi 1946;
Grassie et al. 1982, Journal of Mechanical Engineering Science 24). K is what is looked for: the force on one rail over
its deflection under the wheel, as both rails are loaded alike.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from estimators.vehicle.parameters import positive_numbers
from estimators.vehicle.wheel_on_track import BENDING, NEEDED, contact_stiffness

ROOT = 2.0 * np.sqrt(2.0) * BENDING**0.25


class Common(NamedTuple):
    """What all windows of a record have in common, beside the roughness.

    Attributes
    ----------
    mass : half the wheelset's, kg. contact : stiffness of the contact, N/m.
    rail, sleeper : kg a metre of rail. pad : foundation of the pads alone where all else is rigid, N/m2.
    pad_damping, bed_damping : N s/m2. noise : density of the mean of both axleboxes, (m/s2)^2/Hz.
    """

    mass: float
    contact: float
    rail: float
    sleeper: float
    pad: float
    pad_damping: float
    bed_damping: float
    noise: float


SPREAD = Common(
    mass=0.06,  # as `Spread.mass` of wheel_on_track, an even spread of 10 %
    contact=0.12,  # as `Spread.contact`, an even spread of 20 %
    rail=0.08,  # 54E1 to 60E1
    sleeper=0.35,  # wood to heavy concrete monoblocks
    pad=0.7,  # Knothe and Grassie (1993): factors of two to four
    pad_damping=0.7,
    bed_damping=0.7,
    noise=0.3,  # a data sheet's noise
)
"""Standard deviations of the logarithms."""


class Springs(NamedTuple):
    """Primary suspension of one axlebox, N/m and N s/m; zero where it is not stated."""

    stiffness: float
    damping: float


def expected(vehicle: Mapping[str, Any], noise: float) -> tuple[Common, Springs]:
    """What data sheets and the literature let expect.

    Raises
    ------
    InputError : a parameter is missing or not positive.
    """
    p = positive_numbers(vehicle, NEEDED)
    common = Common(
        mass=p["wheelset_mass"] / 2.0,
        contact=contact_stiffness(p["design_wheel_load"], p["wheel_radius"]),
        rail=60.0,
        sleeper=220.0,  # between 80 kg and 300 kg each 0.6 m, of which a rail has half
        pad=150e6,  # 90 MN/m each 0.6 m: between 65 MN/m (Zhai, Wang and Lin 2004) and 120 MN/m
        pad_damping=70e3,  # 40 kN s/m each 0.6 m, the same range
        bed_damping=100e3,  # 60 kN s/m each 0.6 m, the same range
        noise=noise,
    )
    springs = (vehicle.get(f"primary_vertical_{one}", 0.0) for one in ("stiffness", "damping"))
    return common, Springs(*(float(one) if isinstance(one, int | float) else 0.0 for one in springs))


def foundation(stiffness: np.ndarray) -> np.ndarray:
    """Of the beam that has this stiffness K under a force, N/m2: the track modulus of one rail."""
    return (stiffness / ROOT) ** (4.0 / 3.0)


def receptance(omega: np.ndarray, stiffness: np.ndarray, common: Common) -> np.ndarray:
    """alpha, m/N, complex, of a rail with that stiffness at rest, N/m.

    The pads' share of the deflection is q / (1 + q) with q = s / `pad`: it grows with the stiffness of what lies below,
    and never reaches one.
    """
    below = foundation(stiffness)
    share = below / (below + common.pad)
    pad = below / share + 1j * omega * common.pad_damping
    bed = below / (1.0 - share) + 1j * omega * common.bed_damping - common.sleeper * omega**2
    return 1.0 / (ROOT * (1.0 / (1.0 / pad + 1.0 / bed) - common.rail * omega**2) ** 0.75)


def acceleration_over_roughness(
    omega: np.ndarray, stiffness: np.ndarray, common: Common, springs: Springs
) -> np.ndarray:
    """Square of the axleboxes' mean acceleration over the roughness, 1/s4, at angular frequencies in rad/s.

    Arrays of omega and of stiffness, N/m, are broadcast.
    """
    give = 1.0 / common.contact + receptance(omega, stiffness, common)
    held = springs.stiffness + 1j * omega * springs.damping - common.mass * omega**2
    return omega**4 / np.abs(1.0 + give * held) ** 2
