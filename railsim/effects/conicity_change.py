"""Wheels that roll with another conicity than the nominal profiles."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import ALL, Wheelsets
from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.effects.wheel_changes import conicity
from railsim.spec import quantity


class ConicityChange(Effect, frozen=True):
    """Deviation of the rolling radius from its value at the centre by one factor, of all wheelsets or one; contact
    angles stay as they are.
    """

    factor: float = quantity(1.6, unit="-", source=CHOSEN, ge=0.3, le=4.0)
    wheelset: Wheelsets = quantity(ALL, unit="-, 1 leading", source=CHOSEN, role="wheelset")

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"factor": 1.1})
    signature: ClassVar[str] = "the kinematic wavelength changes with 1 / sqrt(factor), and hunting is less damped"
    acts_on: ClassVar[str] = "wheel"
    family: ClassVar[str] = "conicity"
    references: ClassVar[tuple[str, ...]] = (
        "Klingel (1883): wavelength 2 pi sqrt(r0 l / conicity)",
        "EN 15302: equivalent conicity",
    )

    added: ClassVar[tuple[str, ...]] = ("wheelset",)

    def install(self, setup: Setup) -> Setup:
        """Another rolling radius function."""
        return conicity(setup, self, self.factor, self.wheelset)
