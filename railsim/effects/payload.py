"""Passengers or goods that the nominal mass does not hold."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects.interface import CHOSEN, Effect, Setup, changed
from railsim.spec import quantity

SPREAD = 0.9  # m; radius of gyration of what is carried about its own centre, in roll (illustrative)


class Payload(Effect, frozen=True):
    """Mass on the vehicle's body, half of it or whole, spread over floor and seats, and lengthwise as the body's own.

    The springs are packed for it: the body stands as high as before.
    """

    mass: float = quantity(3000.0, unit="kg on the body", source=CHOSEN, ge=-2000.0, le=10e3)
    height: float = quantity(
        1.9, unit="m above the rails, of its centre", source="illustrative: seated passengers", gt=0.0
    )

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"mass": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"mass": 300.0})
    signature: ClassVar[str] = (
        "the body bounces, sways and rolls more slowly (root of the mass); all wheels press more, contacts sink more"
    )
    references: ClassVar[tuple[str, ...]] = ("EN 15663: masses of rail vehicles",)

    def install(self, setup: Setup) -> Setup:
        """A heavier body with a higher centre and more inertia; the suspension carries it at rest."""
        if self.mass == 0.0:
            return setup
        vehicle, mass = setup.vehicle, self.mass
        nominal = float(getattr(vehicle, "body_mass", 0.0))
        total = nominal + mass
        rise = mass * (self.height - float(getattr(vehicle, "body_height", 0.0))) / max(total, 1.0)
        reduced = mass * (total - mass) / max(total, 1.0)
        arm = self.height - float(getattr(vehicle, "body_height", 0.0))
        upright = reduced * arm**2
        lengthwise: dict[str, Callable[[float], float]] = {
            "body_pitch_inertia": lambda inertia: inertia * total / nominal + upright,
            "body_yaw_inertia": lambda inertia: inertia * total / nominal,
        }
        return changed(
            setup,
            self,
            body_mass=lambda nominal: nominal + mass,
            body_height=lambda nominal: nominal + rise,
            body_roll_inertia=lambda nominal: nominal + reduced * arm**2 + mass * SPREAD**2,
            **{name: more for name, more in lengthwise.items() if name in type(vehicle).model_fields},
        )
