"""Candidates: every effect of the library, in each of its variants, at sizes from just worth naming to large."""

import itertools
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args, get_origin

import numpy as np

from railsim import effects as library
from railsim.effects.interface import Effect, Parameter, Prior
from railsim.registry import discover

MOST_VARIANTS = 8
FAR = 0.9  # of the way to a bound
CLOSE, FEW = 2.2, 100.0  # largest ratio of a size and the next
BLOWS = 1.5  # the same of what strikes: a flat half as long again is a blow of three times
THRESHOLD = 0.8  # of a number's range, from where it is absent to its smallest size, beyond which it is a threshold
THRESHOLDS = (0.3, 1.0, 0.05)  # of the smallest size's distance from the bound, for numbers like a velocity of blow-off
UNNAMED = ("empirical_force",)  # tabulated laws: an answer to `unknown`, no name
ALIGNED = "speed_scale"  # family that the alignment finds, not the fit
DISTANCES = ("place", "first")  # fields that are a distance along the track [m]
SHORT = ("rail_joints", "hanging_sleepers")  # effects of a place that is short against a section
UNEVEN = ("soft_track",)  # waves about a mean
STRETCHES = ("local_low_adhesion", "rail_corrugation")  # effects from a place on over a length
TIMES = ("begin",)  # fields that are a time of the run [s]
TUNED = ("wavelength", "frequency", "period")  # fields that say where in the spectrum it is
GRID = {"frequency": 6}  # values between the bounds that the bank holds
SHAPES = {"share": (0.4, 0.7), "variation": (0.5,), "damping": (0.15,)}
"""Further values of what shapes an effect: a damper that keeps most of its slope is not like one that loses it, nor a
body that bends and is damped like one that rings."""
LONG_WAVES = (8.0, 50.0, 32)  # m; the bank holds so many, shorter ones come from tones
NEAR = 0.05  # relative distance of a tone from a whole number of waves a turn
SLIGHTLY = 0.05  # m that a place is varied by for a derivative: an eighth of the shortest wave that the frames show
VARIED = 0.001  # of a number's range, by which it is varied for a derivative: a resonance makes larger ones crooked
LENGTHS = {
    "hanging_sleepers": ("length", (3.0, 8.0, 20.0)),
    "exposed_stretch": ("length", (50.0, 110.0)),
    "wind_gust": ("duration", (2.0, 5.0)),
}
REFERENCES = {"sensor_delay": {"delay": 0.002}, "sensor_resonance": {"period": 0.03, "damping": 0.3}}
"""Filters of one channel at numbers that change all that the frames show."""
PHASES = ("phase", "angle")  # held fields that are found all the same [rad]


@dataclass(frozen=True)
class Context:
    """What the recording says about the effects' numbers.

    Attributes
    ----------
    channels : compared, without units. distance, time : from and to [m], [s]. spots : (distance, time) of the loudest
    sections, where something local may be. tones : (frequency [Hz], wavelength [m]) of the residual's
    strongest ones. wheel_radius : [m].
    """

    channels: tuple[str, ...]
    distance: tuple[float, float]
    time: tuple[float, float]
    spots: tuple[tuple[float, float], ...]
    tones: tuple[tuple[float, float], ...] = ()
    wheel_radius: float = 0.5

    @property
    def length(self) -> float:
        """Of the run [m]."""
        return max(self.distance[1] - self.distance[0], 1.0)

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
    def reference(self) -> dict[str, float] | None:
        """Of a filter of one channel: numbers whose signature makes all others."""
        return REFERENCES.get(self.name)

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
    def sharp(self) -> bool:
        """Whether it is a blow once a turn, of which the sensors' samples hold more than half their rate folded back:
        a little later it is not the same signal a little later.
        """
        return "angle" in self.phases

    @property
    def from_a_threshold(self) -> bool:
        """Whether it does nothing until a number is far from where it is absent, like a stop until the gap is small: a
        part of a signature is then no signature of less.
        """
        return any(is_threshold(one) for one in self.parameters.values())

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Free numbers."""
        fixed = {name for name, _ in self.choices} | set(self.kind.held) - {*DISTANCES, *self.phases}
        free = {name: one for name, one in self.kind.parameters().items() if name not in fixed}
        return {name: self.context.range(name, one) for name, one in free.items()}

    def step(self, name: str, parameter: Parameter, value: float) -> float:
        """How far a parameter is varied for a derivative, in its own unit: a place by a part of a short dip, a wave or
        a spacing so that it moves by no more than that at the end of the run.
        """
        span = parameter.high - parameter.low
        if name == "wavelength":
            return min(0.05 * value**2 / self.context.length, VARIED * span)
        if name == "spacing":
            return min(SLIGHTLY * value / self.context.length, VARIED * span)
        if name == "length" and self.local:
            return min(0.5, VARIED * span)
        return SLIGHTLY if name in DISTANCES else 0.05 if name in TIMES else VARIED * span

    def build(self, values: Mapping[str, float]) -> Effect:
        """The effect with these numbers."""
        return self.kind.build({**dict(self.choices), **values})

    def sizes(self) -> Iterator[dict[str, float]]:
        """Values of the free numbers to screen with: the middle size first, then all from small to large, to both sides
        of where the effect is absent.
        """
        free = self.parameters
        sized = [name for name, one in free.items() if one.absent is not None and one.smallest is not None]
        ways = [_ladder(free[name], self._ratio) for name in sized]
        for steps in itertools.zip_longest(*ways) if ways else [()]:
            last = [way[-1] if step is None else step for step, way in zip(steps, ways, strict=True)]
            middle = {name: _within(one, one.default) for name, one in free.items()}
            yield middle | dict(zip(sized, last, strict=True))

    @property
    def linear(self) -> bool:
        """Whether a large one is much like a small one made larger: what turns with a wheel, what sensors add, and what
        has a place or a frequency of its own, which must do with few sizes.
        """
        return bool(self.phases or self.of_sensor or self.local or any(name in GRID for name in self.parameters))

    @property
    def _ratio(self) -> float:
        """Between a size and the next."""
        if self.sharp:
            return BLOWS
        return FEW if self.linear else CLOSE

    def banked(self) -> Iterator[dict[str, float]]:
        """All sizes, at several frequencies where it has one of its own and no place in the spectrum is usual."""
        free = self.parameters
        for values in [self.reference] if self.reference else self._shaped(self.sizes()):
            yield values
            for name in GRID:
                if name in free and free[name].absent is None:
                    for value in np.geomspace(free[name].low, free[name].high, GRID[name]):
                        yield {**values, name: float(value)}
        if "wavelength" in free and not self.local:
            middle = list(self._shaped([next(iter(self.sizes()))]))
            for value in np.geomspace(*LONG_WAVES):
                if free["wavelength"].low <= value <= free["wavelength"].high:
                    yield from ({**values, "wavelength": float(value)} for values in middle)

    def _shaped(self, sizes: Iterable[dict[str, float]]) -> Iterator[dict[str, float]]:
        """Sizes in the usual shape and in others."""
        free = self.parameters
        names = [name for name in SHAPES if name in free and free[name].absent is None]
        for values in sizes:
            yield values
            yield from ({**values, name: value} for name in names for value in SHAPES[name])

    def at_tones(self) -> Iterator[dict[str, float]]:
        """The middle and the largest size where the residual has its tones, where it can be tuned; of a wave about a
        mean a small and a large one.
        """
        free = self.parameters
        name = next((one for one in TUNED if one in free), None)
        sizes = list(self.sizes())
        for frequency, wavelength in self.context.tones if name else ():
            value = {"wavelength": wavelength, "period": 1.0 / frequency, "frequency": frequency}.get(str(name))
            if value is None or not free[str(name)].low <= value <= free[str(name)].high:
                continue
            usual = (sizes[0], sizes[-1]) if free[str(name)].absent is None else sizes[:1]
            for values in self._shaped(sizes[:1]) if self.uneven else usual:
                yield {**values, str(name): value}

    @property
    def uneven(self) -> bool:
        """Whether its wave is about a mean that acts as well: its signature is not that of a wave a little longer,
        turned.
        """
        return self.name in UNEVEN

    @property
    def gust(self) -> bool:
        """Whether it is a force that rises and falls once."""
        return self.name in LENGTHS and self.kind.acts_on == "load"

    @property
    def short(self) -> bool:
        """Whether it acts within a metre or so of a place, which must therefore be found to a fraction of that."""
        return self.name in SHORT

    def variants_of(self, values: Mapping[str, float]) -> Iterator[dict[str, float]]:
        """The same size at the places and times where it may be, and at some lengths."""
        free = self.parameters
        where = [name for name in free if name in (*DISTANCES, *TIMES)]
        name, lengths = LENGTHS.get(self.name, ("", (0.0,)))
        spots = self.context.spots if where else ((0.0, 0.0),)
        for number, length in enumerate(lengths):
            for distance, time in spots[: max(1, len(spots) - number)]:  # what is long has less choice
                begin = {False: time - max(1.0, 0.5 * length), True: distance - 0.5 * length}
                moved = {n: _within(free[n], begin[n in DISTANCES]) for n in where}
                yield {**values, **moved, **({name: _within(free[name], length)} if name in free else {})}


def settings_of(effect: Effect) -> str:
    """All settings of an effect, as one text."""
    return json.dumps(effect.settings(), sort_keys=True)


def in_tune(found: Sequence[Candidate]) -> list[Candidate]:
    """Candidates, those with waves a turn (`order`) also at those of the residual's tones."""
    tuned: list[Candidate] = []
    for one in found:
        tuned.append(one)
        if "order" in one.kind.model_fields:
            turns = [2.0 * math.pi * one.context.wheel_radius / wavelength for _, wavelength in one.context.tones]
            near = {round(turn) for turn in turns if abs(turn - round(turn)) < NEAR * turn and turn > 1.5}
            tuned += [replace(one, choices=(*one.choices, ("order", number))) for number in sorted(near)]
    return tuned


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
        if len(values) > 1 or name == "channel":
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


def is_threshold(parameter: Parameter) -> bool:
    """Whether all happens close to a bound, far from where the effect is absent."""
    if parameter.absent is None or parameter.smallest is None:
        return False
    return abs(parameter.smallest - parameter.absent) > THRESHOLD * (parameter.high - parameter.low)


def _ladder(parameter: Parameter, ratio: float) -> list[float]:
    """Sizes on each side of `absent`: a middle one first, then from the smallest worth naming to close to the bound,
    each at most `ratio` times the one before.
    """
    absent = parameter.absent if parameter.absent is not None else parameter.default
    smallest = parameter.smallest if parameter.smallest is not None else parameter.default
    near = max(abs(smallest - absent), 1e-12)
    first = 1.0 if smallest >= absent else -1.0
    sizes = _side(parameter, absent, near, first, ratio)
    other = parameter.low if first > 0 else parameter.high
    if abs(other - absent) > 0.5 * near:
        sizes = [*sizes, *_side(parameter, absent, near, -first, ratio)]
    return sizes


def _side(parameter: Parameter, absent: float, near: float, sign: float, ratio: float) -> list[float]:
    bound = parameter.high if sign > 0 else parameter.low
    far = FAR * abs(bound - absent)
    if (
        near >= far
    ):  # a threshold: what is far from where it is absent is still small, and all happens close to the bound
        left = max(abs(bound - absent) - near, 0.0)
        return [bound - sign * share * left for share in THRESHOLDS]
    steps = 2 * max(1, math.ceil(0.5 * math.log(far / near) / math.log(ratio)))
    sizes = [absent + sign * float(size) for size in np.geomspace(near, far, steps + 1)]
    return [sizes.pop(steps // 2), *sizes]


def _within(parameter: Parameter, value: float) -> float:
    return min(max(value, parameter.low), parameter.high)
