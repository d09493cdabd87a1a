"""Sleepers that hang over a void: the rails give way there under the wheels."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects.interface import CHOSEN, Effect, Extent, Setup
from railsim.effects.track_changes import hanging
from railsim.spec import quantity


class HangingSleepers(Effect, frozen=True):
    """Local compliance of both rails: `deflection` under the static wheel load in its middle, raised cosine over
    `length`.
    """

    deflection: float = quantity(3e-3, unit="m under the static wheel load", source=CHOSEN, ge=0.0, le=8e-3)
    place: float = quantity(50.0, unit="m, of its middle", source=CHOSEN, role="distance", ge=0.0, le=1e5)
    length: float = quantity(4.0, unit="m", source=CHOSEN, role="length", trials=(3.0, 8.0, 20.0), ge=1.5, le=30.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"deflection": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"deflection": 3e-4})
    signature: ClassVar[str] = "a dip that only loaded wheels feel, deeper under a heavier load"
    acts_on: ClassVar[str] = "track"
    extent: ClassVar[Extent] = "short"
    references: ClassVar[tuple[str, ...]] = (
        "Lundqvist and Dahlberg (2005), Load impact on railway track due to unsupported sleepers, Proc. IMechE "
        "Part F 219",
    )

    def install(self, setup: Setup) -> Setup:
        """A dip of the stiffness below the rails."""
        return hanging(setup, self.deflection, self.place, self.length)
