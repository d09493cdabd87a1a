"""Polach's creep law and FASTSIM: runs have the first, and what lies between both is a coordinate."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from experiments.discrepancy.core.model import Coordinate
from railsim.vehicles.interface import Vehicle


@dataclass(frozen=True, eq=False)
class LawChange:
    """What FASTSIM changes in runs by Polach's law, to first order about a point.

    Attributes
    ----------
    point : (coordinates,). there : (F, frames, components), what it changes there. slopes : its derivatives, by the
    place of a coordinate. least, most : (coordinates,), beyond which they change nothing more.
    """

    point: np.ndarray
    there: np.ndarray
    slopes: Mapping[int, np.ndarray] = field(default_factory=dict)
    least: np.ndarray = field(default_factory=lambda: np.empty(0))
    most: np.ndarray = field(default_factory=lambda: np.empty(0))

    def at(self, x: np.ndarray) -> np.ndarray:
        """(F, frames, components) at coordinates x (coordinates,)."""
        moved = {place: min(max(x[place], self.least[place]), self.most[place]) for place in self.slopes}
        sizes = {place: value - self.point[place] for place, value in moved.items()}
        return sum((size * self.slopes[place] for place, size in sizes.items() if size), self.there)


def law_coordinates(vehicle: Vehicle) -> list[Coordinate]:
    """Creep law: 0 is Polach's, 1 is FASTSIM, about that of the data sheet; none where it is neither."""
    sheet = {"polach": 0.0, "fastsim": 1.0}.get(_law(vehicle))
    return [] if sheet is None else [Coordinate("creep law", "-", sheet, 1.0, cheap=True)]


def as_run(vehicle: Vehicle) -> Any:
    """The vehicle with Polach's law in place of FASTSIM, which takes many times as long: the coordinate `creep law`
    holds what is between them.
    """
    return _with_law(vehicle, "polach") if _law(vehicle) == "fastsim" else vehicle


def with_fastsim(vehicle: Vehicle) -> Any:
    """The vehicle with FASTSIM in place of Polach's law; None where it has another."""
    return _with_law(vehicle, "fastsim") if _law(vehicle) == "polach" else None


def _law(vehicle: Any) -> str:
    return str(getattr(getattr(vehicle, "adhesion", None), "law", ""))


def _with_law(vehicle: Any, law: str) -> Any:
    return vehicle.but(adhesion=vehicle.adhesion.but(law=law))
