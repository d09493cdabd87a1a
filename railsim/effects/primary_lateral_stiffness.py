"""Primary lateral stiffness other than nominal."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import GUIDANCE_LATERAL, Component
from railsim.effects._elements import Weakened
from railsim.effects._references import BRUNI
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class PrimaryLateralStiffness(Weakened, frozen=True):
    """Lateral primary stiffness of all axleboxes by one factor."""

    factor: float = quantity(0.5, unit="-", source=CHOSEN, ge=0.1, le=3.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 0.8})
    signature: ClassVar[str] = (
        "wheelsets move laterally against the bogie at short waves; bogie feels short lateral waves less"
    )
    component: ClassVar[Component] = GUIDANCE_LATERAL
    references: ClassVar[tuple[str, ...]] = (BRUNI,)

    def install(self, setup: Setup) -> Setup:
        """Softer or stiffer laterally."""
        return self.weaken(setup, stiffness=self.factor)
