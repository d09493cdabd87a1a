"""A wheel on its contact spring and on a rail that gives way: what roughness does to an axlebox, and back.

Between wheel and rail stands the roughness r, up where the wheel is lifted. Under a wheel of mass m whose centre moves
by z the contact carries m z'' more than at rest, by which contact spring k_H and rail (receptance alpha) are pressed
down. With the time's factor exp(i omega t)

    r = z (1 - omega^2 m (1 / k_H + alpha)).

The suspension above is left out: at the frequencies of short waves its forces are small beside the wheel's inertia.
Sources: Remington (1976), Wheel/rail noise, Journal of Sound and Vibration 46; Thompson (2009), Railway noise and
vibration, chapters 3 and 5; Johnson (1985), Contact mechanics, section 4.2.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import qmc

from estimators.vehicle.parameters import positive_numbers

STEEL = 210e9 / (2.0 * (1.0 - 0.3**2))
"""Pa; E / 2 (1 - nu^2), of two bodies of steel together."""
HEAD = 0.3
"""m; radius of the head of a rail 60E1 (EN 13674-1)."""
BENDING = 6.4e6
"""N m2; of a rail 60E1 about its horizontal axis (EN 13674-1: 3038 cm4)."""
NEEDED = ("wheelset_mass", "wheel_radius", "half_gauge", "design_wheel_load")
"""Parameters of the vehicle that it is built of."""


class Spread(NamedTuple):
    """What data sheets leave open, each even within its limits.

    Attributes
    ----------
    mass, contact : relative, of the wheel's mass (brake discs, axleboxes, a flexible axle) and of the contact's
        stiffness (profiles, load). moving : kg a metre of rail and of what moves with it: from none to
        rail and sleepers. loss : loss factor.
    """

    mass: float = 0.1
    contact: float = 0.2
    moving: tuple[float, float] = (0.0, 310.0)
    loss: tuple[float, float] = (0.1, 0.4)


class WheelOnTrack(NamedTuple):
    """One wheel, or draws of it as arrays (draws, 1).

    Attributes
    ----------
    mass : half the wheelset's, kg. contact : linear stiffness of the contact, N/m.
    compliance : of one rail under one wheel at rest, m/N. moving : rail and what moves with it, kg/m.
    loss : loss factor of what carries the rail.
    """

    mass: Any
    contact: Any
    compliance: Any
    moving: Any
    loss: Any

    def give(self, omega: np.ndarray) -> np.ndarray:
        """Compliance of contact and rail, 1 / k_H + alpha, m/N, at angular frequencies in rad/s, complex."""
        return 1.0 / self.contact + rail_receptance(omega, self.compliance, self.moving, self.loss)

    def roughness_over_path(self, omega: np.ndarray) -> np.ndarray:
        """r / z at angular frequencies in rad/s: 1 - omega^2 m (1 / k_H + alpha)."""
        return 1.0 - omega**2 * self.mass * self.give(omega)


def rail_receptance(omega: np.ndarray, compliance: Any, moving: Any, loss: Any) -> np.ndarray:
    """Deflection over force of a beam on a Winkler foundation, under the force, m/N, complex.

    1 / (2 sqrt(2) B^(1/4) (s (1 + i eta) - m' omega^2)^(3/4)) with the bending stiffness B and the foundation s, N/m2,
    that gives the `compliance` at rest (Grassie et al. 1982, Journal of Mechanical Engineering Science 24).
    """
    root = 2.0 * np.sqrt(2.0) * BENDING**0.25
    foundation = (root * np.maximum(compliance, 1e-14)) ** (-4.0 / 3.0)
    return 1.0 / (root * (foundation * (1.0 + 1j * loss) - moving * omega**2 + 0j) ** 0.75)


def contact_stiffness(load: float, radius: float) -> float:
    """Of a wheel on a rail about its load, N/m: crossed cylinders as a sphere of the mean radius (Hertz).

    load : N. radius : of the wheel, m.
    """
    return 2.0 * STEEL * contact_length(load, radius)


def contact_length(load: float, radius: float) -> float:
    """Half the length of the contact along the rail, m, of the same sphere: (3 N R / 4 E*)^(1/3)."""
    return (0.75 * load * np.sqrt(radius * HEAD) / STEEL) ** (1.0 / 3.0)


def contact_filter(wavelength: np.ndarray, half_length: float) -> np.ndarray:
    """Share of a wave's amplitude that a wheel feels: (1 + pi/4 (k a)^3)^(-1/2) (Remington 1976)."""
    return (1.0 + 0.25 * np.pi * (2.0 * np.pi / wavelength * half_length) ** 3) ** -0.5


def nominal_wheel(vehicle: Mapping[str, Any], compliance: float, spread: Spread = Spread()) -> WheelOnTrack:  # noqa: B008
    """The wheel of nominal parameters on a rail of that compliance, m/N.

    Raises
    ------
    InputError : a parameter is missing or not positive.
    """
    p = positive_numbers(vehicle, NEEDED)
    stiffness = contact_stiffness(p["design_wheel_load"], p["wheel_radius"])
    return WheelOnTrack(
        p["wheelset_mass"] / 2.0, stiffness, compliance, float(np.mean(spread.moving)), float(np.mean(spread.loss))
    )


def drawn_wheels(nominal: WheelOnTrack, share: float, draws: int = 64, spread: Spread = Spread()) -> WheelOnTrack:  # noqa: B008
    """Wheels as data sheets leave them open, each field of shape (draws, 1): Sobol points, the same ones every time.

    share : the compliance lies evenly within (1 +- share) times the nominal one.
    """
    u = 2.0 * (qmc.Sobol(5, scramble=False).random(draws)[..., None] + 0.5 / draws) - 1.0  # middles of cells

    def within(limits: tuple[float, float], column: int) -> np.ndarray:
        return limits[0] + (limits[1] - limits[0]) * 0.5 * (u[:, column] + 1.0)

    return WheelOnTrack(
        nominal.mass * (1.0 + spread.mass * u[:, 0]),
        nominal.contact * (1.0 + spread.contact * u[:, 1]),
        nominal.compliance * (1.0 + share * u[:, 2]),
        within(spread.moving, 3),
        within(spread.loss, 4),
    )
