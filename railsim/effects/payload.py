"""Passengers or goods that the nominal mass does not hold."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects.interface import CHOSEN, Effect, Setup, changed
from railsim.spec import quantity
from railsim.vehicles.payload import LoadedBody, loaded


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
    signature: ClassVar[str] = "the body bounces, sways and rolls more slowly; all wheels press more"
    references: ClassVar[tuple[str, ...]] = ("EN 15663: masses of rail vehicles",)

    def install(self, setup: Setup) -> Setup:
        """A heavier body with a higher centre and more inertia; the suspension carries it at rest."""
        if self.mass == 0.0:
            return setup
        fields = ("body_mass", "body_height", "body_roll_inertia", "body_pitch_inertia", "body_yaw_inertia")
        mass, height, *inertia = (float(getattr(setup.vehicle, name, 0.0)) for name in fields)
        roll, pitch, yaw = inertia
        body = loaded(LoadedBody(max(mass, 1.0), (roll, pitch, yaw), 0.0, 0.0, height), self.mass, self.height)
        values = dict(zip(fields, (body.mass, body.height, *body.inertia), strict=True))
        if "body_pitch_inertia" not in type(setup.vehicle).model_fields:  # half a body, whose pitch and yaw are held
            del values["body_pitch_inertia"], values["body_yaw_inertia"]
        return changed(setup, self, **{name: lambda _, value=value: value for name, value in values.items()})
