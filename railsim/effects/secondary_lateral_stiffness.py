"""Secondary springs that shear with another lateral stiffness than nominal."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import SECONDARY_LATERAL, Component
from railsim.effects._elements import Weakened
from railsim.effects._references import BRUNI
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class SecondaryLateralStiffness(Weakened, frozen=True):
    """Lateral secondary stiffness of both sides by one factor."""

    factor: float = quantity(0.6, unit="-", source=CHOSEN, ge=0.3, le=3.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 0.9})
    signature: ClassVar[str] = "the body sways and rolls at other frequencies (0.5 to 1.5 Hz)"
    component: ClassVar[Component] = SECONDARY_LATERAL
    references: ClassVar[tuple[str, ...]] = (BRUNI,)

    def install(self, setup: Setup) -> Setup:
        """Softer or stiffer laterally."""
        return self.weaken(setup, stiffness=self.factor)
