"""Dry friction between body and bogie, laterally: a seized damper, rubbing parts."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import BogieEffect
from railsim.effects._elements import friction
from railsim.effects._references import BRUNI
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class LateralFriction(BogieEffect, frozen=True):
    """Friction beside the secondary lateral springs, regularised as F tanh(v / v0): 4 F X per cycle of amplitude X."""

    force: float = quantity(1500.0, unit="N", source=CHOSEN, ge=0.0, le=15e3)
    slip: float = quantity(2e-3, unit="m/s, v0", source="illustrative", gt=0.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"force": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"force": 200.0})
    signature: ClassVar[str] = "body and bogie are locked together in small lateral movements, as on smooth track"
    references: ClassVar[tuple[str, ...]] = (BRUNI,)

    def install(self, setup: Setup) -> Setup:
        """A friction element beside the springs."""
        return friction(setup, self, "y", self.force, self.slip)
