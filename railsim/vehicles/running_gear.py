"""Running gear: what half and whole vehicles share: bogies, wheelsets, suspension and contacts.

Defaults are passenger vehicle 1 of the Manchester benchmarks (Iwnicki 1998, as transcribed in reference
collections); see `manchester`.
"""

import math
from abc import abstractmethod
from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

import numpy as np
import pydantic

from railsim.contact.pairs import WheelRailPair
from railsim.contact.wheel import CREEP_LAWS, ContactLaw
from railsim.force_laws import BumpStop
from railsim.model import NonlinearElement
from railsim.profiles.pair import Pair
from railsim.spec import quantity
from railsim.vehicles.adhesion import Adhesion
from railsim.vehicles.air_spring import AirSpring
from railsim.vehicles.interface import Vehicle
from railsim.vehicles.payload import LoadedBody, Payload, loaded

IWNICKI = "Iwnicki (1998), Manchester benchmarks, passenger vehicle 1"
ILLUSTRATIVE = "illustrative"
SHIFT = 0.003
"""Lateral shift over which conicity is stated [m] (EN 15302: 3 mm)."""


class RunningGear(Vehicle, frozen=True):
    """Parameters per axlebox (primary) and per side of a bogie (secondary) unless the name says otherwise."""

    body_mass: float = quantity(unit="kg", source=IWNICKI, gt=0.0)
    body_roll_inertia: float = quantity(unit="kg m2", source=IWNICKI, gt=0.0)
    body_height: float = quantity(1.8, unit="m", source=IWNICKI, gt=0.0)
    bogie_mass: float = quantity(2615.0, unit="kg", source=IWNICKI, gt=0.0)
    bogie_roll_inertia: float = quantity(1722.0, unit="kg m2", source=IWNICKI, gt=0.0)
    bogie_pitch_inertia: float = quantity(1476.0, unit="kg m2", source=IWNICKI, gt=0.0)
    bogie_yaw_inertia: float = quantity(3067.0, unit="kg m2", source=IWNICKI, gt=0.0)
    bogie_height: float = quantity(0.6, unit="m", source=IWNICKI, gt=0.0)
    wheelset_mass: float = quantity(1813.0, unit="kg", source=IWNICKI, gt=0.0)
    wheelset_yaw_inertia: float = quantity(1120.0, unit="kg m2", source=IWNICKI, gt=0.0)
    wheelset_spin_inertia: float = quantity(112.0, unit="kg m2", source=IWNICKI, gt=0.0)
    wheel_radius: float = quantity(0.46, unit="m", source=IWNICKI, gt=0.1)
    semi_wheelbase: float = quantity(1.28, unit="m", source=IWNICKI, gt=0.0)
    semi_bogie_spacing: float = quantity(9.5, unit="m", source=IWNICKI, gt=0.0)
    half_gauge: float = quantity(0.75, unit="m", source="distance of the contacts, 1435 mm gauge", gt=0.3)
    primary_half_spacing: float = quantity(1.0, unit="m", source=IWNICKI, gt=0.0)
    primary_longitudinal_stiffness: float = quantity(31.391e6, unit="N/m", source=IWNICKI, gt=0.0)
    primary_lateral_stiffness: float = quantity(3.884e6, unit="N/m", source=IWNICKI, gt=0.0)
    primary_vertical_stiffness: float = quantity(1.220e6, unit="N/m", source=IWNICKI, gt=0.0)
    primary_longitudinal_damping: float = quantity(15e3, unit="N s/m", source=IWNICKI, ge=0.0)
    primary_lateral_damping: float = quantity(2e3, unit="N s/m", source=IWNICKI, ge=0.0)
    primary_vertical_damping: float = quantity(4e3, unit="N s/m", source=IWNICKI, ge=0.0)
    secondary_half_spacing: float = quantity(1.0, unit="m", source=IWNICKI, gt=0.0)
    secondary_height: float = quantity(0.9, unit="m", source=ILLUSTRATIVE, gt=0.0)
    secondary_longitudinal_stiffness: float = quantity(160e3, unit="N/m", source=IWNICKI, gt=0.0)
    secondary_lateral_stiffness: float = quantity(160e3, unit="N/m", source=IWNICKI, gt=0.0)
    secondary_vertical_stiffness: float = quantity(430e3, unit="N/m", source=IWNICKI, gt=0.0)
    secondary_lateral_damping: float = quantity(32e3, unit="N s/m", source=IWNICKI, ge=0.0)
    secondary_vertical_damping: float = quantity(20e3, unit="N s/m", source=IWNICKI, ge=0.0)
    roll_bar_stiffness: float = quantity(940e3, unit="N m/rad", source=IWNICKI, ge=0.0)
    yaw_damper_damping: float = quantity(0.0, unit="N s/m", source="none on passenger vehicle 1; per damper", ge=0.0)
    yaw_damper_half_spacing: float = quantity(1.3, unit="m", source=ILLUSTRATIVE, gt=0.0)
    bump_stop_gap: float = quantity(0.025, unit="m", source=IWNICKI, gt=0.0)
    bump_stop_stiffness: float = quantity(
        30.63e3, unit="N/m", source=f"{IWNICKI}: cubic through 600 N at 30 mm", ge=0.0
    )
    bump_stop_cubic: float = quantity(3.575e9, unit="N/m3", source=f"{IWNICKI}: and 230 kN at 65 mm", ge=0.0)
    contact_damping_ratio: float = quantity(
        0.1, unit="-", source="illustrative: of the wheelset's bounce on the rails", ge=0.0
    )
    seats: float = quantity(64.0, unit="- on the body", source=ILLUSTRATIVE, ge=0.0)
    standing_area: float = quantity(20.0, unit="m2 of the body", source=ILLUSTRATIVE, ge=0.0)
    payload: Payload = pydantic.Field(default_factory=Payload)
    air_spring: AirSpring | None = quantity(None, unit="none = steel springs", source=ILLUSTRATIVE)
    pair: Pair = quantity(WheelRailPair(), unit="-", source="analytic pair, or profiles (kind: profiles)")
    adhesion: Adhesion = pydantic.Field(default_factory=Adhesion)

    derived: ClassVar[Mapping[str, tuple[str, str]]] = MappingProxyType(
        {
            "design_conicity": ("-", "nominal profiles: slope of the rolling radius over +-3 mm"),
            "design_contact_angle": ("rad", "nominal profiles: contact angle at rest"),
            "design_contact_angle_rate": ("rad/m", "nominal profiles: change of the contact angle over +-3 mm"),
            "design_contact_curvature": ("1/m", "nominal profiles: sum of the lateral curvatures at rest"),
            "design_wheel_load": ("N", "nominal masses"),
        }
    )

    def design(self) -> dict[str, float]:
        """What is known of the nominal wheels on the nominal rails, and the load of a wheel."""
        left, _ = self.pair.sides(self.wheel_radius, self.half_gauge)
        radius = np.interp((-SHIFT, SHIFT), left.shift, left.radius)
        angle = np.interp((-SHIFT, SHIFT), left.shift, left.contact_angle())
        return {
            "design_conicity": float(np.diff(radius)[0]) / (2.0 * SHIFT),
            "design_contact_angle": float(np.interp(0.0, left.shift, left.contact_angle())),
            "design_contact_angle_rate": float(np.diff(angle)[0]) / (2.0 * SHIFT),
            "design_contact_curvature": float(np.interp(0.0, left.shift, left.curvature)),
            "design_wheel_load": self.wheel_load,
        }

    @property
    @abstractmethod
    def wheel_load(self) -> float:
        """Static vertical force of one wheel [N]."""

    @property
    @abstractmethod
    def empty_body(self) -> LoadedBody:
        """The body without its payload; masses and inertias are those of the fields."""

    @property
    def loaded_body(self) -> LoadedBody:
        """The body with its payload."""
        mass = self.payload.carried(self.seats, self.standing_area)
        if mass == 0.0:
            return self.empty_body
        return loaded(self.empty_body, mass, self.payload.height, self.payload.ahead, self.payload.left)

    def sinks(self, more: float) -> tuple[float, float]:
        """How far a bogie sinks on its four primary springs, and the body on the two secondary ones of a bogie, where
        that bears so much more than of the empty body [N]; steel springs are packed for that one, air springs are
        levelled [m].
        """
        on_bogie = 0.0 if self.air_spring is not None else more / (2.0 * self.secondary_vertical_stiffness)
        return more / (4.0 * self.primary_vertical_stiffness), on_bogie

    def bump_stop(self, name: str, bogie: str, x: float, height: float) -> NonlinearElement:
        """Lateral bump stop between the body and a bogie at x and `height` [m]."""
        law = BumpStop(self.bump_stop_gap, self.bump_stop_stiffness, self.bump_stop_cubic)
        return NonlinearElement(name, "body", bogie, (x, 0.0, height), "y", law)


def contact_law(adhesion: Adhesion, stiffness: float, load: float, mass: float, damping_ratio: float) -> ContactLaw:
    """Creep law, and contact damping as a share of critical of a wheelset's bounce on its two contacts.

    Parameters
    ----------
    stiffness : Hertz stiffness [N/m^1.5]; load : static force of one wheel [N]; mass : of the wheelset [kg].
    damping_ratio : zeta in D = 2 zeta sqrt(k m / 2) / N0 with k = 1.5 N0 / p0.
    """
    rate = 1.5 * load / (load / stiffness) ** (2.0 / 3.0)
    damping = 2.0 * damping_ratio * math.sqrt(rate * mass / 2.0) / load
    a = adhesion
    numbers = a.friction, a.friction_ratio, a.friction_decay, a.k_adhesion, a.k_slip
    return ContactLaw(*numbers, damping, float(a.creep), float(CREEP_LAWS.index(a.law)))
