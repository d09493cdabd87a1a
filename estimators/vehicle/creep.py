"""Linearised creep forces of one wheel, and the shares of Kalker's slopes that estimators assume.

Kalker's linear theory (Kalker 1967) holds where creepages vanish: F_x = -f11 v_x, F_y = -f22 v_y - f23 spin, with the
semi-axes of the contact ellipse after Hertz under the wheel's load. On real rails the force grows more slowly: Polach
(2005) reduces the slope at vanishing creepage to (kA + kS) / 2 of Kalker's, and it falls as the creepage grows.
Estimators take one of the named assumptions of this file, each by what it is asked for.
"""

from functools import lru_cache

import numpy as np

from estimators.vehicle.parameters import Parameters
from railsim.compiled import kernel
from railsim.contact.hertz import hertz_ellipse
from railsim.contact.kalker import kalker_coefficients
from railsim.contact.linear import CreepCoefficients, creep_coefficients
from railsim.contact.polach import polach_force

Shares = float | tuple[float, float, float]
"""Share of Kalker's slopes, or one each of f11, f22 and f23."""
WHOLE = 1.0
"""Clean rails, as Kalker has it."""
DRY = 0.7
"""Dry rails at vanishing creepage: (kA + kS) / 2 with kA = 1, kS = 0.4 (Polach 2005). Spin is not reduced by it."""
DRY_WORKING = 0.6
"""Dry rails at the creepages of ordinary running, where Polach's force already bends: less than `DRY`."""
DRY_ROLLING: tuple[float, float, float] = (0.64, 0.79, 1.0)
"""Dry rails, f11, f22 and f23 apart: statistical linearisation of Polach's law for a wheel that rolls on a contact
angle of 0.06 rad with creepages of 2e-4 to 8e-4 (docs/suspension.md)."""

FRICTION, K_ADHESION, K_SLIP = 0.4, 1.0, 0.4  # Polach (2005), dry; friction illustrative
CREEPAGE = 2e-4  # illustrative: conicity / radius times a shift of 0.7 mm
LEAST_ANGLE = 0.01  # rad; cylindrical wheels have spin by their roll

CREEP_FACTOR, SPIN_FACTOR = "creep", "spin"
"""Keys among the parameters: factors of all creep coefficients, and of f23 alone beyond that; 1 where not given."""


def kalker_slopes(p: Parameters, share: Shares = WHOLE) -> CreepCoefficients:
    """Creep coefficients of one wheel under its nominal load by Kalker's theory, times the shares."""
    kalker = _kalker(1.0 / p["wheel_radius"], p["design_contact_curvature"], p["design_wheel_load"])
    shares = share if isinstance(share, tuple) else (share, share, share)
    return CreepCoefficients(*(one * slope for one, slope in zip(shares, kalker, strict=True)))


@lru_cache(maxsize=64)
def _kalker(along: float, across: float, load: float) -> CreepCoefficients:
    return creep_coefficients(along, across, load)


def polach_slopes(p: Parameters, angle: float) -> CreepCoefficients:
    """Slopes of Polach's law on dry rails about the spin by a contact angle (rad), times the vehicle's factors."""
    along, across, load = 1.0 / p["wheel_radius"], p["design_contact_curvature"], p["design_wheel_load"]
    f11, f22, f23 = slopes_about_spin(along, across, load, max(angle, LEAST_ANGLE) / p["wheel_radius"])
    share, of_spin = p.get(CREEP_FACTOR, 1.0), p.get(SPIN_FACTOR, 1.0)
    return CreepCoefficients(share * f11, share * f22, share * f23 * of_spin)


_ellipse = lru_cache(maxsize=64)(hertz_ellipse)
_coefficients = lru_cache(maxsize=64)(kalker_coefficients)
NODES, WEIGHTS = np.polynomial.hermite_e.hermegauss(6)
WEIGHTS /= WEIGHTS.sum()


@lru_cache(maxsize=64)
def slopes_about_spin(along: float, across: float, load: float, spin: float) -> CreepCoefficients:
    """Slopes of one wheel's creep force (Polach's law) about its spin at rest, for creepages of the size `CREEPAGE`.

    The spin of a wheel that stands on a sloping tread is a lateral creepage several times as large as those that come
    and go. About it the law's slope along the track is not that of f11 but goes towards f22, by 8 %. The slopes are
    those of statistical linearisation (Booton 1954), by Gauss-Hermite quadrature over both creepages.

    Parameters
    ----------
    along, across : sums of the curvatures, 1/m. load : of the wheel, N. spin : creepage at rest, 1/m.
    """
    ellipse = _ellipse(along, across)
    a, b = ellipse.longitudinal * load ** (1.0 / 3.0), ellipse.lateral * load ** (1.0 / 3.0)
    c11, c22, c23 = _coefficients(ellipse.longitudinal / ellipse.lateral)
    return CreepCoefficients(*_mean_slopes(NODES, WEIGHTS, spin, a, b, c11, c22, c23, load))


@kernel
def _mean_slopes(
    nodes: np.ndarray,
    shares: np.ndarray,
    spin: float,
    a: float,
    b: float,
    c11: float,
    c22: float,
    c23: float,
    load: float,
) -> tuple[float, float, float]:
    """Slopes f11, f22 and f23 by quadrature over `nodes` of a normal deviate with the weights `shares`."""
    rest = polach_force(0.0, 0.0, spin, a, b, c11, c22, c23, load, FRICTION, K_ADHESION, K_SLIP)[1]
    f11 = f22 = 0.0
    for i in range(len(nodes)):
        for j in range(len(nodes)):
            x, y, share = nodes[i], nodes[j], shares[i] * shares[j]
            along, across = polach_force(
                x * CREEPAGE, y * CREEPAGE, spin, a, b, c11, c22, c23, load, FRICTION, K_ADHESION, K_SLIP
            )
            f11 -= share * along * x / CREEPAGE
            f22 -= share * (across - rest) * y / CREEPAGE
    more = polach_force(0.0, 0.0, 1.1 * spin, a, b, c11, c22, c23, load, FRICTION, K_ADHESION, K_SLIP)[1]
    less = polach_force(0.0, 0.0, 0.9 * spin, a, b, c11, c22, c23, load, FRICTION, K_ADHESION, K_SLIP)[1]
    return f11, f22, (less - more) / (0.2 * spin)
