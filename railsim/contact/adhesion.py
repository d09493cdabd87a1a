"""Adhesion conditions dry, wet, low and very low: parameters of the creep laws (Polach 2005), each with its source.

Friction: mu = friction [(1 - ratio) exp(-decay w) + ratio] at slip velocity w. The creep force starts with
(kA + kS) / 2 of Kalker's slope. For the two low conditions the project's reference data quote kA = 1 and kS = 0.4
besides friction, none of it confirmed; with these their curves would start as steeply as the dry one, although Ward et
al. (2011), section 4.2 and Fig. 8, build on initial slopes that differ. Their kA and kS here are illustrative: each
condition starts half as steeply as the one before it.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from types import MappingProxyType

from railsim.errors import InputError


@dataclass(frozen=True)
class AdhesionCondition:
    """State of wheel and rail surfaces.

    Attributes
    ----------
    friction : mu0 [-]; friction_ratio : A [-]; friction_decay : B [s/m].
    k_adhesion, k_slip : kA, kS [-], reduction factors in the areas of adhesion and of slip.
    source : where the numbers come from.
    """

    friction: float
    friction_ratio: float
    friction_decay: float
    k_adhesion: float
    k_slip: float
    source: str

    @property
    def initial_share(self) -> float:
        """Slope at vanishing creepage as a share of Kalker's [-]."""
        return 0.5 * (self.k_adhesion + self.k_slip)

    def parameters(self) -> dict[str, float]:
        """The five numbers under the names of a vehicle's `adhesion` settings."""
        values = asdict(self)
        del values["source"]
        return values


_FRICTION = "friction as used for low adhesion in published studies, not confirmed; kA, kS illustrative"

DRY = AdhesionCondition(0.55, 0.40, 0.60, 1.0, 0.4, "Polach (2005), dry")
WET = AdhesionCondition(0.30, 0.40, 0.20, 0.3, 0.1, "Polach (2005), wet")
LOW = AdhesionCondition(0.06, 0.40, 0.20, 0.15, 0.05, _FRICTION)
VERY_LOW = AdhesionCondition(0.03, 0.40, 0.10, 0.075, 0.025, _FRICTION)

CONDITIONS: Mapping[str, AdhesionCondition] = MappingProxyType(
    {"dry": DRY, "wet": WET, "low": LOW, "very low": VERY_LOW}
)
"""From the best adhesion to the worst."""


def adhesion_condition(name: str) -> AdhesionCondition:
    """The condition of that name.

    Raises
    ------
    InputError : there is none.
    """
    if name not in CONDITIONS:
        raise InputError(f"adhesion '{name}' is unknown; use one of {', '.join(CONDITIONS)}")
    return CONDITIONS[name]
