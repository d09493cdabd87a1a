"""Yaw damper whose mounts and oil give way: a spring in series (Maxwell element)."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import YAW_DAMPERS, BogieEffect
from railsim.effects._elements import in_series
from railsim.effects._references import BRUNI
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class YawDamperSeriesStiffness(BogieEffect, frozen=True):
    """Both yaw dampers with a spring of stiffness 1/compliance in series with each: c / (1 + i w c / k)."""

    compliance: float = quantity(2e-7, unit="m/N of each damper", source=CHOSEN, ge=0.0, le=2e-6)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"compliance": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"compliance": 2e-8})
    signature: ClassVar[str] = "the yaw damper works more and more like a spring above k / (2 pi c)"
    references: ClassVar[tuple[str, ...]] = (BRUNI,)

    def install(self, setup: Setup) -> Setup:
        """The dampers become Maxwell elements.

        Raises
        ------
        InputError : the vehicle has no yaw dampers.
        """
        return in_series(setup, self, YAW_DAMPERS, self.compliance)
