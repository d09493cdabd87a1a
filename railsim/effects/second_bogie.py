"""The other half of a vehicle whose model is half a vehicle."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.errors import InputError
from railsim.sensors.interface import Sensor
from railsim.spec import quantity
from railsim.vehicles.half_vehicle import HalfVehicle
from railsim.vehicles.whole_vehicle import WholeVehicle


class SecondBogie(Effect, frozen=True):
    """A whole body on two bogies in place of half a body on one: it pitches and yaws, and the rear bogie shakes it too.

    The ends of a body of mass m over bogies 2 a apart move as half bodies do where its inertia about pitch and yaw is
    m a^2: a push at one end does not move the other (centre of percussion). Real bodies have less: (1 - share) m a^2.
    """

    share: float = quantity(0.27, unit="- of m a^2", source=CHOSEN, ge=0.0, le=0.6)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"share": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"share": 0.05})
    signature: ClassVar[str] = (
        "the body answers to the track under the other bogie too, later by their distance over the speed; below 3 Hz"
    )
    advice: ClassVar[str] = "Take the whole vehicle as the nominal scenario."
    references: ClassVar[tuple[str, ...]] = (
        "Wickens (2003), Fundamentals of rail vehicle dynamics, ch. 8: the body's inertia couples its ends",
    )

    def install(self, setup: Setup) -> Setup:
        """A whole vehicle with the half's parameters; sensors on the body stay over the leading bogie.

        Raises
        ------
        InputError : the vehicle is not half a vehicle.
        """
        if not isinstance(setup.vehicle, HalfVehicle):
            raise InputError(f"effect '{self.kind}': the vehicle is whole, or a wheelset; take half a vehicle")
        if self.share == 0.0:
            return setup
        ahead = setup.vehicle.semi_bogie_spacing
        sensors = tuple(_moved(one, ahead) for one in setup.sensors)
        return setup.but(vehicle=WholeVehicle.of_half(setup.vehicle, 1.0 - self.share), sensors=sensors)


def _moved(sensor: Sensor, ahead: float) -> Sensor:
    """A sensor on the body, whose centre is that far behind the half's."""
    if getattr(sensor, "body", "") != "body" or "position" not in type(sensor).model_fields:
        return sensor
    x, y, z = sensor.model_dump()["position"]
    return sensor.but(position=(x + ahead, y, z))
