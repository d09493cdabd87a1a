"""Car body that bends: its first vertical and lateral mode."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._body import bending
from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.spec import quantity


class BodyBending(Effect, frozen=True):
    """Effective mass of the first bending mode on a spring and damper at the body (Craig and Bampton form, one mode in
    each direction): seen from the secondary suspension the body weighs m (1 - share) + m share / (1 - (f /
    frequency)^2).
    """

    share: float = quantity(0.3, unit="- of the body, effective mass of the mode", source=CHOSEN, ge=0.0, le=0.6)
    frequency: float = quantity(
        8.5, unit="Hz, vertically, interface held", source="illustrative: 8 to 12 Hz", role="frequency", ge=4.0, le=25.0
    )
    lateral_ratio: float = quantity(1.3, unit="- lateral to vertical frequency", source="illustrative", gt=0.5)
    damping: float = quantity(0.02, unit="- of critical", source="illustrative: 1 to 3 %", ge=0.0, le=0.3)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"share": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"share": 0.05})
    signature: ClassVar[str] = (
        "a peak of the body's acceleration at the bending frequency (8 to 12 Hz); the bogie hardly changes"
    )
    references: ClassVar[tuple[str, ...]] = (
        "Craig and Bampton (1968), Coupling of substructures for dynamic analyses, AIAA Journal 6",
        "Diana, Cheli, Collina, Corradi, Melzi (2002), The development of a numerical model for railway vehicles "
        "comfort assessment, Vehicle System Dynamics 38",
    )

    def install(self, setup: Setup) -> Setup:
        """A part of the body of its own, on springs."""
        return bending(setup, self, self.share, self.frequency, self.lateral_ratio, self.damping)
