"""Short waves of the rail head that the measured track file does not hold."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects.interface import CHOSEN, Effect, Extent, Setup
from railsim.effects.track_changes import corrugated
from railsim.spec import quantity


class RailCorrugation(Effect, frozen=True):
    """A wave of both rail heads between `place` and `place + length`."""

    amplitude: float = quantity(5e-5, unit="m", source=CHOSEN, ge=0.0, le=5e-4)
    wavelength: float = quantity(0.2, unit="m", source=CHOSEN, role="wavelength", ge=0.1, le=1.0)
    place: float = quantity(30.0, unit="m, where it begins", source=CHOSEN, role="distance", ge=0.0, le=1e5)
    length: float = quantity(60.0, unit="m", source=CHOSEN, role="length", ge=12.0, le=1e4)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"amplitude": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"amplitude": 5e-6})
    signature: ClassVar[str] = "a tone at v / wavelength in the axleboxes over one stretch"
    acts_on: ClassVar[str] = "track"
    extent: ClassVar[Extent] = "stretch"
    references: ClassVar[tuple[str, ...]] = (
        "Grassie and Kalousek (1993), Rail corrugation: characteristics, causes and treatments, Proc. IMechE Part "
        "F 207",
    )

    def install(self, setup: Setup) -> Setup:
        """A wave of the rails; the step resolves it."""
        return corrugated(setup, self.amplitude, self.wavelength, (self.place, self.length))
