"""What the inference knows of a system: y = f(x) + e, e ~ N(0, S(psi)), S = sum_k exp(2 psi_k) K_k.

x are coordinates of the mean: build, sensors, alignment, sizes of effects. psi are logs of levels of error: a sensor's
noise, the error of a measured input, a latent force at a place, a latent reading, a law without a name. A hypothesis is
a set of priors on these: an effect is the fault prior of a coordinate in place of the healthy one, something unknown
at a place is the wide prior of that place's level.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, Self, TypeVar

import numpy as np

from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.priors import LogNormal, Prior
from railsim.errors import InputError

DIFFERENCE = 0.005  # of a prior's standard deviation; step of the derivatives

T = TypeVar("T")

Predicted = tuple[np.ndarray, ...]
"""(points, F, T, C) of each group."""


@dataclass(frozen=True)
class Coordinate:
    """A coordinate of the mean: normal prior with `mean` and `spread` (sd), in `unit`; `step` of its derivatives, where
    the predictions bend more than the prior's spread tells, negative where it may not grow; `cheap` where its
    derivative costs next to nothing.
    """

    name: str
    unit: str
    mean: float
    spread: float
    step: float | None = None
    cheap: bool = False

    @property
    def difference(self) -> float:
        """Step of the derivatives."""
        return self.step or DIFFERENCE * self.spread

    @property
    def most(self) -> float:
        """Beyond which it changes nothing."""
        return self.mean if self.difference < 0.0 else math.inf


@dataclass(frozen=True)
class Level:
    """The level of an error: amplitude exp(psi), 1 = as its source states it, or as large as what acts at `place`.

    `kind`: "sensor", "input", "force", "reading" or "law". `place`: None where no unknown is looked for. `prior`: of a
    healthy system. `law` : wide priors of coordinates of what acts there: where something there is unknown, the part of
    it that follows the motion is unknown too.
    """

    name: str
    kind: str
    prior: Prior
    place: str | None = None
    law: tuple[Coordinate, ...] = ()


@dataclass(frozen=True)
class Effect:
    """Something that a library knows and that may be missing in the model.

    Attributes
    ----------
    name, family : of the same family are variants that one name stands for.
    faults : fault prior of coordinates that every hypothesis has, by name. own : coordinates that only this one has.
    moves : healthy coordinates, and how far its one own coordinate moves each per unit, where it does what these
    tolerances do together. starts : values (len(faults) + len(own),) from which the search begins; () = the means of
    the priors. place : where it acts; something unknown there beside it is an unknown like it, and no effect with an
    unknown. seek : further starts from what a fit without the effect leaves, by the system and that fit. kind : "name";
    "law" = something unknown at `place`, by coordinates of a law that every hypothesis has, with wide priors; "small" =
    of a size that healthy systems have. healthy : priors of `own` where healthy systems have a little of it. shown :
    what its own coordinates change of the nominal predictions, to first order in a size or sums of these, (K, F, T, C)
    of each group, where that is known. entry : name in the library, where that is another than `name`.
    """

    name: str
    family: str
    faults: tuple[Coordinate, ...] = ()
    own: tuple[Coordinate, ...] = ()
    moves: tuple[tuple[str, float], ...] = ()
    starts: tuple[tuple[float, ...], ...] = ()
    place: str | None = None
    seek: "Callable[[Any, Fit], list[tuple[float, ...]]] | None" = None
    kind: str = "name"
    healthy: tuple[Coordinate, ...] = ()
    shown: tuple[np.ndarray, ...] | None = field(default=None, compare=False, repr=False)
    entry: str | None = None

    @property
    def listed(self) -> str:
        """The name under which the library has it."""
        return self.entry or self.name

    @property
    def linear(self) -> bool:
        """Whether what it changes is nearly in proportion to its numbers: a law's, or one alone."""
        return self.kind == "law" or len(self.faults) + len(self.own) == 1

    def sought(self, base: "Fit") -> "Effect":
        """The effect with the starts that a fit without it suggests."""
        return self if self.seek is None else replace(self, starts=(*self.starts, *self.seek(base.system, base)))

    def small(self) -> "Effect":
        """The same as healthy systems have it."""
        return replace(self, name=f"small {self.name}", kind="small", own=self.healthy, entry=self.listed)

    def begins(self, x: np.ndarray, healthy: Sequence[Coordinate]) -> list[np.ndarray]:
        """Coordinates with this effect beside what x holds: from where the predictions are those at x, if it does what
        tolerances do, and from each of its starts.
        """
        index = [[one.name for one in healthy].index(fault.name) for fault in self.faults]
        means = tuple(one.mean for one in (*self.faults, *self.own))
        found = []
        for start in self.starts or (means,):
            moved = x.copy()
            moved[index] = start[: len(index)]
            found.append(np.concatenate([moved, start[len(index) :]]))
        if self.moves:
            found.insert(0, self._in_place(x, healthy))
        return found if self.own else [x.copy(), *found]

    def _in_place(self, x: np.ndarray, healthy: Sequence[Coordinate]) -> np.ndarray:
        """Of the points that predict what x does the likeliest beforehand: tolerances give back what they had taken."""
        (own,), along, count = self.own, self.along(healthy), len(healthy)
        means, spreads = np.array([(one.mean, one.spread) for one in healthy]).T
        weight = np.sum((along / spreads) ** 2) + own.spread**-2
        size = (along @ ((x[:count] - means) / spreads**2) + own.mean / own.spread**2) / weight
        return np.r_[x[:count] - size * along, x[count:], size]

    def along(self, healthy: Sequence[Coordinate]) -> np.ndarray:
        """(coordinates,) how far its own coordinate moves each healthy one."""
        rates = dict(self.moves)
        return np.array([rates.get(one.name, 0.0) for one in healthy])


@dataclass(frozen=True)
class Hypothesis:
    """Effects of the library, and the levels of a place where something is unknown."""

    effects: tuple[Effect, ...] = ()
    unknown: tuple[Level, ...] = ()

    @property
    def name(self) -> str:
        """`none`, `drag`, `drag + delay`, `unknown: force`, `drag + unknown: force`."""
        parts = [effect.name for effect in self.effects]
        parts += [f"unknown: {self.unknown[0].place}"] if self.unknown else []
        return " + ".join(parts) or "none"

    @property
    def named(self) -> tuple[Effect, ...]:
        """Its effects that stand for a name."""
        return tuple(effect for effect in self.effects if effect.kind == "name")

    @property
    def families(self) -> frozenset[str]:
        """Of its named effects."""
        return frozenset(effect.family for effect in self.named)

    @property
    def place(self) -> str | None:
        """Where something unknown is."""
        laws = [effect.place for effect in self.effects if effect.kind == "law"]
        return self.unknown[0].place if self.unknown else laws[0] if laws else None

    def coordinates(self, healthy: Sequence[Coordinate]) -> tuple[Coordinate, ...]:
        """Those of the system with the priors of the unknown and of the effects, then the effects' own."""
        faults = {one.name: one for level in self.unknown for one in level.law}
        faults |= {one.name: one for effect in self.effects for one in effect.faults}
        base = tuple(faults.get(one.name, one) for one in healthy)
        return base + tuple(one for effect in self.effects for one in effect.own)

    def places(self, healthy: Sequence[Coordinate]) -> list[list[int]]:
        """Of each effect: where its faults and its own coordinates stand in x."""
        names, column, found = [one.name for one in healthy], len(healthy), []
        for effect in self.effects:
            own = range(column, column + len(effect.own))
            found.append([*(names.index(one.name) for one in effect.faults), *own])
            column += len(effect.own)
        return found

    def levels(self, healthy: Sequence[Level], policy: Policy) -> tuple[Level, ...]:
        """Those of the system, with the wide prior of the unknown."""
        wide, names = LogNormal(policy.unknown_median, policy.unknown_spread), {one.name for one in self.unknown}
        return tuple(replace(one, prior=wide) if one.name in names else one for one in healthy)


def as_healthy(
    points: np.ndarray, effects: tuple[Effect, ...], healthy: Sequence[Coordinate]
) -> tuple[np.ndarray, tuple[Effect, ...]]:
    """Points (..., coordinates) and effects with the same predictions, without effects that do what tolerances do."""
    if not any(one.moves for one in effects):
        return points, effects
    count = len(healthy)
    column, base, kept = count, points[..., :count], [np.arange(count)]
    for one in effects:
        if one.moves:
            base = base + points[..., column, None] * one.along(healthy)
        else:
            kept.append(np.arange(column, column + len(one.own)))
        column += len(one.own)
    others = points[..., np.concatenate(kept)[count:]]
    return np.concatenate([base, others], axis=-1), tuple(one for one in effects if not one.moves)


@dataclass(frozen=True)
class Group:
    """Residuals that share covariances: F of them, T times each, C joint values (channels, or samples).

    `residual` (F, T, C), `components` (levels, F, C, C). Complex values of a frame of redundancy 2 and real ones of a
    plain record count alike: half a log determinant and half a square each.
    """

    residual: np.ndarray
    components: np.ndarray


class System(Protocol):
    """Physics and sources of error of one record; makes no decisions."""

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """Healthy ones, in the order of x."""
        ...

    @property
    def levels(self) -> tuple[Level, ...]:
        """Of a healthy system, in the order of psi."""
        ...

    @property
    def observed(self) -> tuple[np.ndarray, ...]:
        """(F, T, C) of each group."""
        ...

    def starts(self) -> np.ndarray:
        """(starts, coordinates): where a search over alignment and initial state begins."""
        ...

    def predict(self, points: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """(points, F, T, C) of each group at `points` (points, coordinates of the hypothesis)."""
        ...

    def covariances(self, x: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """(levels, F, C, C) of each group at the state that x predicts."""
        ...

    def about(self, x: np.ndarray, effects: tuple[Effect, ...], psi: np.ndarray | None) -> "System":
        """The system with what it knows at a state: the mean of a measured input given its error's level (`psi`, None =
        as stated), and what the mean of the predictions there lies off from one run.
        """
        ...

    def settle(self, x: np.ndarray) -> bool:
        """Choose anew what all hypotheses share, by the fit x of the healthy system; `about` then goes by that. Gives
        whether the choice has changed.
        """
        ...

    def predict_each(self, points: Sequence[tuple[np.ndarray, tuple[Effect, ...]]]) -> list[Predicted]:
        """`predict` of several hypotheses."""
        ...

    def side_by_side(self, tasks: Sequence[Callable[[], T]]) -> list[T]:
        """Results of tasks that ask for predictions, in their order; what they ask for at a time is made together."""
        ...

    @property
    def dear(self) -> bool:
        """Whether predictions take most of the time: then effects are ordered before any is fitted."""
        ...


class OneByOne:
    """A system that gains nothing by doing several things at once, and whose hypotheses share no choice."""

    def settle(self, x: np.ndarray) -> bool:
        """There is nothing to choose."""
        del x
        return False

    @property
    def dear(self) -> bool:
        """Predictions are cheap."""
        return False

    def predict_each(self: System, points: Sequence[tuple[np.ndarray, tuple[Effect, ...]]]) -> list[Predicted]:
        """One after the other."""
        return [self.predict(at, effects) for at, effects in points]

    def side_by_side(self, tasks: Sequence[Callable[[], T]]) -> list[T]:
        """One after the other."""
        return [task() for task in tasks]


class Still(OneByOne):
    """A system that knows everywhere the same."""

    def about(self, x: np.ndarray, effects: tuple[Effect, ...], psi: np.ndarray | None) -> Self:
        """Itself."""
        del x, effects, psi
        return self


@dataclass(frozen=True)
class Library:
    """All effects that may be named."""

    effects: tuple[Effect, ...]

    def __post_init__(self) -> None:
        names = [effect.name for effect in self.effects]
        if len(set(names)) < len(names):
            raise InputError(f"library: two effects have one name; names are {', '.join(names)}")

    @property
    def families(self) -> tuple[str, ...]:
        """Of the named effects, in their order."""
        return tuple(dict.fromkeys(effect.family for effect in self.effects if effect.kind == "name"))

    def without(self, *families: str) -> "Library":
        """The library that does not know these families."""
        return Library(tuple(effect for effect in self.effects if effect.family not in families))

    @property
    def small(self) -> tuple[Effect, ...]:
        """Effects that healthy systems have a little of, as they have it."""
        return tuple(effect.small() for effect in self.effects if effect.healthy)


@dataclass(frozen=True)
class Fit:
    """A hypothesis at its optimum.

    Attributes
    ----------
    system : with what it knows there. x, psi : coordinates and logs of levels. cost : minus the log of the posterior's
    density there, without the part that all hypotheses share. evidence : log of the marginal likelihood by Laplace,
    likewise [nats].
    precision, level_precision : second derivatives of the cost by x and by psi.
    groups, slopes : residuals with covariances, and the predictions' derivatives (coordinates, F, T, C) of each.
    """

    hypothesis: Hypothesis
    system: System
    x: np.ndarray
    psi: np.ndarray
    cost: float
    evidence: float
    precision: np.ndarray
    level_precision: np.ndarray
    groups: tuple[Group, ...]
    slopes: tuple[np.ndarray, ...]

    def light(self) -> "Fit":
        """Without its large arrays."""
        return replace(self, groups=(), slopes=())
