"""Sensor that is mounted at an angle."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._references import INERTIAL
from railsim.effects.interface import CHOSEN, Setup
from railsim.effects.sensor_changes import ChannelEffect
from railsim.spec import quantity


class SensorMisalignment(ChannelEffect, frozen=True):
    """One channel with its sensor turned by `angle` about each axis of the body."""

    angle: float = quantity(0.03, unit="rad", source=CHOSEN, ge=-0.2, le=0.2)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"angle": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"angle": 0.005})
    signature: ClassVar[str] = "a share of the other axes in one channel; with an accelerometer a share of gravity"
    family: ClassVar[str] = "sensor_axes"
    references: ClassVar[tuple[str, ...]] = (INERTIAL,)

    def install(self, setup: Setup) -> Setup:
        """The sensor is turned."""
        return self.faulty(setup, misalignment=lambda given: tuple(one + self.angle for one in given))
