"""Anti-roll bar that is worn in its joints, or broken."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import BogieEffect
from railsim.effects._elements import weak_roll_bar
from railsim.effects._references import BRUNI
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class WeakRollBar(BogieEffect, frozen=True):
    """Stiffness of the roll bar by one factor."""

    factor: float = quantity(0.3, unit="-", source=CHOSEN, ge=0.0, le=1.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 0.8})
    signature: ClassVar[str] = (
        "the body rolls more and at a lower frequency (0.5 to 1 Hz); leans more in curves and in wind"
    )
    references: ClassVar[tuple[str, ...]] = (BRUNI,)

    def install(self, setup: Setup) -> Setup:
        """Less roll stiffness between body and bogie."""
        return weak_roll_bar(setup, self, self.factor)
