"""Secondary lateral damper that has lost some of its damping, or failed."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import LATERAL_DAMPERS, Component
from railsim.effects._elements import Weakened
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class WeakLateralDamper(Weakened, frozen=True):
    """Both secondary lateral dampers of the bogie together by one factor: 0.5 = one of two has failed."""

    factor: float = quantity(0.5, unit="-", source=CHOSEN, ge=0.0, le=1.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 0.8})
    signature: ClassVar[str] = "body and bogie sway against each other more and for longer (0.5 to 2 Hz)"
    weakens: ClassVar[str] = "secondary_lateral_damping"
    references: ClassVar[tuple[str, ...]] = ("Ward et al. (2011), section 4.1",)
    component: ClassVar[Component] = LATERAL_DAMPERS

    def install(self, setup: Setup) -> Setup:
        """Less lateral damping between body and bogie."""
        return self.weaken(setup, damping=self.factor)
