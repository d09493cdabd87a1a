"""Air springs of another vertical stiffness: other pressure, blocked pipe to the reservoir, or deflated onto the
emergency spring.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import SECONDARY_VERTICAL, Component
from railsim.effects._elements import Weakened
from railsim.effects._references import BRUNI
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class AirSpringStiffness(Weakened, frozen=True):
    """Vertical secondary stiffness of both sides by one factor; the roll bar stays as it is."""

    factor: float = quantity(2.0, unit="-", source=CHOSEN, ge=0.5, le=6.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.15})
    signature: ClassVar[str] = "the body bounces and rolls at other frequencies; stiff springs pass more above them"
    component: ClassVar[Component] = SECONDARY_VERTICAL
    references: ClassVar[tuple[str, ...]] = (BRUNI,)

    def install(self, setup: Setup) -> Setup:
        """Softer or stiffer vertically and in roll, but for the roll bar."""
        bar = {"roll": float(getattr(setup.vehicle, "roll_bar_stiffness", 0.0))}
        return self.weaken(setup, stiffness=self.factor, extra=bar)
