"""Wheel whose centre of mass is off the axle."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar, Literal

from railsim.effects._bogies import WheelsetNumber, wheelset_field
from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.effects.wheel_changes import unbalanced
from railsim.spec import quantity


class WheelUnbalance(Effect, frozen=True):
    """Centrifugal force U w^2 that turns with the wheel, up and along the track."""

    unbalance: float = quantity(0.5, unit="kg m", source=CHOSEN, ge=0.0, le=5.0)
    phase: float = quantity(0.0, unit="rad, at which it is lowest", source=CHOSEN, role="phase", ge=0.0, le=6.2832)
    wheelset: WheelsetNumber = wheelset_field()
    side: Literal["left", "right", "both"] = quantity("left", unit="-", source=CHOSEN)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"unbalance": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"unbalance": 0.05})
    signature: ClassVar[str] = (
        "a tone at v / (2 pi r) that grows with the square of the speed; on one wheel also in yaw"
    )
    acts_on: ClassVar[str] = "wheel"
    family: ClassVar[str] = "once_per_turn"
    references: ClassVar[tuple[str, ...]] = (
        "EN 13260: residual unbalance of wheelsets up to 0.05 kg m above 120 km/h",
    )

    def install(self, setup: Setup) -> Setup:
        """A rotating force at the wheel."""
        return unbalanced(setup, self, self.wheelset, self.side, (self.unbalance, self.phase))
