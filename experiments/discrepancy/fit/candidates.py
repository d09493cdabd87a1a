"""Candidates: every effect of the library, in each of its variants, at sizes from just worth naming to large."""

import itertools
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args, get_origin

import numpy as np

from railsim.effects.interface import EFFECTS, Effect, Parameter, ParameterPrior
from railsim.effects.sensor_changes import FilterEffect
from railsim.spec import Role

MOST_VARIANTS = 12  # four wheelsets, left, right or both sides
FAR = 0.9  # of the way to a bound
CLOSE, FEW = 2.2, 100.0  # largest ratio of a size and the next
BLOWS = 1.5  # the same of what strikes: a flat half as long again is a blow of three times
THRESHOLD = 0.8  # of a number's range, from where it is absent to its smallest size, beyond which it is a threshold
THRESHOLDS = (0.3, 1.0, 0.05)  # of the smallest size's distance from the bound, for numbers like a velocity of blow-off
FREQUENCIES = 6  # values between the bounds that the bank holds
LONG_WAVES = (8.0, 50.0, 32)  # m; the bank holds so many, shorter ones come from tones
NEAR = 0.05  # relative distance of a tone from a whole number of waves a turn
SLIGHTLY = 0.05  # m that a place is varied by for a derivative: an eighth of the shortest wave that the frames show
VARIED = 0.001  # of a number's range, by which it is varied for a derivative: a resonance makes larger ones crooked


@dataclass(frozen=True)
class Context:
    """What the recording says about the effects' numbers.

    Attributes
    ----------
    channels : compared, without units. distance, time : from and to [m], [s]. spots : (distance, time) of the loudest
    sections, where something local may be. tones : (frequency [Hz], wavelength [m]) of the residual's
    strongest ones. wheel_radius : [m]. wheelsets : whose wheels are looked at, from the leading one on.
    """

    channels: tuple[str, ...]
    distance: tuple[float, float]
    time: tuple[float, float]
    spots: tuple[tuple[float, float], ...]
    tones: tuple[tuple[float, float], ...] = ()
    wheel_radius: float = 0.5
    wheelsets: int = 2

    @property
    def length(self) -> float:
        """Of the run [m]."""
        return max(self.distance[1] - self.distance[0], 1.0)

    def range(self, parameter: Parameter) -> Parameter:
        """The parameter with the bounds that the run leaves it, uniform between them; others as they are."""
        limits = {"distance": self.distance, "time": self.time}.get(parameter.role)
        if limits is None:
            return parameter
        low, high = max(limits[0], parameter.low), min(limits[1], parameter.high)
        return parameter._replace(low=low, high=high, prior=ParameterPrior(0.5 * (low + high), math.inf))


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
        return dict(self.kind.probe) or None if issubclass(self.kind, FilterEffect) else None

    @property
    def channel(self) -> str:
        """The measured channel that it changes; empty where it is of no single one."""
        return next((str(value) for name, value in self.choices if self.kind.role(name) == "channel"), "")

    @property
    def local(self) -> bool:
        """Whether it has a place or a time of its own."""
        return self.kind.local()

    @property
    def speaks_in_places(self) -> bool:
        """Whether a few sections may say all there is to say about it."""
        return self.local or self.kind.acts_on == "track"

    @property
    def phases(self) -> list[str]:
        """Fields that turn with a wheel."""
        return self.kind.fields_of("phase")

    @property
    def sharp(self) -> bool:
        """Whether it is a blow once a turn, of which the sensors' samples hold more than half their rate folded back:
        a little later it is not the same signal a little later.
        """
        return self.kind.impact

    @property
    def from_a_threshold(self) -> bool:
        """Whether it does nothing until a number is far from where it is absent, like a stop until the gap is small: a
        part of a signature is then no signature of less.
        """
        return any(is_threshold(one) for one in self.parameters.values())

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Free numbers."""
        fixed = {name for name, _ in self.choices} | {*self.kind.held()} - {*self.phases}
        free = {name: one for name, one in self.kind.parameters().items() if name not in fixed}
        return {name: self.context.range(one) for name, one in free.items()}

    def number(self, *roles: Role) -> str:
        """Name of the first free number with one of these roles; empty where there is none."""
        return next((name for name, one in self.parameters.items() if one.role in roles), "")

    def step(self, parameter: Parameter, value: float) -> float:
        """How far a parameter is varied for a derivative, in its own unit: a place by a part of a short dip, a wave or
        a spacing so that it moves by no more than that at the end of the run.
        """
        usual = VARIED * (parameter.high - parameter.low)
        match parameter.role:
            case "wavelength":
                return min(0.05 * value**2 / self.context.length, usual)
            case "spacing":
                return min(SLIGHTLY * value / self.context.length, usual)
            case "length":
                return min(0.5, usual)
            case "distance":
                return SLIGHTLY
            case "time":
                return 0.05
        return usual

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
        return bool(self.phases or self.of_sensor or self.local or self.number("frequency"))

    @property
    def _ratio(self) -> float:
        """Between a size and the next."""
        if self.sharp:
            return BLOWS
        return FEW if self.linear else CLOSE

    def banked(self) -> Iterator[dict[str, float]]:
        """All sizes, at several frequencies where it has one of its own and no place in the spectrum is usual."""
        free = self.parameters
        frequency, wave = self.number("frequency"), self.number("wavelength")
        for values in [self.reference] if self.reference else self._shaped(self.sizes()):
            yield values
            if frequency and free[frequency].absent is None:
                for value in np.geomspace(free[frequency].low, free[frequency].high, FREQUENCIES):
                    yield {**values, frequency: float(value)}
        if wave and not self.local:
            middle = list(self._shaped([next(iter(self.sizes()))]))
            for value in np.geomspace(*LONG_WAVES):
                if free[wave].low <= value <= free[wave].high:
                    yield from ({**values, wave: float(value)} for values in middle)

    def _shaped(self, sizes: Iterable[dict[str, float]]) -> Iterator[dict[str, float]]:
        """Sizes in the usual shape and in others."""
        free = self.parameters
        shapes = {name: one.trials for name, one in free.items() if one.absent is None and not one.role}
        for values in sizes:
            yield values
            yield from ({**values, name: value} for name, trials in shapes.items() for value in trials)

    def at_tones(self) -> Iterator[dict[str, float]]:
        """The middle and the largest size where the residual has its tones, where it can be tuned; of a wave about a
        mean a small and a large one.
        """
        free = self.parameters
        name = self.number("wavelength", "frequency", "period")
        sizes = list(self.sizes())
        for frequency, wavelength in self.context.tones if name else ():
            tuned = {"wavelength": wavelength, "period": 1.0 / frequency, "frequency": frequency}
            value = tuned[free[name].role]
            if not free[name].low <= value <= free[name].high:
                continue
            usual = (sizes[0], sizes[-1]) if free[name].absent is None else sizes[:1]
            for values in self._shaped(sizes[:1]) if self.uneven else usual:
                yield {**values, name: value}

    @property
    def uneven(self) -> bool:
        """Whether its wave is about a mean that acts as well: its signature is not that of a wave a little longer,
        turned.
        """
        return self.kind.wave_about_mean

    @property
    def gust(self) -> bool:
        """Whether it is a force that rises and falls once."""
        return self.kind.extent == "pulse"

    @property
    def short(self) -> bool:
        """Whether it acts within a metre or so of a place, which must therefore be found to a fraction of that."""
        return self.kind.extent == "short"

    @property
    def stretch(self) -> bool:
        """Whether it acts from a place on over a length."""
        return self.kind.extent == "stretch"

    def variants_of(self, values: Mapping[str, float]) -> Iterator[dict[str, float]]:
        """The same size at the places and times where it may be, and at some lengths."""
        free = self.parameters
        where = [name for name, one in free.items() if one.role in ("distance", "time")]
        name = self.number("length", "duration")
        lengths = (free[name].trials if name else ()) or (0.0,)
        spots = self.context.spots if where else ((0.0, 0.0),)
        for number, length in enumerate(lengths):
            for distance, time in spots[: max(1, len(spots) - number)]:  # what is long has less choice
                begin = {"time": time - max(1.0, 0.5 * length), "distance": distance - 0.5 * length}
                moved = {n: _within(free[n], begin[free[n].role]) for n in where}
                yield {**values, **moved, **({name: _within(free[name], length)} if length else {})}


def settings_of(effect: Effect) -> str:
    """All settings of an effect, as one text."""
    return json.dumps(effect.settings(), sort_keys=True)


def in_tune(found: Sequence[Candidate]) -> list[Candidate]:
    """Candidates, those with waves a turn (`order`) also at those of the residual's tones."""
    tuned: list[Candidate] = []
    for one in found:
        tuned.append(one)
        for name in one.kind.fields_of("order"):
            turns = [2.0 * math.pi * one.context.wheel_radius / wavelength for _, wavelength in one.context.tones]
            near = {round(turn) for turn in turns if abs(turn - round(turn)) < NEAR * turn and turn > 1.5}
            tuned += [replace(one, choices=(*one.choices, (name, number))) for number in sorted(near)]
    return tuned


def candidates(context: Context) -> list[Candidate]:
    """All effects of the library that a fit looks for, with their variants."""
    kinds = EFFECTS.classes()
    return [one for name in fitted_names() for one in _variants(kinds[name], context)]


def effect_names() -> list[str]:
    """Names of all effects that can be asked for."""
    return sorted(name for name, kind in EFFECTS.classes().items() if kind.named)


def fitted_names() -> list[str]:
    """Names of those of them that a fit looks for."""
    return sorted(name for name, kind in EFFECTS.classes().items() if kind.named and not kind.by_registration)


def _variants(kind: type[Effect], context: Context) -> Iterator[Candidate]:
    options: dict[str, Sequence[Any]] = {}
    for name, field in kind.model_fields.items():
        of_channel = kind.role(name) == "channel"
        values = context.channels if of_channel else _options(field.annotation)
        if kind.role(name) == "bogie":  # a fit takes both
            continue
        if kind.role(name) == "wheelset":
            values = values[: context.wheelsets]
        if len(values) > 1 or of_channel:
            options[name] = values
    combinations = list(itertools.product(*options.values()))
    if not kind.fields_of("channel"):
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
