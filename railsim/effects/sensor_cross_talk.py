"""Sensor that answers to another axis as well."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects.interface import CHOSEN, Setup
from railsim.effects.sensor_changes import ChannelEffect
from railsim.spec import quantity


class SensorCrossTalk(ChannelEffect, frozen=True):
    """A share of the next axis (x, y, z in turn) of the same body in one channel."""

    share: float = quantity(0.03, unit="-", source=CHOSEN, ge=-0.3, le=0.3)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"share": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"share": 0.005})
    signature: ClassVar[str] = "a share of another axis in one channel"
    family: ClassVar[str] = "sensor_axes"
    references: ClassVar[tuple[str, ...]] = ("IEEE Std 1293: cross-axis sensitivity of accelerometers",)

    def install(self, setup: Setup) -> Setup:
        """Sensitivity across."""
        return self.faulty(setup, cross_talk=lambda given: given + self.share)
