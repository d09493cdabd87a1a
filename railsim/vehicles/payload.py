"""What a vehicle carries: passengers or goods, and the body with them."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, Self

import pydantic

from railsim.spec import Spec, quantity

PASSENGER = 80.0  # kg with luggage (EN 15663: passengers of main line trains)
STANDING = 320.0  # kg/m2 of the area for standing: four passengers a square metre
SPREAD = 0.9  # m; radius of gyration of what is carried about its own centre, in roll (illustrative)
Level = Literal["tare", "half", "full", "crush"]
SHARES: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"tare": (0.0, 0.0), "half": (0.5, 0.0), "full": (1.0, 0.0), "crush": (1.0, 1.0)}
)
"""Share of the seats and of the area for standing that is taken at each level."""


class Payload(Spec, frozen=True):
    """A mass on the body and where its centre is. A bare name is the level: tare, half (half of the seats), full (all
    seats), crush (and four passengers a square metre standing); the vehicle knows its seats.
    """

    level: Level | None = quantity(None, unit="tare, half, full, crush", source="in the manner of EN 15663")
    mass: float | None = quantity(None, unit="kg", source="illustrative; in place of a level", ge=0.0)
    height: float = quantity(1.9, unit="m above the rails", source="illustrative: seated passengers", gt=0.0)
    ahead: float = quantity(0.0, unit="m, of its centre before the middle of the body", source="illustrative")
    left: float = quantity(0.0, unit="m, of its centre beside the middle of the body", source="illustrative")

    @pydantic.model_validator(mode="before")
    @classmethod
    def _level(cls, given: Any) -> Any:
        """A bare name is the level."""
        return {"level": given} if isinstance(given, str) else given

    @pydantic.model_validator(mode="after")
    def _once(self) -> Self:
        """A mass or a level."""
        if self.level is not None and self.mass is not None:
            raise ValueError("give a level or a mass, not both")
        return self

    def carried(self, seats: float, standing_area: float) -> float:
        """Mass [kg] on a vehicle with so many seats and so much area for standing [m2]."""
        if self.mass is not None:
            return self.mass
        seated, standing = SHARES[self.level or "tare"]
        return seated * seats * PASSENGER + standing * standing_area * STANDING


class LoadedBody(NamedTuple):
    """A rigid body: mass [kg], inertia about its centre of gravity [kg m2], and the centre's place: before and beside
    that of the empty body, and above the rails [m].
    """

    mass: float
    inertia: tuple[float, float, float]
    ahead: float
    left: float
    height: float


def loaded(
    empty: LoadedBody, mass: float, height: float, ahead: float = 0.0, left: float = 0.0, spread: float = SPREAD
) -> LoadedBody:
    """A body with a payload (theorem of parallel axes).

    The payload's radius of gyration in roll is `spread` [m], in pitch and yaw that of the empty body. Products of
    inertia, which a payload off the centre adds, are left out.

    Parameters
    ----------
    mass : [kg], below 0 where something is missing. height : of the payload's centre above the rails [m]. ahead, left :
        of its centre before and beside that of the empty body [m].
    """
    total = empty.mass + mass
    share, reduced, up = mass / total, mass * empty.mass / total, height - empty.height
    roll, pitch, yaw = empty.inertia
    growth = total / empty.mass
    return LoadedBody(
        total,
        (
            roll + reduced * (left**2 + up**2) + mass * spread**2,
            pitch * growth + reduced * (ahead**2 + up**2),
            yaw * growth + reduced * (ahead**2 + left**2),
        ),
        empty.ahead + share * ahead,
        empty.left + share * left,
        empty.height + share * up,
    )
