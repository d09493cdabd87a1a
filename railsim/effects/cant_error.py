"""Cant that differs from the design and from the measured file."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.effects.track_changes import canted
from railsim.spec import quantity


class CantError(Effect, frozen=True):
    """Cant larger by `error` everywhere."""

    error: float = quantity(0.01, unit="m, right rail higher", source=CHOSEN, ge=-0.06, le=0.06)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"error": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"error": 0.001})
    signature: ClassVar[str] = "the body leans steadily, on straight track as much as in curves"
    acts_on: ClassVar[str] = "track"
    family: ClassVar[str] = "steady_lateral"
    references: ClassVar[tuple[str, ...]] = ("EN 13848-1: cross level",)

    def install(self, setup: Setup) -> Setup:
        """More cant."""
        return canted(setup, self.error)
