"""Nominal parameters of a vehicle, as about.json gives them by field name in SI units."""

from collections.abc import Iterable, Mapping
from typing import Any

from railsim.errors import InputError

Parameters = Mapping[str, float]
"""Nominal parameters by field name, SI units."""

VEHICLES = 128
"""Linear vehicles of a kind that are kept: an estimate asks for all that a data sheet leaves open at each speed."""


def given(vehicle: Mapping[str, Any], needed: Iterable[str]) -> bool:
    """Whether all that is needed is given as a number."""
    return all(isinstance(vehicle.get(name), int | float) for name in needed)


def numbers(vehicle: Mapping[str, Any], needed: Iterable[str]) -> dict[str, float]:
    """All parameters that are numbers.

    Raises
    ------
    InputError : some that are needed are not given as numbers; all of them are named.
    """
    _check([name for name in needed if not isinstance(vehicle.get(name), int | float)], vehicle, "a number")
    return {name: float(value) for name, value in vehicle.items() if isinstance(value, int | float)}


def positive_numbers(vehicle: Mapping[str, Any], needed: Iterable[str]) -> dict[str, float]:
    """The parameters that are needed.

    Raises
    ------
    InputError : some of them are not given as positive numbers; all of them are named.
    """
    names = list(needed)
    values = {name: vehicle.get(name) for name in names}
    wrong = [name for name, value in values.items() if not isinstance(value, int | float) or not value > 0]
    _check(wrong, vehicle, "a positive number")
    return {name: float(vehicle[name]) for name in names}


def _check(wrong: list[str], vehicle: Mapping[str, Any], what: str) -> None:
    """Raise `InputError` that names all parameters that are wrong."""
    if len(wrong) == 1:
        value = vehicle.get(wrong[0])
        raise InputError(f"vehicle parameter '{wrong[0]}' is {value!r}; about.json must give {what} in SI units")
    if wrong:
        names = ", ".join(f"'{name}'" for name in wrong)
        raise InputError(f"vehicle parameters {names}: about.json must give {what} in SI units for each")
