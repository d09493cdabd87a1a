"""Track that gives way under the wheels, softer between sleepers than on them."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects.interface import Effect, Setup
from railsim.effects.track_changes import soft
from railsim.spec import quantity

IN_SERVICE = 2e-8  # m/N of each rail: 50 MN/m


class SoftTrack(Effect, frozen=True):
    """Rails on springs (massless, Winkler): compliance of each rail `softness` (1 + variation cos(2 pi s /
    wavelength)).
    """

    softness: float = quantity(
        IN_SERVICE, unit="m/N of each rail", source="50 MN/m and more in service", ge=0.0, le=1e-7
    )
    variation: float = quantity(0.1, unit="-", source="illustrative", ge=0.0, le=0.9)
    wavelength: float = quantity(0.6, unit="m", source="sleepers", role="wavelength", ge=0.3, le=50.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"softness": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"softness": 2e-9})
    signature: ClassVar[str] = (
        "wheel loads of short waves are smaller; a tone at v / wavelength (sleepers) in the axleboxes"
    )
    acts_on: ClassVar[str] = "track"
    references: ClassVar[tuple[str, ...]] = (
        "Knothe and Grassie (1993), Modelling of railway track and vehicle/track interaction at high frequencies, "
        "Vehicle System Dynamics 22",
    )

    @classmethod
    def ordinary(cls, setup: Setup) -> Mapping[str, float]:
        """No rail is rigid: half of the softness of the softest rails in service."""
        del setup
        return {"softness": 0.5 * IN_SERVICE}

    def install(self, setup: Setup) -> Setup:
        """Rails on springs."""
        return soft(setup, self.softness, self.variation, self.wavelength)
