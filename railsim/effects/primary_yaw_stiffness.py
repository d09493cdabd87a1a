"""Primary longitudinal stiffness (bushes of the axlebox guides) other than nominal."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import GUIDANCE_LONGITUDINAL, Component
from railsim.effects._elements import Weakened
from railsim.effects._references import BRUNI
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class PrimaryYawStiffness(Weakened, frozen=True):
    """Longitudinal primary stiffness of all axleboxes by one factor: what keeps the wheelsets square to the bogie."""

    factor: float = quantity(0.5, unit="-", source=CHOSEN, ge=0.1, le=3.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 0.9})
    signature: ClassVar[str] = "wheelsets steer more freely: they run out less in curves and hunt at a lower speed"
    component: ClassVar[Component] = GUIDANCE_LONGITUDINAL
    references: ClassVar[tuple[str, ...]] = (BRUNI,)

    def install(self, setup: Setup) -> Setup:
        """Softer or stiffer in yaw."""
        return self.weaken(setup, stiffness=self.factor)
