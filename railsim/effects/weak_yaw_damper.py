"""Secondary yaw damper that has lost some of its damping, or failed."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import YAW_DAMPERS, Component
from railsim.effects._elements import Weakened
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class WeakYawDamper(Weakened, frozen=True):
    """Both yaw dampers of the bogie together by one factor: 0.5 = one of two has failed, 0 = both."""

    factor: float = quantity(0.5, unit="-", source=CHOSEN, ge=0.0, le=1.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 0.8})
    signature: ClassVar[str] = "the bogie yaws more at its kinematic wavelength, less damped as the speed rises"
    weakens: ClassVar[str] = "secondary_yaw_damping"
    references: ClassVar[tuple[str, ...]] = ("Ward et al. (2011), section 4.1",)
    component: ClassVar[Component] = YAW_DAMPERS

    def install(self, setup: Setup) -> Setup:
        """Less yaw damping between body and bogie."""
        return self.weaken(setup, damping=self.factor)
