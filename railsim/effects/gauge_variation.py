"""Gauge that is wider than the measured file says, and varies."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.effects.track_changes import wider
from railsim.spec import quantity


class GaugeVariation(Effect, frozen=True):
    """Gauge wider by `widening` everywhere, and by a wave of `amplitude`."""

    widening: float = quantity(3e-3, unit="m", source=CHOSEN, ge=-5e-3, le=15e-3)
    amplitude: float = quantity(2e-3, unit="m", source=CHOSEN, ge=0.0, le=10e-3)
    wavelength: float = quantity(10.0, unit="m", source=CHOSEN, role="wavelength", ge=3.0, le=100.0)
    place: float = quantity(30.0, unit="m, where the wave begins", source=CHOSEN, role="distance", ge=0.0, le=1e5)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"widening": 0.0, "amplitude": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"widening": 1e-3, "amplitude": 0.0})
    signature: ClassVar[str] = "conicity comes and goes with the wave; more play before the flange"
    acts_on: ClassVar[str] = "track"
    references: ClassVar[tuple[str, ...]] = ("EN 13848-1: track gauge",)

    def install(self, setup: Setup) -> Setup:
        """Rails apart."""
        return wider(setup, self.widening, self.amplitude, self.wavelength, self.place)
