"""Every plug-in effect of the railway as an effect of the inference, by what its plug-in file says of it.

Fault prior: normal about the plug-in's default size, with half its distance from where the effect is absent; on both
sides of that where the plug-in allows both. An effect whose first signature is that of a coordinate that every
hypothesis has (a damper's factor and the tolerance of the same damper) is that coordinate with another prior.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Literal, get_args, get_origin

import numpy as np

from experiments.discrepancy.core.known import Known, about, within_bounds
from experiments.discrepancy.core.levels import middles
from experiments.discrepancy.core.model import Coordinate, Effect, Fit, Hypothesis, Library
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import Problem
from experiments.discrepancy.railway.along import Along, placeable, prior_along
from experiments.discrepancy.railway.build import leading_alone
from experiments.discrepancy.railway.laws import Law, laws
from experiments.discrepancy.railway.makers import Installed, Maker
from experiments.discrepancy.railway.system import Railway
from railsim.effects.interface import EFFECTS, Parameter, Setup
from railsim.effects.interface import Effect as Plugin
from railsim.errors import InputError

ALIKE = 0.995  # cosine of two whitened signatures from which they are of one thing
SAME = 0.9999  # cosine of two signatures from which they are one effect
FIRST = 0.01  # of the default size, at which a first signature is taken
VISIBLE = 3.0  # standard deviations of noise, survey and healthy levels together, at the default size
TOLERATED = 3.0  # healthy spreads within which a default size is no fault
PHASES = 4  # angles of a wheel from which a search begins
AT_ONCE = 64  # signatures that are made together
UNFIT = "does not fit this vehicle or its sensors, or its run fails"
UNSEEN = "these channels would not show it"
MUCH = 1.5  # default sizes from which a large one is looked at too: below, both do the same
HALF = 0.5  # of a size: spread of its fault prior
UNIFORM = (1.0, 1.0)
"""Mean and deviation of minus the log of a number that may be anything from 0 to 1: those of the uniform density."""


@dataclass(frozen=True)
class Twin:
    """An effect that does what a tolerance does, or several together: how it is made from the value of its coordinate.
    `factor` : whether that is the log of a factor; `share` : whether the factor may be anything from 0 to 1.
    """

    installed: Installed
    absent: float
    rate: float
    factor: bool
    share: bool

    def make(self, value: float) -> Plugin:
        """With the size that a coordinate's value stands for."""
        size = math.exp(self._side * value) if self.factor else self.absent + value / self.rate
        return self.installed.make(np.array([size]))

    def value(self, size: float) -> float:
        """Of that coordinate, for a size."""
        return self._side * math.log(size) if self.factor else (size - self.absent) * self.rate

    def known(self, value: float, spread: float, prior: Coordinate) -> Known:
        """The size, from a coordinate's fitted value, its standard deviation and its prior."""
        if self.share:
            return within_bounds(self._side * value, spread, self._side * prior.mean, prior.spread)
        (name,) = self.installed.fields
        likeliest, *ends = (float(getattr(self.make(one), name)) for one in about(value, spread))
        return likeliest, min(ends), max(ends)

    @property
    def _side(self) -> float:
        return math.copysign(1.0, self.rate)


@dataclass(frozen=True)
class Found:
    """The library, how its effects are made (`twins`: those that are tolerances; `laws`: those without a name), and
    what is not in it and why.
    """

    library: Library
    installed: dict[str, Installed]
    left_out: tuple[str, ...]
    twins: dict[str, Twin] = field(default_factory=dict)
    laws: dict[str, Law] = field(default_factory=dict)

    @property
    def makers(self) -> dict[str, Maker]:
        """Of all effects that have coordinates of their own."""
        return {**self.installed, **self.laws}

    def known(self, fit: Fit) -> list[tuple[Effect, list[Known]]]:
        """Of each effect of a fit its numbers: sizes of the plug-in, or coordinates of a law."""
        spreads = np.sqrt(np.diag(np.linalg.inv(fit.precision)))
        found = []
        for effect, places in zip(fit.hypothesis.effects, fit.hypothesis.places(fit.system.coordinates), strict=True):
            numbers = list(zip(fit.x[places], spreads[places], (*effect.faults, *effect.own), strict=True))
            twin = self.twins.get(effect.listed)
            found.append((effect, [twin.known(*one) if twin else about(*one[:2]) for one in numbers]))
        return found

    def fields(self, effect: Effect) -> list[tuple[str, str]]:
        """Names and units of an effect's numbers."""
        if (twin := self.twins.get(effect.listed)) is None:
            return [(one.name, one.unit) for one in effect.own]
        return [(name, twin.installed.plugin.parameters()[name].unit) for name in twin.installed.fields]

    def made(self, effect: Effect, sizes: Sequence[float]) -> Plugin:
        """A plug-in from an effect's numbers."""
        twin = self.twins.get(effect.listed)
        return (twin.installed if twin else self.makers[effect.listed]).make(np.asarray(sizes))


def variants(plugin: type[Plugin], system: Railway) -> Iterator[dict[str, Any]]:
    """Choices of an effect: channels, wheelsets and sides."""
    choices: dict[str, list[Any]] = {}
    count = len(system.record.scenario.model.wheelsets)
    for name, one in plugin.model_fields.items():
        if plugin.role(name) == "channel":
            choices[name] = [channel.partition(" [")[0] for channel in system.record.channels]
        elif get_origin(one.annotation) is Literal:
            choices[name] = list(get_args(one.annotation))
        elif name == "wheelset":
            choices[name] = list(range(1, count + 1))
    for values in itertools.product(*choices.values()):
        yield dict(zip(choices, values, strict=True))


def prior(name: str, one: Parameter) -> Coordinate:
    """Fault prior of a number of an effect."""
    if one.role == "phase":
        return Coordinate(name, one.unit, math.pi, 2.0)
    if one.absent is None or one.default == one.absent:
        return Coordinate(name, one.unit, one.default, max(0.25 * abs(one.default), 0.02 * (one.high - one.low)))
    size = one.default - one.absent
    if one.low < one.absent < one.high:
        return Coordinate(name, one.unit, one.absent, 1.5 * abs(size))
    return Coordinate(name, one.unit, one.default, HALF * abs(size))


def starts(numbers: dict[str, Parameter]) -> tuple[tuple[float, ...], ...]:
    """The default size and a large one, on both sides where both are allowed, at several angles of a wheel."""
    each, shares = [], (1.0, *([far] if (far := large(numbers)) else []))
    for one in numbers.values():
        if one.role == "phase":
            each.append([2.0 * math.pi * k / PHASES for k in range(PHASES)])
        elif one.absent is not None:
            sizes = [one.absent + share * (one.default - one.absent) for share in shares]
            least = one.low + 0.1 * (one.absent - one.low)
            other = [max(2.0 * one.absent - size, least) for size in sizes] if one.low < one.absent < one.high else []
            each.append([*sizes, *other])
            shares = (1.0,)  # of one number alone
        else:
            each.append([one.default])
    return tuple(dict.fromkeys(itertools.product(*each)))


def large(numbers: dict[str, Parameter]) -> float | None:
    """How many default sizes a large one is: the geometric mean of that size and the bound. None where that is hardly
    more, and of what turns with a wheel, which grows in proportion. A wind that lays a body against its stops does not.
    """
    sized = next((one for one in numbers.values() if one.absent is not None), None)
    if sized is None or sized.absent is None or any(one.role == "phase" for one in numbers.values()):
        return None
    size = sized.default - sized.absent
    bound = (sized.high if size > 0.0 else sized.low) - sized.absent
    share = math.sqrt(abs(bound / size)) if size and math.isfinite(bound) else 1.0
    return share if share > MUCH else None


@dataclass(frozen=True)
class Signature:
    """What an effect changes of the channels: `white` (values,) in healthy errors, `plain` (F, frames, channels) of
    each section.
    """

    white: np.ndarray
    plain: tuple[np.ndarray, ...]


_Moved = tuple[tuple[tuple[str, float], ...], float]
"""Coordinates with the rates at which they move together, and how far."""


@dataclass
class _Maker:
    """What all effects are compared with: signatures of the healthy coordinates."""

    system: Railway

    def __post_init__(self) -> None:
        x = self.system.middle
        weights = np.exp(2.0 * middles(self.system.levels))
        components, problem = self.system.covariances(x, ()), Problem(self.system, Hypothesis(), Policy())
        self.roots = [np.linalg.inv(np.linalg.cholesky(np.tensordot(weights, one, 1))) for one in components]
        slopes = self.white(problem.slopes(x, problem.groups(x, components)))
        alone = [((one.name, 1.0),) for one in self.system.coordinates]
        self.moves = [*alone, *leading_alone(self.system.coordinates)]
        names = [one.name for one in self.system.coordinates]
        self.slopes = np.array([sum(rate * slopes[names.index(name)] for name, rate in one) for one in self.moves])
        self.nominal = [one[0] for one in self.system.shown([(self.system.nominal, 0.0)])]

    def white(self, sections: Sequence[np.ndarray]) -> np.ndarray:
        """(rows, values) real, of changes in each section."""
        found = []
        for root, values in zip(self.roots, sections, strict=True):
            white = np.einsum("fcd,rftd->rftc", root, values, optimize=True).reshape(len(values), -1)
            found += [white.real, white.imag]
        return np.concatenate(found, axis=1)

    def signatures(self, setups: list[Setup | None]) -> list[Signature | None]:
        """Changes of the channels; None where there is no setup or its run fails."""
        found: list[Signature | None] = [None] * len(setups)
        present = [(place, one) for place, one in enumerate(setups) if one is not None]
        for first in range(0, len(present), AT_ONCE):
            part = present[first : first + AT_ONCE]
            shown = self.system.shown([(one, 0.0) for _, one in part])
            changes = [one - base for one, base in zip(shown, self.nominal, strict=True)]
            for row, ((place, _), white) in enumerate(zip(part, self.white(changes), strict=True)):
                if np.isfinite(white).all():
                    plain = tuple(one[row].astype(np.complex64) for one in changes)
                    found[place] = Signature(white.astype(np.float32), plain)
        return found

    def twin(self, first: np.ndarray) -> _Moved | None:
        """The coordinates of which this is the signature, and how far they are moved."""
        size, sizes = np.linalg.norm(first), np.linalg.norm(self.slopes, axis=1)
        alike = self.slopes @ first / np.maximum(size * sizes, 1e-300)
        best = int(np.argmax(np.abs(alike)))
        moved = self.moves[best], float(self.slopes[best] @ first / sizes[best] ** 2)
        return moved if abs(alike[best]) > ALIKE else None


_Entry = tuple[str, type[Plugin], dict[str, Any], dict[str, Parameter]]
"""An effect's name, plug-in, choices and numbers."""


def found_library(system: Railway, kinds: Sequence[str] | None = None) -> Found:
    """All effects that the record's channels would show, of `kinds` of plug-ins alone where some are given; and laws
    without a name.
    """
    entries, places, left_out, installed, twins_made = [], [], [], {}, {}
    for kind, plugin in EFFECTS.classes().items():
        if kinds is not None and kind not in kinds:
            continue
        numbers = {k: one for k, one in plugin.parameters().items() if one.role not in ("onset", "ramp")}
        if not plugin.named or plugin.by_registration:
            left_out.append(f"{kind}: no name of a verdict")
        elif plugin.local() and placeable(plugin):
            places += [(kind, plugin, choices, numbers) for choices in variants(plugin, system)]
        elif plugin.local() or not any(one.absent is not None for one in numbers.values()):
            left_out.append(f"{kind}: a wave over a part of the way, which is not looked for")
        else:
            entries += [(kind, plugin, choices, numbers) for choices in variants(plugin, system)]
    maker, effects, signatures = _Maker(system), [], []
    firsts = maker.signatures([_setup(system, *entry[1:], share=FIRST) for entry in entries])
    twins = [None if one is None or len(entry[3]) > 1 else maker.twin(one.white)
             for one, entry in zip(firsts, entries, strict=True)]  # fmt: skip
    wholes = maker.signatures([None if one is None or twin is not None else _setup(system, *entry[1:], share=1.0)
                               for one, twin, entry in zip(firsts, twins, entries, strict=True)])  # fmt: skip
    larges = maker.signatures([None if one is None or (far := large(entry[3])) is None
                               else _setup(system, *entry[1:], share=far)
                               for one, entry in zip(wholes, entries, strict=True)])  # fmt: skip
    all_seen = zip(entries, firsts, twins, wholes, larges, strict=True)
    for (kind, plugin, choices, numbers), first, twin, whole, far in all_seen:
        name = _name(kind, choices)
        shown = first.white / FIRST if twin is not None and first is not None else whole and whole.white
        if shown is None:
            left_out.append(f"{name}: {UNFIT}")
        elif np.linalg.norm(shown) < VISIBLE:
            left_out.append(f"{name}: {UNSEEN}")
        elif (effect := _effect(name, plugin, choices, numbers, twin, system)) is None:
            left_out.append(f"{name}: within the tolerance of what healthy vehicles have")
        else:
            installed[name] = Installed(plugin, dict(choices), tuple(numbers))
            if twin is not None:
                twins_made[name] = _twin(installed[name], next(iter(numbers.values())), twin, system)
            effects.append(effect if whole is None else replace(effect, shown=_turned(whole, far, numbers)))
            signatures.append(shown)
    found = _distinct(effects, signatures, left_out)
    along = system.side_by_side([partial(_along, system, maker, entry) for entry in places])
    for (_, plugin, choices, numbers), one in zip(places, along, strict=True):
        if isinstance(one, str):
            left_out.append(one)
        else:
            installed[one.name] = Installed(plugin, dict(choices), tuple(numbers))
    unnamed = [(one, law) for one, law in laws(system) if one.shown and _loudest(maker.white(one.shown)) >= VISIBLE]
    effects = [*found, *(one for one in along if not isinstance(one, str)), *(one for one, _ in unnamed)]
    made = {one.name: law for one, law in unnamed}
    return Found(Library(tuple(effects)), installed, tuple(left_out), twins_made, made)


def _loudest(white: np.ndarray) -> float:
    return float(np.linalg.norm(white, axis=1).max())


def _along(system: Railway, maker: _Maker, entry: _Entry) -> Effect | str:
    """An effect with a place or a time, if the channels would show it; else why it is left out."""
    kind, plugin, choices, numbers = entry
    name, where = _name(kind, choices), Along(system, plugin, choices, numbers)
    if not where.copies:
        return f"{name}: {UNFIT}"
    if where.loudest(maker.roots) < VISIBLE:
        return f"{name}: {UNSEEN}"
    own = [prior_along(one, key, plugin, system.record) or prior(key, one) for key, one in numbers.items()]
    return Effect(name, plugin.equivalence(), own=tuple(own), seek=where.seek)


def _turned(whole: Signature, far: Signature | None, numbers: dict[str, Parameter]) -> tuple[np.ndarray, ...]:
    """(K, F, frames, channels) of each section: a change, and where it begins at an unknown phase the same a quarter of
    a turn on, which is exact for a tone; and what a large size changes otherwise.
    """
    turns = [1.0, 1j] if any(one.role == "phase" for one in numbers.values()) else [1.0]
    found = [np.stack([turn * one for turn in turns]) for one in whole.plain]
    if far is not None and abs(_unit(whole.white) @ _unit(far.white)) < ALIKE:
        found = [np.concatenate([one, more[None]]) for one, more in zip(found, far.plain, strict=True)]
    return tuple(one.astype(np.complex64) for one in found)


def _unit(white: np.ndarray) -> np.ndarray:
    return white / max(float(np.linalg.norm(white)), 1e-30)


def _name(kind: str, choices: dict[str, Any]) -> str:
    label = ", ".join(f"{key} {value}" for key, value in choices.items())
    return f"{kind} ({label})" if label else kind


def _setup(
    system: Railway, plugin: type[Plugin], choices: dict[str, Any], numbers: dict[str, Parameter], *, share: float
) -> Setup | None:
    values = {
        name: one.default if one.absent is None else one.absent + share * (one.default - one.absent)
        for name, one in numbers.items()
    }
    try:
        return system.nominal_with(plugin.build({**choices, **values}))
    except InputError:
        return None


def _twin(installed: Installed, one: Parameter, twin: _Moved, system: Railway) -> Twin:
    assert one.absent is not None
    rate = twin[1] / (FIRST * (one.default - one.absent))
    factor = _is_factor(one, _first_moved(twin, system))
    return Twin(installed, one.absent, rate, factor, factor and _is_share(one))


def _first_moved(twin: _Moved, system: Railway) -> Coordinate:
    return next(one for one in system.coordinates if one.name == twin[0][0][0])


def _is_factor(one: Parameter, healthy: Coordinate) -> bool:
    """Whether the coordinate is the log of the number."""
    return one.absent is not None and abs(one.absent - 1.0) < 1e-9 and one.default > 0.0 and healthy.unit == "-"


def _is_share(one: Parameter) -> bool:
    return (one.low, one.high) == (0.0, 1.0)


def _effect(
    name: str, plugin: type[Plugin], choices: dict[str, Any], numbers: dict[str, Parameter],
    twin: _Moved | None, system: Railway,
) -> Effect | None:  # fmt: skip
    place = next((channel for channel in system.record.channels
                  if channel.partition(" [")[0] == choices.get("channel")), None)  # fmt: skip
    if twin is not None:
        one, (moves, moved) = next(iter(numbers.values())), twin
        healthy = _first_moved(twin, system)
        assert one.absent is not None
        rate = moved / (FIRST * (one.default - one.absent))
        mean = rate * (one.default - one.absent)
        if _is_factor(one, healthy):
            mean = math.copysign(abs(math.log(one.default)), mean)
        if abs(mean) < TOLERATED * healthy.spread:
            return None
        both = one.low < one.absent < one.high
        fault = Coordinate(healthy.name, healthy.unit, 0.0 if both else mean, (1.5 if both else HALF) * abs(mean))
        if _is_factor(one, healthy) and _is_share(one):
            fault = replace(fault, mean=math.copysign(UNIFORM[0], mean), spread=UNIFORM[1])
        found = Effect(name, plugin.equivalence(), (fault,), place=place,
                       starts=((mean,), (-mean,)) if both else ((mean,), (2.0 * mean,)))  # fmt: skip
        if len(moves) == 1:
            return found
        return replace(found, faults=(), own=(replace(fault, name=f"{fault.name} alone"),), moves=moves)
    own = tuple(prior(key, one) for key, one in numbers.items())
    healthy = _healthy_size(plugin, numbers, system)
    return Effect(name, plugin.equivalence(), own=own, starts=starts(numbers), place=place, healthy=healthy)


def _healthy_size(plugin: type[Plugin], numbers: dict[str, Parameter], system: Railway) -> tuple[Coordinate, ...]:
    """Priors of an effect's numbers where healthy vehicles have a little of it."""
    spreads = plugin.ordinary(system.nominal)
    if not spreads:
        return ()
    return tuple(
        Coordinate(name, one.unit, one.absent or 0.0, spreads[name]) if name in spreads else prior(name, one)
        for name, one in numbers.items()
    )


def _distinct(effects: list[Effect], signatures: list[np.ndarray], left_out: list[str]) -> tuple[Effect, ...]:
    """Of variants of one family that no channel tells apart, the first."""
    found: list[tuple[Effect, np.ndarray]] = []
    for one, shown in zip(effects, signatures, strict=True):
        unit = shown / np.linalg.norm(shown)
        same = [other for other, seen in found if other.family == one.family and abs(seen @ unit) > SAME]
        if same:
            left_out.append(f"{one.name}: these channels do not tell it from {same[0].name}")
        else:
            found.append((one, unit))
    return tuple(one for one, _ in found)
