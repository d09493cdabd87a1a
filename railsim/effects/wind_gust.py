"""Gust from the side."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar, Literal

import numpy as np

from railsim.effects._loads import wind
from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.spec import quantity


class WindGust(Effect, frozen=True):
    """Lateral force on the body, 1 - cosine over its duration (or over a length of the track)."""

    force: float = quantity(10e3, unit="N on half a body, to the left, at its peak", source=CHOSEN, ge=-80e3, le=80e3)
    begin: float = quantity(0.5, unit="s (m)", source=CHOSEN, ge=0.0, le=1e5)
    duration: float = quantity(2.0, unit="s (m)", source=CHOSEN, ge=0.2, le=1e3)
    over: Literal["time", "distance"] = quantity("time", unit="-, distance: a gap in a wall", source=CHOSEN)
    height: float = quantity(2.3, unit="m above the rails", source="illustrative: middle of the side wall", gt=0.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"force": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"force": 500.0})
    signature: ClassVar[str] = "the body sways once to one side and back"
    acts_on: ClassVar[str] = "load"
    references: ClassVar[tuple[str, ...]] = ("EN 14067-6: gust of 1 - cosine",)

    def install(self, setup: Setup) -> Setup:
        """A force over time and its roll moment."""
        if self.force == 0.0:
            return setup
        phase = np.linspace(0.0, 2.0 * np.pi, 129)
        shape = 0.5 * self.force * (1.0 - np.cos(phase))
        return wind(setup, self, shape, self.begin, self.duration / 128.0, self.height, self.over)
