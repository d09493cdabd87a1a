"""Creep law of the contacts and its friction, as a vehicle states them."""

from collections.abc import Mapping
from typing import Any, Literal, Self

import pydantic

from railsim.contact.adhesion import CONDITIONS
from railsim.spec import Spec, quantity

POLACH = "Polach (2005), dry"


class Adhesion(Spec, frozen=True):
    """Creep law and its friction: mu = friction [(1 - ratio) exp(-decay w) + ratio], reduction factors kA and kS
    (Polach 2005).

    `condition` is a preset of `railsim.contact.adhesion`; numbers that are given beside it replace the preset's, and a
    bare name is the condition. A track with a friction of its own replaces `friction`; the fall with the slip velocity
    stays. `law` linear has no limit: no friction, and (kA + kS) / 2 of Kalker's slope.
    """

    condition: str | None = quantity(None, unit="dry, wet, low, very low", source="railsim.contact.adhesion")
    law: Literal["polach", "fastsim", "linear"] = quantity("polach", unit="-", source="creep laws of railsim.contact")
    friction: float = quantity(0.4, unit="-", source="illustrative: dry rail in service", gt=0.0, le=1.0)
    friction_ratio: float = quantity(0.4, unit="-", source=POLACH, gt=0.0, le=1.0)
    friction_decay: float = quantity(0.6, unit="s/m", source=POLACH, ge=0.0)
    k_adhesion: float = quantity(1.0, unit="-", source=POLACH, gt=0.0, le=1.0)
    k_slip: float = quantity(0.4, unit="-", source=POLACH, gt=0.0, le=1.0)
    creep: bool = True

    @pydantic.model_validator(mode="wrap")
    @classmethod
    def _preset(cls, given: Any, handler: pydantic.ModelWrapValidatorHandler[Self]) -> Self:
        """Numbers of the condition where none are given; only those that are given count as set."""
        values = {"condition": given} if isinstance(given, str) else given
        name = values.get("condition") if isinstance(values, Mapping) else None
        if name is None:
            return handler(values)
        if name not in list(CONDITIONS):
            raise ValueError(f"unknown condition; use one of {', '.join(CONDITIONS)}")
        filled = {key: value for key, value in CONDITIONS[name].parameters().items() if key not in values}
        result = handler({**values, **filled})
        result.model_fields_set.difference_update(filled)
        return result

    @pydantic.model_serializer(mode="wrap")
    def _plain(self, handler: pydantic.SerializerFunctionWrapHandler) -> dict[str, Any]:
        """The preset's numbers go by its name, so that another name brings others."""
        values = handler(self)
        preset = CONDITIONS[self.condition].parameters() if self.condition else {}
        return {key: value for key, value in values.items() if key not in preset or key in self.model_fields_set}
