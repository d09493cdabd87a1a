"""Dipped joints that the measured track file does not hold."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects.interface import CHOSEN, Effect, Extent, Setup
from railsim.effects.track_changes import joints
from railsim.spec import quantity


class RailJoints(Effect, frozen=True):
    """Dipped joints (Jenkins 1974) on both rails at equal distances."""

    depth: float = quantity(3e-3, unit="m", source=CHOSEN, ge=0.0, le=12e-3)
    spacing: float = quantity(18.288, unit="m", source="60 ft rails", role="spacing", ge=5.0, le=200.0)
    first: float = quantity(30.0, unit="m, place of the first", source=CHOSEN, role="distance", ge=0.0, le=1e5)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"depth": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"depth": 5e-4})
    signature: ClassVar[str] = "vertical impacts of both axles one wheelbase apart, again and again at the spacing"
    acts_on: ClassVar[str] = "track"
    extent: ClassVar[Extent] = "short"
    references: ClassVar[tuple[str, ...]] = (
        "Jenkins, Stephenson, Clayton, Morland, Lyon (1974), The effect of track and vehicle parameters on "
        "wheel/rail vertical dynamic forces, Railway Engineering Journal 3",
    )

    def install(self, setup: Setup) -> Setup:
        """Dips of both rails."""
        return joints(setup, self.depth, self.spacing, self.first)
