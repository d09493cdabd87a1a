"""Primary vertical dampers that have lost some of their damping, or failed."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import PRIMARY_DAMPERS, Component
from railsim.effects._elements import Weakened
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class WeakPrimaryDamper(Weakened, frozen=True):
    """Primary vertical dampers of all axleboxes by one factor."""

    factor: float = quantity(0.5, unit="-", source=CHOSEN, ge=0.0, le=1.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 0.7})
    signature: ClassVar[str] = "the bogie bounces and pitches more at its own frequencies (5 to 12 Hz)"
    weakens: ClassVar[str] = "primary_vertical_damping"
    references: ClassVar[tuple[str, ...]] = ("Ward et al. (2011), section 4.1",)
    component: ClassVar[Component] = PRIMARY_DAMPERS

    def install(self, setup: Setup) -> Setup:
        """Less vertical and roll damping between bogie and wheelsets."""
        return self.weaken(setup, damping=self.factor)
