"""Dry friction in the axlebox guides, vertically."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import BogieEffect
from railsim.effects._elements import primary_friction
from railsim.effects._references import BRUNI
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class PrimaryFriction(BogieEffect, frozen=True):
    """Friction beside the vertical primary springs of every axlebox, regularised as F tanh(v / v0)."""

    force: float = quantity(1000.0, unit="N of each axlebox", source=CHOSEN, ge=0.0, le=8e3)
    slip: float = quantity(5e-3, unit="m/s, v0", source="illustrative", gt=0.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"force": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"force": 100.0})
    signature: ClassVar[str] = (
        "small vertical movements pass to the bogie unsprung (10 to 40 Hz), large ones are damped more"
    )
    references: ClassVar[tuple[str, ...]] = (BRUNI,)

    def install(self, setup: Setup) -> Setup:
        """Two friction elements at every wheelset."""
        return primary_friction(setup, self, self.force, self.slip)
