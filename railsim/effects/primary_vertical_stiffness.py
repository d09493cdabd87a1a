"""Primary vertical springs softer (cracked, lost) or stiffer (aged rubber) than nominal."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import PRIMARY_VERTICAL, Component
from railsim.effects._elements import Weakened
from railsim.effects._references import BRUNI
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class PrimaryVerticalStiffness(Weakened, frozen=True):
    """Vertical primary springs of all axleboxes by one factor, their roll stiffness with them."""

    factor: float = quantity(0.7, unit="-", source=CHOSEN, ge=0.3, le=2.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 0.9})
    signature: ClassVar[str] = (
        "the bogie bounces and pitches at other frequencies (5 to 12 Hz, with the root of the factor)"
    )
    component: ClassVar[Component] = PRIMARY_VERTICAL
    references: ClassVar[tuple[str, ...]] = (
        "Ward et al. (2011), section 4.1",
        BRUNI,
    )

    def install(self, setup: Setup) -> Setup:
        """Softer or stiffer vertically and in roll."""
        return self.weaken(setup, stiffness=self.factor)
