"""Designs: which values the keys of a scenario take together, on a grid or sampled."""

import itertools
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import qmc

from railsim.errors import InputError

GRID, SOBOL, LATIN, INDICES = "grid", "sobol", "latin_hypercube", "sobol_indices"
KINDS = (GRID, SOBOL, LATIN, INDICES)
MOST_POINTS = 1_000_000
_RANGE_KEYS = {"low", "high", "scale", "integer", "points"}

Level = tuple[Any, dict[str, Any]]
"""What stands in the table, and the values by dotted key that it stands for."""


@dataclass(frozen=True)
class Alternatives:
    """A factor with named or plain alternatives; in a sampled design all are equally likely."""

    name: str
    given: tuple[Level, ...]

    def at(self, share: float) -> Level:
        """The alternative at a place in [0, 1)."""
        return self.given[min(int(share * len(self.given)), len(self.given) - 1)]

    def size(self) -> int:
        """How many they are."""
        return len(self.given)

    def levels(self) -> tuple[Level, ...]:
        """All, in the order given."""
        return self.given


@dataclass(frozen=True)
class Interval:
    """A factor between two numbers, uniform in the number or in its logarithm."""

    name: str
    low: float
    high: float
    logarithmic: bool
    integer: bool
    points: int | None

    def at(self, share: float) -> Level:
        """The value at a place in [0, 1]."""
        if self.integer:
            whole = int(self.low) + min(int(share * (self.high - self.low + 1)), int(self.high - self.low))
            return whole, {self.name: whole}
        if self.logarithmic:
            value = math.exp((1.0 - share) * math.log(self.low) + share * math.log(self.high))
        else:
            value = (1.0 - share) * self.low + share * self.high
        value = min(max(value, self.low), self.high)
        return value, {self.name: value}

    def size(self) -> int:
        """Number of values on a grid; raises `InputError` where it is not given."""
        if self.points is None:
            raise InputError(f"design.keys.{self.name}.points: missing; a grid needs the number of values")
        return self.points

    def levels(self) -> tuple[Level, ...]:
        """As many values from low to high, for a grid."""
        steps = max(self.size() - 1, 1)
        return tuple(self.at(number / steps) for number in range(self.size()))


Factor = Alternatives | Interval


@dataclass(frozen=True)
class Design:
    """A design, and the points it makes.

    Attributes
    ----------
    kind : one of `KINDS`.
    factors : what is varied; on a grid the first varies slowest.
    points : of a sampled design; of "sobol_indices" the base number n, which makes n (factors + 2) points.
    seed : of the scrambling or the permutations; not of the noise.
    """

    kind: str
    factors: tuple[Factor, ...]
    points: int | None = None
    seed: int = 1

    def rows(self) -> list[tuple[Level, ...]]:
        """One level a factor for every point, in design order; the same on every call.

        Raises
        ------
        InputError : the number of points does not suit the kind of design.
        """
        if self.kind == GRID:
            self._check_size(math.prod(factor.size() for factor in self.factors))
            return list(itertools.product(*(factor.levels() for factor in self.factors)))
        return [
            tuple(factor.at(float(share)) for factor, share in zip(self.factors, row, strict=True))
            for row in self._shares()
        ]

    def _check_size(self, points: int) -> None:
        """Raise `InputError` where there are more points than are ever run, before any of them is made."""
        if points > MOST_POINTS:
            raise InputError(f"design: makes {points} points, more than {MOST_POINTS}; vary fewer keys or values")

    def _shares(self) -> np.ndarray:
        """Places in the unit cube, shape (points, factors)."""
        size, count = len(self.factors), self.points or 0
        self._check_size(count * (size + 2) if self.kind == INDICES else count)
        rng = np.random.default_rng(self.seed)
        if self.kind == LATIN:
            return qmc.LatinHypercube(size, rng=rng).random(count)
        if count & (count - 1):
            near = 2 ** max(1, round(math.log2(count)))
            raise InputError(f"design.points: {count} is not a power of 2, which a Sobol sequence needs; use {near}")
        if self.kind == SOBOL:
            return qmc.Sobol(size, rng=rng).random(count)
        return saltelli(qmc.Sobol(2 * size, rng=rng).random(count))


def saltelli(both: np.ndarray) -> np.ndarray:
    """Points for first and total order indices: A, B, then for each factor A with that column from B.

    Saltelli et al. (2010), Comput. Phys. Commun. 181, 259-270; the order that `scipy.stats.sobol_indices` takes
    function values in. `both`: A and B side by side, shape (n, 2 d); the result has shape (n (d + 2), d).
    """
    size = both.shape[1] // 2
    first, second = both[:, :size], both[:, size:]
    mixed = [np.where(np.arange(size) == column, second, first) for column in range(size)]
    return np.concatenate([first, second, *mixed])


def read_design(given: Any) -> Design:
    """The design in a sweep's settings: kind, keys, and for a sampled one points and seed.

    Raises
    ------
    InputError : one line that names the dotted key that is wrong.
    """
    if not isinstance(given, Mapping):
        raise InputError("design: give a kind and keys, for example {kind: grid, keys: {speed.speed: [10, 20]}}")
    unknown = sorted(str(key) for key in given if key not in ("kind", "keys", "points", "seed"))
    if unknown:
        raise InputError(f"design.{unknown[0]}: unknown key; a design knows kind, keys, points, seed")
    kind = given.get("kind", GRID)
    if kind not in KINDS:
        raise InputError(f"design.kind: unknown design '{kind}'; there are: {', '.join(KINDS)}")
    keys = given.get("keys")
    if not isinstance(keys, Mapping) or not keys or not all(isinstance(key, str) for key in keys):
        raise InputError("design.keys: give at least one dotted key of the scenario with its values")
    points = given.get("points")
    if kind == GRID and points is not None:
        raise InputError("design.points: a grid has as many points as its values make; leave it out")
    if kind != GRID and not (isinstance(points, int) and _whole(points) and 1 <= points <= MOST_POINTS):
        raise InputError(f"design.points: give the number of points of the {kind} design (got {points!r})")
    seed = given.get("seed", 1)
    if not _whole(seed) or seed < 0:
        raise InputError(f"design.seed: give a whole number from 0 (got {seed!r})")
    return Design(kind, tuple(_factor(key, value, f"design.keys.{key}") for key, value in keys.items()), points, seed)


def _factor(name: str, given: Any, where: str) -> Factor:
    if isinstance(given, list):
        return Alternatives(name, _levels({_label(value): {name: value} for value in given}, given, where))
    if isinstance(given, Mapping) and set(given) == {"alternatives"}:
        named = given["alternatives"]
        if not isinstance(named, Mapping) or not all(isinstance(one, Mapping) for one in named.values()):
            raise InputError(f"{where}.alternatives: give names, each with the values that it sets by dotted key")
        return Alternatives(name, _levels({str(label): dict(one) for label, one in named.items()}, named, where))
    if isinstance(given, Mapping) and {"low", "high"} <= set(given) <= _RANGE_KEYS:
        return _interval(name, given, where)
    raise InputError(f"{where}: give a list of values, {{low: ..., high: ...}} or {{alternatives: {{NAME: ...}}}}")


def _levels(named: Mapping[Any, dict[str, Any]], given: Any, where: str) -> tuple[Level, ...]:
    if not named:
        raise InputError(f"{where}: has no values; give at least one")
    if len(named) != len(given):
        raise InputError(f"{where}: a value appears twice; keep one")
    return tuple(named.items())


def _interval(name: str, given: Mapping[str, Any], where: str) -> Interval:
    low, high, scale = given["low"], given["high"], given.get("scale", "linear")
    for key, value in (("low", low), ("high", high)):
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(f"{where}.{key}: {value!r} is not a number")
    if not low < high:
        raise InputError(f"{where}.high: {high:g} must be greater than low ({low:g})")
    if scale not in ("linear", "log"):
        raise InputError(f"{where}.scale: '{scale}' is neither linear nor log")
    if scale == "log" and low <= 0:
        raise InputError(f"{where}.low: {low:g}; a logarithmic scale needs numbers above 0")
    integer, points = given.get("integer", False), given.get("points")
    if not isinstance(integer, bool) or (integer and (int(low) != low or int(high) != high or scale == "log")):
        raise InputError(f"{where}.integer: true needs whole low and high on a linear scale")
    if points is not None and (not _whole(points) or not 2 <= points <= MOST_POINTS):
        raise InputError(f"{where}.points: give a whole number from 2 (got {points!r})")
    return Interval(name, float(low), float(high), scale == "log", integer, points)


def _label(value: Any) -> Any:
    """A plain value as it is, anything else as JSON."""
    if isinstance(value, str | int | float | bool):
        return value
    return json.dumps(value, sort_keys=True)


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def column_values(labels: Sequence[Any]) -> tuple[str, list[Any]]:
    """(type, values) of a design value's column: "number" where all are numbers, else "text"."""
    if all(isinstance(label, int | float) and not isinstance(label, bool) for label in labels):
        return "number", [float(label) for label in labels]
    return "text", [label if isinstance(label, str) else json.dumps(label) for label in labels]
