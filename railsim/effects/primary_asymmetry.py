"""Primary springs stiffer on one side than on the other."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import BogieEffect
from railsim.effects._elements import asymmetric
from railsim.effects._references import BRUNI
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class PrimaryAsymmetry(BogieEffect, frozen=True):
    """Vertical primary springs of the left side by 1 + share, of the right side by 1 - share; packed to stand level."""

    share: float = quantity(0.2, unit="-, left side stiffer", source=CHOSEN, ge=-0.6, le=0.6)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"share": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"share": 0.05})
    signature: ClassVar[str] = "the bogie rolls on vertical waves and bounces on cross level"
    references: ClassVar[tuple[str, ...]] = (BRUNI,)

    def install(self, setup: Setup) -> Setup:
        """Bounce and roll of the bogie on its wheelsets are coupled."""
        return asymmetric(setup, self, "primary", self.share)
