"""Points of a sweep chosen by the values of its factors, for example `at: {place: [good track]}`."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from experiments.sweep.design import Alternatives, Design
from railsim.errors import InputError


@dataclass(frozen=True)
class Selection:
    """By factor the values that are wanted, as they stand in the table; without any factor every point is chosen."""

    wanted: tuple[tuple[str, tuple[Any, ...]], ...] = ()

    def has(self, values: Mapping[str, Any]) -> bool:
        """Whether a point with these design values is chosen."""
        return all(any(_same(values[name], level) for level in chosen) for name, chosen in self.wanted)

    def plain(self) -> dict[str, list[Any]]:
        """As JSON."""
        return {name: list(chosen) for name, chosen in self.wanted}


def _same(value: Any, wanted: Any) -> bool:
    """Equal, or equal to the text that a column of mixed values holds."""
    return value == wanted or value == json.dumps(wanted)


def read_selection(given: Any, where: str, design: Design) -> Selection:
    """The selection under a key `at`.

    Parameters
    ----------
    given : mapping of names of factors to values; None chooses every point.
    where : dotted key for messages.

    Raises
    ------
    InputError : no such factor, a factor without named values, or a value that it does not take.
    """
    if given is None:
        return Selection()
    if not isinstance(given, Mapping) or not given:
        raise InputError(f"{where}: give a factor of the design with its values, for example {{speed.speed: [20]}}")
    return Selection(tuple((str(name), _levels(name, chosen, where, design)) for name, chosen in given.items()))


def _levels(name: Any, given: Any, where: str, design: Design) -> tuple[Any, ...]:
    known = {factor.name: factor for factor in design.factors if isinstance(factor, Alternatives)}
    if name not in known:
        there = ", ".join(known) or "none"
        raise InputError(f"{where}.{name}: no factor of the design with values one by one; there are: {there}")
    labels = [label for label, _ in known[name].given]
    chosen = given if isinstance(given, list) else [given]
    for level in chosen:
        if level not in labels:
            there = ", ".join(str(label) for label in labels)
            raise InputError(f"{where}.{name}: the factor does not take {level!r}; it takes {there}")
    if not chosen:
        raise InputError(f"{where}.{name}: has no values; give at least one")
    return tuple(chosen)
