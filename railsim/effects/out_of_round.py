"""Wheel that is not round: a wave of the radius around the turn."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar, Literal

from railsim.effects._bogies import WheelsetNumber, wheelset_field
from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.effects.wheel_changes import wavy
from railsim.spec import quantity


class OutOfRound(Effect, frozen=True):
    """Radius r + amplitude cos(order (angle - phase)) of one wheel or both."""

    amplitude: float = quantity(2e-4, unit="m", source=CHOSEN, ge=0.0, le=1.5e-3)
    order: int = quantity(1, unit="waves a turn", source=CHOSEN, role="order", ge=1, le=30)
    phase: float = quantity(0.0, unit="rad", source=CHOSEN, role="phase", ge=0.0, le=6.2832)
    wheelset: WheelsetNumber = wheelset_field()
    side: Literal["left", "right", "both"] = quantity("left", unit="-", source=CHOSEN)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"amplitude": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"amplitude": 2e-5})
    signature: ClassVar[str] = "a tone of axlebox and bogie at a multiple of v / (2 pi r), at all speeds"
    acts_on: ClassVar[str] = "wheel"
    family: ClassVar[str] = "once_per_turn"
    references: ClassVar[tuple[str, ...]] = (
        "Nielsen and Johansson (2000), Out-of-round railway wheels: a literature survey, Proc. IMechE Part F 214",
    )

    def install(self, setup: Setup) -> Setup:
        """A periodic deviation of the radius."""
        return wavy(setup, self, self.wheelset, self.side, (self.amplitude, self.order, self.phase))
