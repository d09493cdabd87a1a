"""Tachometers that take a wrong wheel radius."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.errors import InputError
from railsim.sensors.tachometer import Tachometer
from railsim.spec import quantity


class OdometerScale(Effect, frozen=True):
    """Running speed of every tachometer by one factor: worn or newly turned wheels."""

    factor: float = quantity(1.01, unit="-", source=CHOSEN, ge=0.95, le=1.05)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.001})
    signature: ClassVar[str] = "speed and distance of the tachometer grow by one factor against all waves of the track"
    acts_on: ClassVar[str] = "sensor"
    family: ClassVar[str] = "speed_scale"
    by_registration: ClassVar[bool] = True
    references: ClassVar[tuple[str, ...]] = ("Ward et al. (2011), section 5",)

    def install(self, setup: Setup) -> Setup:
        """A wrong radius."""
        factor = self.factor
        if factor != 1.0 and not any(isinstance(sensor, Tachometer) for sensor in setup.sensors):
            raise InputError(f"effect '{self.kind}': there is no tachometer; add one to the sensors")
        sensors = [
            s.but(radius_error=(1.0 + s.radius_error) * factor - 1.0) if isinstance(s, Tachometer) else s
            for s in setup.sensors
        ]
        return setup.but(sensors=tuple(sensors))
