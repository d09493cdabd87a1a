"""Single wheelset with a suspended mass: the vehicle of Ward et al. (2011), Appendix 2, as a multibody model."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

import numpy as np
import pydantic

from railsim.constants import GRAVITY
from railsim.contact.functions import ContactTable
from railsim.contact.pairs import WheelRailPair
from railsim.model import Body, LinearElement, Model, Wheelset
from railsim.profiles.pair import Pair, ProfilePair
from railsim.spec import quantity
from railsim.vehicles.adhesion import Adhesion
from railsim.vehicles.interface import Vehicle
from railsim.vehicles.running_gear import ILLUSTRATIVE, SHIFT, contact_law

PLAN_VIEW = "illustrative: near the values of published plan-view studies of a Class 175-like vehicle"
HELD = 1e6  # kg m2; inertia of the suspended mass, whose rotations are held: serves only the absolute engine's holding


class WheelsetVehicle(Vehicle, frozen=True):
    """Single wheelset with a suspended mass (Ward et al. 2011, section 4.3).

    The bodies are `wheelset1` (y, z, roll, yaw and spin) and `body`, the suspended mass, which moves laterally only. A
    lateral spring and damper join the two at the axle's height; a yaw spring and damper turn the wheelset to the
    direction of the track. The suspended mass's weight rests on the wheelset. `railsim.wheelset` has the same vehicle's
    equations in closed form.
    """

    wheelset_mass: float = quantity(1250.0, unit="kg", source=PLAN_VIEW, gt=0.0)
    wheelset_yaw_inertia: float = quantity(700.0, unit="kg m2", source=PLAN_VIEW, gt=0.0)
    wheelset_spin_inertia: float = quantity(112.0, unit="kg m2", source="Iwnicki (1998), vehicle 1", gt=0.0)
    wheel_radius: float = quantity(0.45, unit="m", source=ILLUSTRATIVE, gt=0.1)
    half_gauge: float = quantity(0.75, unit="m", source="distance of the contacts, 1435 mm gauge", gt=0.3)
    suspended_mass: float = quantity(
        10_350.0, unit="kg", source="illustrative: quarter of a 34 460 kg body with two 3 477 kg bogies", gt=0.0
    )
    lateral_stiffness: float = quantity(2.5e5, unit="N/m", source=ILLUSTRATIVE, ge=0.0)
    lateral_damping: float = quantity(2e4, unit="N s/m", source=ILLUSTRATIVE, ge=0.0)
    yaw_stiffness: float = quantity(2.5e6, unit="N m/rad", source=ILLUSTRATIVE, ge=0.0)
    yaw_damping: float = quantity(0.0, unit="N m s/rad", source=ILLUSTRATIVE, ge=0.0)
    contact_damping_ratio: float = quantity(0.1, unit="-", source="illustrative: of the bounce on the rails", ge=0.0)
    pair: Pair = quantity(WheelRailPair(), unit="-", source="analytic pair, or profiles (kind: profiles)")
    adhesion: Adhesion = pydantic.Field(default_factory=Adhesion)

    derived: ClassVar[Mapping[str, tuple[str, str]]] = MappingProxyType(
        {
            "design_conicity": ("-", "new profiles: slope of the rolling radius over +-3 mm"),
            "design_contact_angle": ("rad", "new profiles: contact angle at rest"),
            "design_contact_angle_rate": ("rad/m", "new profiles: change of the contact angle over +-3 mm"),
            "design_contact_curvature": ("1/m", "new profiles: sum of the lateral curvatures at rest"),
            "design_wheel_load": ("N", "nominal masses"),
        }
    )

    def design(self) -> dict[str, float]:
        """What is known of the wheels as they were new, whatever has become of them, and the load of a wheel."""
        new = self.pair.but(wear=0.0) if isinstance(self.pair, ProfilePair) else self.pair
        left, _ = new.sides(self.wheel_radius, self.half_gauge)
        radius = np.interp((-SHIFT, SHIFT), left.shift, left.radius)
        angle = np.interp((-SHIFT, 0.0, SHIFT), left.shift, left.contact_angle())
        return {
            "design_conicity": float(np.diff(radius)[0]) / (2.0 * SHIFT),
            "design_contact_angle": float(angle[1]),
            "design_contact_angle_rate": float(angle[2] - angle[0]) / (2.0 * SHIFT),
            "design_contact_curvature": float(np.interp(0.0, left.shift, left.curvature)),
            "design_wheel_load": self.wheel_load,
        }

    def model(self) -> Model:
        """5 free coordinates and one spin."""
        left, right = self.pair.sides(self.wheel_radius, self.half_gauge)
        centre = (0.0, 0.0, self.wheel_radius)
        inertia = (self.wheelset_yaw_inertia, self.wheelset_spin_inertia, self.wheelset_yaw_inertia)
        return Model(
            bodies=(
                Body("body", self.suspended_mass, (HELD, HELD, HELD), centre, ("y",)),
                Body("wheelset1", self.wheelset_mass, inertia, centre, ("y", "z", "roll", "yaw")),
            ),
            elements=(
                LinearElement(
                    "suspension",
                    "body",
                    "wheelset1",
                    centre,
                    np.diag([0.0, self.lateral_stiffness, 0.0, 0.0, 0.0, self.yaw_stiffness]),
                    np.diag([0.0, self.lateral_damping, 0.0, 0.0, 0.0, self.yaw_damping]),
                    finite=True,
                ),
            ),
            nonlinear=(),
            wheelsets=(Wheelset("wheelset1", self.wheelset_spin_inertia, self.wheel_radius, self.half_gauge),),
            contact=ContactTable.build(left, right),
            law=contact_law(
                self.adhesion, left.stiffness(), self.wheel_load, self.wheelset_mass, self.contact_damping_ratio
            ),
            reference="wheelset1",
            vertical_load={"wheelset1": self.suspended_mass * GRAVITY},
        )

    @property
    def wheel_load(self) -> float:
        """Static vertical force of one wheel [N]."""
        return (self.wheelset_mass + self.suspended_mass) * GRAVITY / 2.0
