"""Gust from the side."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._loads import gust
from railsim.effects.interface import CHOSEN, Effect, Extent, Setup
from railsim.spec import quantity


class WindGust(Effect, frozen=True):
    """Lateral force on the vehicle's body, half of it or whole, 1 - cosine over its duration."""

    force: float = quantity(10e3, unit="N on the body, to the left, at its peak", source=CHOSEN, ge=-80e3, le=80e3)
    begin: float = quantity(0.5, unit="s", source=CHOSEN, role="time", ge=0.0, le=1e5)
    duration: float = quantity(2.0, unit="s", source=CHOSEN, role="duration", trials=(2.0, 5.0), ge=0.2, le=1e3)
    height: float = quantity(2.3, unit="m above the rails", source="illustrative: middle of the side wall", gt=0.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"force": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"force": 500.0})
    signature: ClassVar[str] = "the body sways once to one side and back"
    acts_on: ClassVar[str] = "load"
    family: ClassVar[str] = "gust"
    extent: ClassVar[Extent] = "pulse"
    references: ClassVar[tuple[str, ...]] = ("EN 14067-6: gust of 1 - cosine",)

    def install(self, setup: Setup) -> Setup:
        """A force over time and its roll moment."""
        return gust(setup, self, self.force, self.begin, self.duration, self.height, "time")
