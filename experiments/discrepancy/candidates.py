"""Candidates: every effect of the library, in each of its variants, at sizes from just worth naming to large."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin

from railsim import effects as library
from railsim.effects.interface import Effect, Parameter, Prior
from railsim.registry import discover

MOST_VARIANTS = 8
FAR = 0.9  # of the way to a bound
THRESHOLDS = (0.3, 1.0, 0.05)  # of the smallest size's distance from the bound, for numbers like a velocity of blow-off
UNNAMED = ("empirical_force",)  # tabulated laws: an answer to `unknown`, no name
ALIGNED = "speed_scale"  # family that the alignment finds, not the fit
DISTANCES = ("place", "first")  # fields that are a distance along the track [m]
SHORT = ("rail_joints", "hanging_sleepers")  # effects of a place that is short against a section
SEARCHED = (-22.5, -7.5, 7.5, 22.5)  # m from the middle of a loud section, where short ones are tried
TIMES = ("begin",)  # fields that are a time of the run [s]
PHASES = ("phase", "angle")  # held fields that are found all the same [rad]
PHASES_TRIED = 3


@dataclass(frozen=True)
class Context:
    """What the recording says about the effects' numbers.

    Attributes
    ----------
    channels : compared, without units. distance, time : from and to [m], [s]. spots : (distance, time) of the loudest
    sections, where something local may be.
    """

    channels: tuple[str, ...]
    distance: tuple[float, float]
    time: tuple[float, float]
    spots: tuple[tuple[float, float], ...]

    def range(self, name: str, parameter: Parameter) -> Parameter:
        """The parameter with the bounds that the run leaves it, uniform between them; others as they are."""
        limits = self.distance if name in DISTANCES else self.time if name in TIMES else None
        if limits is None:
            return parameter
        low, high = max(limits[0], parameter.low), min(limits[1], parameter.high)
        return parameter._replace(low=low, high=high, prior=Prior(0.5 * (low + high), math.inf))


@dataclass(frozen=True)
class Candidate:
    """An effect with its choices made; numbers stay free.

    Attributes
    ----------
    kind : class of the effect. choices : fields that are fixed (sides, wheelsets, channels).
    """

    kind: type[Effect]
    context: Context
    choices: tuple[tuple[str, Any], ...] = ()

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.kind.__module__.rpartition(".")[2]

    @property
    def label(self) -> str:
        """Name with the choices."""
        made = ", ".join(f"{key} {value}" for key, value in self.choices)
        return f"{self.name} ({made})" if made else self.name

    @property
    def equivalence(self) -> str:
        """Class of effects that look alike."""
        return self.kind.equivalence()

    @property
    def of_sensor(self) -> bool:
        """Whether it changes what the sensors give and not the motion."""
        return self.kind.acts_on == "sensor"

    @property
    def local(self) -> bool:
        """Whether it has a place or a time of its own."""
        return any(name in self.kind.model_fields for name in (*DISTANCES, *TIMES))

    @property
    def speaks_in_places(self) -> bool:
        """Whether a few sections may say all there is to say about it."""
        return self.local or self.kind.acts_on == "track"

    @property
    def phases(self) -> list[str]:
        """Fields that turn with a wheel."""
        return [name for name in PHASES if name in self.kind.held]

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Free numbers."""
        fixed = {name for name, _ in self.choices} | set(self.kind.held) - {*DISTANCES, *self.phases}
        free = {name: one for name, one in self.kind.parameters().items() if name not in fixed}
        return {name: self.context.range(name, one) for name, one in free.items()}

    def step(self, name: str, parameter: Parameter) -> float:
        """Share of a parameter's range by which it is varied for a derivative."""
        span = parameter.high - parameter.low
        return 0.3 / span if name in DISTANCES else 0.05 / span if name in TIMES else 0.03

    def build(self, values: Mapping[str, float]) -> Effect:
        """The effect with these numbers."""
        whole = {name: round(value) if self._whole(name) else value for name, value in values.items()}
        return self.kind.build({**dict(self.choices), **whole})

    def _whole(self, name: str) -> bool:
        return self.kind.model_fields[name].annotation is int

    def sizes(self) -> Iterator[dict[str, float]]:
        """Values of the free numbers to screen with: the middle size first, then smaller and larger ones, to both
        sides of where the effect is absent.
        """
        free = self.parameters
        sized = [name for name, one in free.items() if one.absent is not None and one.smallest is not None]
        ways = [_ladder(free[name]) for name in sized]
        for steps in itertools.zip_longest(*ways) if ways else [()]:
            last = [way[-1] if step is None else step for step, way in zip(steps, ways, strict=True)]
            yield {name: _within(one, one.default) for name, one in free.items()} | dict(zip(sized, last, strict=True))

    @property
    def short(self) -> bool:
        """Whether it acts within a metre or so of a place, which must therefore be found to a fraction of that."""
        return self.name in SHORT

    def variants_of(self, values: Mapping[str, float]) -> Iterator[dict[str, float]]:
        """The same size at the places, times and phases where it may be."""
        free = self.parameters
        where = [name for name in free if name in (*DISTANCES, *TIMES)]
        phases = self.phases
        spots: Sequence[tuple[float, float]] = self.context.spots if where else [(0.0, 0.0)]
        turns = [2.0 * math.pi * i / PHASES_TRIED for i in range(PHASES_TRIED)] if phases else [0.0]
        aside = SEARCHED if self.short else (0.0,)
        for (distance, time), off, turn in itertools.product(spots, aside, turns):
            moved = {n: _within(free[n], distance + off if n in DISTANCES else time - 1.0) for n in where}
            yield {**values, **moved, **{name: _within(free[name], turn) for name in phases}}


def candidates(context: Context) -> list[Candidate]:
    """All effects of the library that have a name, with their variants."""
    kinds = [kind for name, kind in discover(library, Effect).items() if name not in UNNAMED]
    return [one for kind in kinds if kind.equivalence() != ALIGNED for one in _variants(kind, context)]


def effect_names() -> list[str]:
    """Names of all effects that can be asked for."""
    return sorted(name for name in discover(library, Effect) if name not in UNNAMED)


def _variants(kind: type[Effect], context: Context) -> Iterator[Candidate]:
    options: dict[str, Sequence[Any]] = {}
    for name, field in kind.model_fields.items():
        values = context.channels if name == "channel" else _options(field.annotation)
        if len(values) > 1:
            options[name] = values
    combinations = list(itertools.product(*options.values()))
    if "channel" not in options:
        combinations = combinations[:MOST_VARIANTS]
    for chosen in combinations:
        yield Candidate(kind, context, tuple(zip(options, chosen, strict=True)))


def _options(annotation: Any) -> tuple[Any, ...]:
    if get_origin(annotation) is Literal:
        return get_args(annotation)
    return (False, True) if annotation is bool else ()


def _ladder(parameter: Parameter) -> list[float]:
    """Sizes on each side of `absent`: middle, smallest worth naming, close to the bound; a few of them."""
    absent = parameter.absent if parameter.absent is not None else parameter.default
    smallest = parameter.smallest if parameter.smallest is not None else parameter.default
    near = max(abs(smallest - absent), 1e-12)
    first = 1.0 if smallest >= absent else -1.0
    sizes = _side(parameter, absent, near, first)
    other = parameter.low if first > 0 else parameter.high
    if abs(other - absent) > 0.5 * near:
        sizes = [*sizes[:2], *_side(parameter, absent, near, -first)[:2]]
    return sizes


def _side(parameter: Parameter, absent: float, near: float, sign: float) -> list[float]:
    bound = parameter.high if sign > 0 else parameter.low
    far = FAR * abs(bound - absent)
    if (
        near >= far
    ):  # a threshold: what is far from where it is absent is still small, and all happens close to the bound
        left = max(abs(bound - absent) - near, 0.0)
        return [bound - sign * share * left for share in THRESHOLDS]
    return [absent + sign * size for size in (math.sqrt(near * far), near, far)]


def _within(parameter: Parameter, value: float) -> float:
    return min(max(value, parameter.low), parameter.high)
