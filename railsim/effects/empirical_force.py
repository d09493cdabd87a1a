"""Force law that is known by its numbers only: what a comparison of model and recording found."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import ClassVar, Literal, Self

import numpy as np
import pydantic

from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.errors import InputError
from railsim.force_laws import Tabulated
from railsim.model import TRACK, NonlinearElement
from railsim.spec import quantity

FINEST = 257  # points of a table along one axis at most


class EmpiricalForce(Effect, frozen=True):
    """A force that opposes the movement of `upper` against `lower` along one axis, tabled over displacement and
    velocity
    (rates), linear between the points and held beyond them.

    `lower` may be `track`: then the force acts on `upper` alone. `force` has one row for each displacement, in it one
    number for each velocity.
    """

    scale: float = quantity(1.0, unit="- of the table", source=CHOSEN, ge=0.0, le=3.0)
    upper: str = quantity("body", unit="body", source=CHOSEN)
    lower: str = quantity("bogie", unit="body, or track", source=CHOSEN)
    axis: Literal["x", "y", "z", "roll", "pitch", "yaw"] = quantity("y", unit="-", source=CHOSEN)
    position: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.9), unit="m, place in the vehicle frame, from the leading bogie", source=CHOSEN
    )
    displacement: tuple[float, ...] = quantity((-0.02, 0.0, 0.02), unit="m or rad", source=CHOSEN, min_length=2)
    velocity: tuple[float, ...] = quantity((-0.2, 0.2), unit="m/s or rad/s", source=CHOSEN, min_length=2)
    force: tuple[tuple[float, ...], ...] = quantity(
        ((-3000.0, -1000.0), (-1000.0, 1000.0), (1000.0, 3000.0)), unit="N or N m", source=CHOSEN
    )

    absent: ClassVar[Mapping[str, float]] = MappingProxyType({"scale": 0.0})
    smallest: ClassVar[Mapping[str, float]] = MappingProxyType({"scale": 0.1})
    signature: ClassVar[str] = (
        "whatever the table says: a force between two bodies that the nominal vehicle does not have"
    )
    named: ClassVar[bool] = False  # a table answers `unknown`
    references: ClassVar[tuple[str, ...]] = (
        "Masri and Caughey (1979), A nonparametric identification technique for nonlinear dynamic problems, "
        "Journal of Applied Mechanics 46: force-state mapping",
    )

    @pydantic.model_validator(mode="after")
    def _whole(self) -> Self:
        for name in ("displacement", "velocity"):
            if not (np.diff(getattr(self, name)) > 0.0).all():
                raise ValueError(f"{name} must increase")
        if len(self.force) != len(self.displacement) or {len(row) for row in self.force} != {len(self.velocity)}:
            raise ValueError("force needs a row for each displacement, with a number for each velocity")
        return self

    def install(self, setup: Setup) -> Setup:
        """An element with the table as its law.

        Raises
        ------
        InputError : a body that the vehicle has not.
        """
        known = [body.name for body in setup.model.bodies]
        for name in (self.upper, self.lower):
            if name not in (known if name == self.upper else [*known, TRACK]):
                raise InputError(f"effect '{self.kind}': no body '{name}'; there are: {', '.join(known)}")
        if self.scale == 0.0:
            return setup
        across, along = _even(self.displacement), _even(self.velocity)
        rows = np.array([np.interp(along, self.velocity, row) for row in self.force])
        table = self.scale * np.column_stack([np.interp(across, self.displacement, column) for column in rows.T])
        law = Tabulated(
            float(across[0]), float(across[1] - across[0]), float(along[0]), float(along[1] - along[0]), table
        )
        added = NonlinearElement(
            f"empirical_{self.upper}_{self.lower}_{self.axis}",
            self.upper,
            self.lower,
            self.position,
            self.axis,
            law,
        )
        return setup.modelled(lambda model: replace(model, nonlinear=(*model.nonlinear, added)))


def _even(points: tuple[float, ...]) -> np.ndarray:
    """Equal steps over the range of `points`, the smallest of theirs where that is not too fine."""
    steps = np.diff(points)
    count = int(np.clip(np.ceil((points[-1] - points[0]) / steps.min() - 1e-9), 1, FINEST - 1))
    return np.linspace(points[0], points[-1], count + 1)
