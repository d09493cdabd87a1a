"""Analytic wheel-rail pairs: a cone on a rounded rail, and a smooth worn-like pair with a flange."""

from dataclasses import replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from scipy.integrate import cumulative_simpson

from railsim.contact.functions import ContactFunctions
from railsim.spec import Spec, quantity

ILLUSTRATIVE = "illustrative"


def upright_rails() -> Any:
    """Field of a pair: by which share of the wheelset's roll a wheel turns on its rail, as its radius has it. With 1
    rails stay upright. With 0 they turn with the wheels, nearly as on sleepers that tilt with the cross level: there
    wheels turn by the rest of the roll, which is left out. Below 0 rails turn more than wheels.
    """
    return quantity(
        0.0,
        unit="- of the wheelset's roll, by which wheels turn on their rails",
        source="0: rails turn with the cross level, as on sleepers; 1: they stay upright",
        ge=-0.9,
        le=1.0,
    )


@lru_cache(maxsize=64)
def with_upright_rails(functions: ContactFunctions, share: float) -> ContactFunctions:
    """Contact functions, of a second contact too, of wheels that turn by that share of the wheelset's roll."""
    if share == 0.0:
        return functions
    second = None if functions.second is None else with_upright_rails(functions.second, share)
    return replace(functions, upright=share, second=second)


class WheelRailPair(Spec, frozen=True):
    """Geometry of the contact, the same for all four wheels.

    `conical`: straight tread of the stated conicity. `smooth`: circular arcs of radius R_w (concave tread) and R_r
    (rail head), for which contact angle, rolling radius and contact position follow in closed form (Wickens 2003,
    Fundamentals of Rail Vehicle Dynamics, section 2.5), joined by a smooth step of the contact angle to a flange.
    """

    kind: Literal["conical", "smooth"] = "smooth"
    conicity: float = quantity(
        0.125, unit="-", source="illustrative: lightly worn S1002 is 0.1 ... 0.2", gt=0.0, le=0.6
    )
    wheel_profile_radius: float = quantity(0.5, unit="m", source=ILLUSTRATIVE, gt=0.1)
    rail_head_radius: float = quantity(0.3, unit="m", source="UIC 60 rail head, R 300 mm", gt=0.05)
    flange_clearance: float = quantity(0.0075, unit="m", source=ILLUSTRATIVE, gt=0.002, le=0.013)
    flange_angle: float = quantity(1.2, unit="rad", source="S1002 flange, 70 degrees", gt=0.3, le=1.35)
    upright_rails: float = upright_rails()
    flange_width: float = quantity(0.0007, unit="m", source="illustrative: half width of the smooth step", ge=0.0003)

    def sides(self, wheel_radius: float, half_gauge: float) -> tuple[ContactFunctions, ContactFunctions | None]:
        """Contact functions of the left side; the right one is its mirror image."""
        left = _kept(self.but(upright_rails=0.0), wheel_radius, half_gauge)
        return with_upright_rails(left, self.upright_rails), None

    def contact_functions(self, wheel_radius: float, half_gauge: float) -> ContactFunctions:
        """Left wheel of nominal radius r0 [m] whose contact at u = 0 lies `half_gauge` [m] from the centre line."""
        shift = np.linspace(-0.015, 0.015, 601)
        if self.kind == "conical":
            flat = np.zeros_like(shift)
            lift = self.conicity * shift
            return ContactFunctions(
                shift, lift, wheel_radius + lift, half_gauge + flat, 1.0 / self.rail_head_radius + flat
            )
        return self._smooth(shift, wheel_radius, half_gauge)

    def _smooth(self, shift: np.ndarray, wheel_radius: float, half_gauge: float) -> ContactFunctions:
        difference = self.wheel_profile_radius - self.rail_head_radius
        if difference <= 0.05:
            raise ValueError("wheel_profile_radius must exceed rail_head_radius by more than 0.05 m")
        gain = self.wheel_profile_radius / difference  # wheel contact moves by gain * u, rail contact by (gain - 1) * u
        angle = self.conicity / gain
        step = 0.5 * (1.0 + np.tanh((shift - self.flange_clearance) / self.flange_width))
        tread = np.tan(np.clip(angle + shift / difference, -0.3, 0.3))
        slope = tread + (np.tan(self.flange_angle) - tread) * step
        wheel_gain = gain + (1.0 - gain) * step
        middle = len(shift) // 2

        def integral(integrand: np.ndarray) -> np.ndarray:
            total = cumulative_simpson(integrand, x=shift, initial=0.0)
            return total - total[middle]

        return ContactFunctions(
            shift=shift,
            lift=integral(slope),
            radius=wheel_radius + integral(slope * wheel_gain),
            half_distance=half_gauge - integral(wheel_gain - 1.0),
            curvature=np.full_like(shift, 1.0 / self.rail_head_radius - 1.0 / self.wheel_profile_radius),
        )


@lru_cache(maxsize=8)
def _kept(pair: WheelRailPair, wheel_radius: float, half_gauge: float) -> ContactFunctions:
    """A vehicle's model is made again for every run, mostly with the same wheels."""
    return pair.contact_functions(wheel_radius, half_gauge)
