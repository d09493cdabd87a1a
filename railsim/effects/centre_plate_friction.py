"""Dry friction in yaw between body and bogie: side bearers, a dry centre plate."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import BogieEffect
from railsim.effects._elements import friction
from railsim.effects._references import BRUNI
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class CentrePlateFriction(BogieEffect, frozen=True):
    """Friction moment about the vertical axis, regularised as M tanh(rate / v0)."""

    moment: float = quantity(3000.0, unit="N m", source=CHOSEN, ge=0.0, le=30e3)
    slip: float = quantity(2e-3, unit="rad/s, v0", source="illustrative", gt=0.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"moment": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"moment": 300.0})
    signature: ClassVar[str] = "the bogie turns in jerks into curves and stays turned after them"
    references: ClassVar[tuple[str, ...]] = (BRUNI,)

    def install(self, setup: Setup) -> Setup:
        """A friction element in yaw."""
        return friction(setup, self, "yaw", self.moment, self.slip)
