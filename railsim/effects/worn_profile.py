"""Wheels worn hollow: conformal with the rail."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.contact.pairs import WheelRailPair
from railsim.effects.interface import CHOSEN, Effect, Setup, changed
from railsim.profiles.pair import ProfilePair
from railsim.spec import quantity


class WornProfile(Effect, frozen=True):
    """Wear of `railsim.profiles.wear` where the pair has profiles; on an analytic pair the tread becomes conformal:
    conicity by 1 + 1.5 severity, difference of the arcs' radii less by half at severity 1.
    """

    severity: float = quantity(0.5, unit="-", source=CHOSEN, ge=0.0, le=1.0)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"severity": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"severity": 0.1})
    signature: ClassVar[str] = (
        "higher conicity: shorter kinematic waves, earlier hunting, a contact that wanders widely"
    )
    acts_on: ClassVar[str] = "wheel"
    family: ClassVar[str] = "conicity"
    references: ClassVar[tuple[str, ...]] = ("EN 15302: equivalent conicity", "railsim.profiles.wear")

    def install(self, setup: Setup) -> Setup:
        """Another pair of profiles."""
        if self.severity == 0.0:
            return setup
        severity = self.severity

        def worn(pair: WheelRailPair | ProfilePair) -> WheelRailPair | ProfilePair:
            if isinstance(pair, ProfilePair):
                return pair.but(wear=min(1.0, pair.wear + severity))
            radii_apart = pair.wheel_profile_radius - pair.rail_head_radius
            radius = pair.rail_head_radius + radii_apart * (1.0 - 0.5 * severity)
            steeper = min(0.6, pair.conicity * (1.0 + 1.5 * severity))
            return pair.but(conicity=steeper, wheel_profile_radius=radius)

        return changed(setup, self, pair=worn)
