"""Flat that a wheel got by sliding, rounded at its ends."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar, Literal

from railsim.effects._bogies import WheelsetNumber, wheelset_field
from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.effects.wheel_changes import flat
from railsim.spec import quantity


class WheelFlat(Effect, frozen=True):
    """Rounded flat of one wheel: the wheel is d/2 (1 - cos(2 pi x / length)) too small, with d = length^2 / (16 r)
    (Newton and Clark 1979).
    """

    length: float = quantity(0.05, unit="m", source=CHOSEN, ge=0.0, le=0.15)
    angle: float = quantity(0.0, unit="rad, of its middle", source=CHOSEN, role="phase", ge=0.0, le=6.2832)
    wheelset: WheelsetNumber = wheelset_field()
    side: Literal["left", "right", "both"] = quantity("left", unit="-", source=CHOSEN)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"length": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"length": 0.02})
    signature: ClassVar[str] = "one impact a turn of the wheel in axlebox and bogie, on one side"
    acts_on: ClassVar[str] = "wheel"
    references: ClassVar[tuple[str, ...]] = (
        "Newton and Clark (1979), An investigation into the dynamic effects on the track of wheelflats on railway "
        "vehicles, Journal of Mechanical Engineering Science 21",
    )

    def install(self, setup: Setup) -> Setup:
        """A dip of the radius over the length; the step resolves it."""
        return flat(setup, self, self.wheelset, self.side, self.length, self.angle)
