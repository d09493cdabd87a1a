"""Half vehicle: half a car body on one bogie with two wheelsets; the missing half holds the body's yaw and pitch.

Defaults are passenger vehicle 1 of the Manchester benchmarks (Iwnicki 1998, as transcribed in reference
collections); see `manchester`.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Literal, Self

import numpy as np
import pydantic

from railsim.constants import GRAVITY
from railsim.contact.adhesion import CONDITIONS
from railsim.contact.functions import ContactTable
from railsim.contact.pairs import WheelRailPair
from railsim.contact.wheel import CREEP_LAWS, ContactLaw
from railsim.force_laws import BumpStop
from railsim.model import Body, LinearElement, LongitudinalPath, Model, NonlinearElement, Wheelset
from railsim.profiles.pair import Pair
from railsim.spec import Spec, quantity
from railsim.vehicles.interface import Vehicle

IWNICKI = "Iwnicki (1998), Manchester benchmarks, passenger vehicle 1"
HALF = f"{IWNICKI}; half of the whole body"
ILLUSTRATIVE = "illustrative"
POLACH = "Polach (2005), dry"
SHIFT = 0.003
"""Lateral shift over which conicity is stated [m] (EN 15302: 3 mm)."""


class Adhesion(Spec, frozen=True):
    """Creep law and its friction: mu = friction [(1 - ratio) exp(-decay w) + ratio], reduction factors kA and kS
    (Polach 2005).

    `condition` is a preset of `railsim.contact.adhesion`; numbers that are given beside it replace the preset's, and a
    bare name is the condition. A track with a friction of its own replaces `friction`; the fall with the slip velocity
    stays. `law` linear has no limit: no friction, and (kA + kS) / 2 of Kalker's slope.
    """

    condition: str | None = quantity(None, unit="dry, wet, low, very low", source="railsim.contact.adhesion")
    law: Literal["polach", "fastsim", "linear"] = quantity("polach", unit="-", source="creep laws of railsim.contact")
    friction: float = quantity(0.4, unit="-", source="illustrative: dry rail in service", gt=0.0, le=1.0)
    friction_ratio: float = quantity(0.4, unit="-", source=POLACH, gt=0.0, le=1.0)
    friction_decay: float = quantity(0.6, unit="s/m", source=POLACH, ge=0.0)
    k_adhesion: float = quantity(1.0, unit="-", source=POLACH, gt=0.0, le=1.0)
    k_slip: float = quantity(0.4, unit="-", source=POLACH, gt=0.0, le=1.0)
    creep: bool = True

    @pydantic.model_validator(mode="wrap")
    @classmethod
    def _preset(cls, given: Any, handler: pydantic.ModelWrapValidatorHandler[Self]) -> Self:
        """Numbers of the condition where none are given; only those that are given count as set."""
        values = {"condition": given} if isinstance(given, str) else given
        name = values.get("condition") if isinstance(values, Mapping) else None
        if name is None:
            return handler(values)
        if name not in list(CONDITIONS):
            raise ValueError(f"unknown condition; use one of {', '.join(CONDITIONS)}")
        filled = {key: value for key, value in CONDITIONS[name].parameters().items() if key not in values}
        result = handler({**values, **filled})
        result.model_fields_set.difference_update(filled)
        return result

    @pydantic.model_serializer(mode="wrap")
    def _plain(self, handler: pydantic.SerializerFunctionWrapHandler) -> dict[str, Any]:
        """The preset's numbers go by its name, so that another name brings others."""
        values = handler(self)
        preset = CONDITIONS[self.condition].parameters() if self.condition else {}
        return {key: value for key, value in values.items() if key not in preset or key in self.model_fields_set}


class HalfVehicle(Vehicle, frozen=True):
    """Parameters per axlebox (primary) and per side (secondary) unless the name says otherwise."""

    body_mass: float = quantity(16000.0, unit="kg", source=HALF, gt=0.0)
    body_roll_inertia: float = quantity(28400.0, unit="kg m2", source=HALF, gt=0.0)
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

    def model(self) -> Model:
        """Bodies `body`, `bogie`, `wheelset1` (leading), `wheelset2`: 16 free coordinates and two spins."""
        left, right = self.pair.sides(self.wheel_radius, self.half_gauge)
        return Model(
            bodies=self._bodies(),
            elements=(self._secondary(), *(self._primary(i) for i in (1, 2))),
            nonlinear=(self._bump_stop(),),
            wheelsets=tuple(
                Wheelset(
                    f"wheelset{i}", self.wheelset_spin_inertia, self.wheel_radius, self.primary_half_spacing, "bogie"
                )
                for i in (1, 2)
            ),
            contact=ContactTable.build(left, right),
            law=contact_law(
                self.adhesion, left.stiffness(), self.wheel_load, self.wheelset_mass, self.contact_damping_ratio
            ),
            reference="bogie",
            trailing_pivot=2.0 * self.semi_bogie_spacing,
            chord_yaw="body",
            path=LongitudinalPath("bogie", self.secondary_height),
        )

    @property
    def wheel_load(self) -> float:
        """Static vertical force of one wheel [N]."""
        return (self.body_mass + self.bogie_mass + 2.0 * self.wheelset_mass) * GRAVITY / 4.0

    def _bodies(self) -> tuple[Body, ...]:
        wheelset_free = ("y", "z", "roll", "yaw")
        inertia = (self.wheelset_yaw_inertia, self.wheelset_spin_inertia, self.wheelset_yaw_inertia)
        pitch = (
            self.body_mass * self.semi_bogie_spacing**2 / 3.0
        )  # held: serves only the absolute engine's holding forces
        return (
            Body(
                "body",
                self.body_mass,
                (self.body_roll_inertia, pitch, pitch),
                (0.0, 0.0, self.body_height),
                ("y", "z", "roll"),
            ),
            Body(
                "bogie",
                self.bogie_mass,
                (self.bogie_roll_inertia, self.bogie_pitch_inertia, self.bogie_yaw_inertia),
                (0.0, 0.0, self.bogie_height),
                ("y", "z", "roll", "pitch", "yaw"),
            ),
            *(
                Body(f"wheelset{i}", self.wheelset_mass, inertia, (x, 0.0, self.wheel_radius), wheelset_free)
                for i, x in ((1, self.semi_wheelbase), (2, -self.semi_wheelbase))
            ),
        )

    def _secondary(self) -> LinearElement:
        springs = (
            self.secondary_longitudinal_stiffness,
            self.secondary_lateral_stiffness,
            self.secondary_vertical_stiffness,
        )
        dampers = (0.0, self.secondary_lateral_damping, self.secondary_vertical_damping)
        stiffness = both_sides(springs, self.secondary_half_spacing)
        stiffness[3, 3] += self.roll_bar_stiffness
        damping = both_sides(dampers, self.secondary_half_spacing)
        damping += both_sides((self.yaw_damper_damping, 0.0, 0.0), self.yaw_damper_half_spacing)
        load = self.body_mass * GRAVITY
        return LinearElement(
            "secondary",
            "body",
            "bogie",
            (0.0, 0.0, self.secondary_height),
            stiffness,
            damping,
            (0.0, 0.0, load),
            finite=True,
        )

    def _primary(self, number: int) -> LinearElement:
        springs = (self.primary_longitudinal_stiffness, self.primary_lateral_stiffness, self.primary_vertical_stiffness)
        dampers = (self.primary_longitudinal_damping, self.primary_lateral_damping, self.primary_vertical_damping)
        x = self.semi_wheelbase if number == 1 else -self.semi_wheelbase
        load = 0.5 * (self.body_mass + self.bogie_mass) * GRAVITY
        return LinearElement(
            f"primary{number}",
            "bogie",
            f"wheelset{number}",
            (x, 0.0, self.wheel_radius),
            both_sides(springs, self.primary_half_spacing),
            both_sides(dampers, self.primary_half_spacing),
            (0.0, 0.0, load),
        )

    def _bump_stop(self) -> NonlinearElement:
        law = BumpStop(self.bump_stop_gap, self.bump_stop_stiffness, self.bump_stop_cubic)
        return NonlinearElement("bump_stop", "body", "bogie", (0.0, 0.0, self.secondary_height), "y", law)


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


def both_sides(values: tuple[float, float, float], half_spacing: float) -> np.ndarray:
    """(6, 6) of two equal springs (or dampers) along x, y, z, `half_spacing` [m] to the left and right of the
    element's centre.

    Along x only the couple that turns the bodies in yaw is kept: every body is held at its place along the track,
    and against that holding the springs' common longitudinal stiffness would resist the bogie's pitch, which
    wheelsets that are free to roll do not. The force that they carry along the track follows from the holding and
    pitches the bogie by `model.LongitudinalPath`.
    """
    total = np.zeros((6, 6))
    for y in (half_spacing, -half_spacing):
        jacobian = np.hstack((np.eye(3), [[0.0, 0.0, -y], [0.0, 0.0, 0.0], [y, 0.0, 0.0]]))
        total += jacobian.T @ np.diag(values) @ jacobian
    total[0, :] = total[:, 0] = 0.0
    return total
