"""Lateral bump stop with too small a gap: wrong shims, body off centre, swollen rubber."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from railsim.effects._bogies import BogieEffect
from railsim.effects._elements import bump_stop
from railsim.effects.interface import CHOSEN, Setup
from railsim.spec import quantity


class BumpStopContact(BogieEffect, frozen=True):
    """The gap of the lateral bump stop is narrower by `closed`, and its middle is shifted by `offset`."""

    closed: float = quantity(0.9, unit="- of the nominal gap", source=CHOSEN, ge=0.0, le=1.0)
    offset: float = quantity(0.0, unit="m, to the left", source=CHOSEN, ge=-0.03, le=0.03)

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"closed": 0.0, "offset": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"closed": 0.9})
    signature: ClassVar[str] = "lateral jerks of the body, and a stiff response, once it comes near the stop"
    references: ClassVar[tuple[str, ...]] = ("Iwnicki (1998): the characteristic of the stop",)

    def install(self, setup: Setup) -> Setup:
        """A stop with another gap."""
        return bump_stop(setup, self, self.closed, self.offset)
