"""Polach's creep law and FASTSIM: runs have the first, and what lies between both is a coordinate."""

from typing import Any

from experiments.discrepancy.core.model import Coordinate
from railsim.vehicles.interface import Vehicle


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
