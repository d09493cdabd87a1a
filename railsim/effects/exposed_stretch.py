"""Wind from the side where the line is exposed: on a bridge, or in a gap of a wall."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._loads import gust
from railsim.effects.interface import CHOSEN, Effect, Extent, Setup
from railsim.spec import quantity


class ExposedStretch(Effect, frozen=True):
    """Lateral force on the vehicle's body, half of it or whole, 1 - cosine from `place` to `place + length` of its
    centre.
    """

    force: float = quantity(10e3, unit="N on the body, to the left, at its peak", source=CHOSEN, ge=-80e3, le=80e3)
    place: float = quantity(30.0, unit="m, where it begins", source=CHOSEN, role="distance", ge=0.0, le=1e5)
    length: float = quantity(
        200.0, unit="m", source="illustrative: a bridge", role="length", trials=(50.0, 110.0), ge=10.0, le=1e3
    )
    height: float = quantity(2.3, unit="m above the rails", source="illustrative: middle of the side wall", gt=0.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"force": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"force": 500.0})
    signature: ClassVar[str] = "the body sways once to one side and back, at the same place in every run"
    acts_on: ClassVar[str] = "load"
    family: ClassVar[str] = "gust"
    extent: ClassVar[Extent] = "pulse"
    references: ClassVar[tuple[str, ...]] = ("EN 14067-6: gust of 1 - cosine",)

    def install(self, setup: Setup) -> Setup:
        """A force over distance and its roll moment."""
        return gust(setup, self, self.force, self.place, self.length, self.height, "distance")
