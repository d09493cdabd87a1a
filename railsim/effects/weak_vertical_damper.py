"""Secondary vertical damper that has lost some of its damping, or failed."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import VERTICAL_DAMPERS, Component
from railsim.effects._elements import Weakened
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class WeakVerticalDamper(Weakened, frozen=True):
    """Secondary vertical dampers of both sides by one factor."""

    factor: float = quantity(0.5, unit="-", source=CHOSEN, ge=0.0, le=1.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 0.8})
    signature: ClassVar[str] = "the body bounces and rolls more at its own frequencies (about 1 Hz)"
    weakens: ClassVar[str] = "secondary_vertical_damping"
    references: ClassVar[tuple[str, ...]] = ("Ward et al. (2011), section 4.1",)
    component: ClassVar[Component] = VERTICAL_DAMPERS

    def install(self, setup: Setup) -> Setup:
        """Less vertical and roll damping between body and bogie."""
        return self.weaken(setup, damping=self.factor)
