"""Effects with a place or a time: where along the way each may be, from what a fit without it leaves.

The vehicle is run with copies of the effect so far apart that none feels another. A matched filter (Turin 1960, IRE
Trans. Inf. Theory 6) of what each copy changes gives the likeliest places; a little to either side it is the same
change a little earlier or later. What acts over a stretch is run over the whole way; any run of frames may be its own.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from experiments.discrepancy.core.levels import sums
from experiments.discrepancy.core.model import Coordinate, Fit
from experiments.discrepancy.railway.record import DROPPED, WINDOW, Record
from experiments.discrepancy.railway.system import Railway
from railsim.effects.interface import Effect as Plugin
from railsim.effects.interface import Parameter, Setup
from railsim.errors import InputError

APART = 8.0  # s between copies
EVERY = 0.5  # s between places
BEFORE, AFTER = 1.5, 4.0  # s about a place, in which what is there acts, and moves the vehicle
FINE = 30  # places between two of these
LIKELY = 3  # places from which a search begins
ASIDE = (0.0, -0.33, 0.33)  # s; of an end of a stretch, which frames tell to half of their length
UNLIKE = 2.5  # times as long: another shape
WIDE = 0.4  # of the way: spread of a place, by which the middle is as likely as if all places were
SHARP, BLUNT = 0.02, 0.5  # m or s; step of a place's derivative, where it acts at a point and where it does not
SPACING = 1e-3  # m; step of the derivative by a spacing
LONG = 0.25  # of the way: length of a stretch, and its spread

WHERE = ("distance", "time")
HOW_LONG = ("length", "duration")


def placeable(plugin: type[Plugin]) -> bool:
    """Whether its place can be looked for: a wave in it asks for its length too, which is not."""
    return bool(plugin.fields_of(*WHERE)) and not plugin.fields_of("wavelength") and bool(plugin.extent)


def prior_along(one: Parameter, name: str, plugin: type[Plugin], record: Record) -> Coordinate | None:
    """Prior of a place, a length or a spacing; None of another number."""
    point = plugin.extent == "short"
    if one.role in WHERE:
        first, last = reach(record, one.role)
        step = SHARP if point else BLUNT
        return Coordinate(name, one.unit.partition(",")[0], 0.5 * (first + last), WIDE * (last - first), step)
    if one.role == "spacing":
        return Coordinate(name, one.unit, one.default, 0.5 * one.default, SPACING)
    if one.role in HOW_LONG and plugin.extent == "stretch":
        first, last = reach(record, "distance")
        return Coordinate(name, one.unit, LONG * (last - first), LONG * (last - first), BLUNT)
    if one.role in HOW_LONG:
        longest = max(2.0 * one.default, *one.trials)
        return Coordinate(name, one.unit, one.default, longest - one.default, 0.05 * one.default)
    return None


def reach(record: Record, role: str) -> tuple[float, float]:
    """Where a place may be: the way [m], or the time of the model [s], that is compared."""
    ends = np.array([DROPPED, record.duration])
    first, last = at_times(record, ends) if role == "distance" else record.clock.model(ends)
    return float(first), float(last)


def at_times(record: Record, times: np.ndarray) -> np.ndarray:
    """Distance along the track [m] at times of the record."""
    time, speed = record.speed
    gone = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
    return record.registration.start + np.interp(times, time, gone)


@dataclass(frozen=True)
class _Copy:
    """What one copy changes: `change` (F, frames, channels) in these `frames`."""

    place: float
    values: dict[str, float]
    frames: np.ndarray
    change: np.ndarray


@dataclass(eq=False)
class Along:
    """Where an effect may be. `numbers` in the order of its own coordinates; `copies` of it along the way."""

    system: Railway
    plugin: type[Plugin]
    choices: dict[str, Any]
    numbers: dict[str, Parameter]
    copies: list[_Copy] = field(default_factory=list)

    def __post_init__(self) -> None:
        size = [name for name, one in self.numbers.items() if one.absent is not None]
        roles = {one.role: name for name, one in self.numbers.items()}
        self.size, self.where = size[0], next(roles[one] for one in WHERE if one in roles)
        self.spacing = roles.get("spacing")
        self.long = next((roles[one] for one in HOW_LONG if one in roles), None)
        self.record = self.system.record
        self.times = DROPPED + 0.5 * WINDOW * (self.record.kept + 1)  # of the frames' middles
        self.stretch = self.plugin.extent == "stretch"
        self._run()

    def _scale(self, times: np.ndarray) -> np.ndarray:
        """Times of the record as places."""
        return at_times(self.record, times) if self.numbers[self.where].role == "distance" else self._model(times)

    def _model(self, times: np.ndarray) -> np.ndarray:
        return np.asarray(self.record.clock.model(times))

    def _run(self) -> None:
        """Fill `copies`; none where the effect does not fit the vehicle or no run ends."""
        tasks = list(self._whole() if self.stretch else self._lengths())
        try:
            setups = [self._setup(values, places) for values, places in tasks]
        except InputError:
            return
        whole = self.system.simulated.channels([(self.system.nominal, 0.0), *((one, 0.0) for one in setups)])
        for (values, places), change in zip(tasks, whole[1:] - whole[0], strict=True):
            for place in places if np.isfinite(change).all() else ():
                near = np.arange(len(self.times)) if self.stretch else self._near(self._time(place))
                if len(near):
                    self.copies.append(_Copy(place, values, near, change[:, near].astype(np.complex64)))

    def _whole(self) -> Iterator[tuple[dict[str, float], np.ndarray]]:
        """One, over all of the way."""
        assert self.long is not None
        first, last = reach(self.record, "distance")
        begin = max(first - 100.0, self.numbers[self.where].low)
        yield {self.long: min(last - begin + 100.0, self.numbers[self.long].high)}, np.array([begin])

    def _lengths(self) -> Iterator[tuple[dict[str, float], np.ndarray]]:
        """Each shape, with copies at places that move on from run to run."""
        places = np.unique(self._scale(np.arange(DROPPED, self.record.duration, EVERY)))  # once where it stands
        each, count = float(np.diff(places).mean()), round(APART / EVERY)
        if self.spacing is not None:
            apart = min(self.numbers[self.spacing].high, count * each)
            count = max(1, round(apart / each))
            for k in range(min(count, len(places))):
                yield {self.spacing: apart}, np.arange(places[k], places[-1], apart)
            return
        for long in self._shapes():
            for k in range(min(count, len(places))):
                yield ({} if self.long is None else {self.long: long}), places[k::count]

    def _shapes(self) -> list[float]:
        if self.long is None:
            return [0.0]
        one = self.numbers[self.long]
        found = [one.default]
        for other in one.trials:
            if all(max(other / old, old / other) > UNLIKE for old in found):
                found.append(other)
        return found

    def _setup(self, values: dict[str, float], places: np.ndarray) -> Setup:
        setup, each = self.system.nominal, places[:1] if self.spacing is not None else places
        for place in each:
            setup = self.plugin.build({**self.choices, **values, self.where: float(place)}).install(setup)
        return setup

    def _time(self, place: float) -> float:
        """When the vehicle is at a place, by the record's clock."""
        return float(np.interp(place, *self._passed))

    @cached_property
    def _passed(self) -> tuple[np.ndarray, np.ndarray]:
        """Places, and when the vehicle is there."""
        times = np.arange(0.0, self.record.duration + EVERY, EVERY)
        return self._scale(times), times

    def _near(self, at: float) -> np.ndarray:
        """Frames in which what acts at a time moves the vehicle."""
        return np.flatnonzero((self.times > at - BEFORE - 0.5 * WINDOW) & (self.times < at + AFTER))

    def loudest(self, roots: list[np.ndarray]) -> float:
        """Deviations of healthy errors, whose inverse roots (F, C, C) of each section these are, that the default size
        is at most.
        """
        sizes = [float(np.sum(np.abs(self._white(roots, one.change, one.frames)) ** 2)) for one in self.copies]
        return math.sqrt(max(sizes, default=0.0))

    def _white(self, roots: list[np.ndarray], values: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """(F, frames, channels) in units of the errors."""
        found = np.empty(values.shape, complex)
        for root, part in zip(roots, self.record.sections, strict=True):
            inside = np.isin(frames, part)
            found[:, inside] = values[:, inside] @ np.swapaxes(root, 1, 2)
        return found

    def seek(self, system: Railway, base: Fit) -> list[tuple[float, ...]]:
        """Values of the effect's own coordinates at its likeliest places."""
        del system
        if not self.copies:
            return []
        left = np.zeros_like(self.record.seen)
        for group, part in zip(base.groups, self.record.sections, strict=True):
            left[:, part] = group.residual
        parts = sums(base.groups)
        roots = [np.linalg.inv(np.linalg.cholesky(one.covariance(base.psi))) for one in parts]
        white = self._white(roots, left, np.arange(len(self.times)))
        found = self._stretches(roots, white) if self.stretch else self._points(roots, white)
        return [tuple(one[name] for name in self.numbers) for one in found]

    def _points(self, roots: list[np.ndarray], white: np.ndarray) -> list[dict[str, float]]:
        """Of what acts at a point, or a short time."""
        f, rows = self.record.frequencies, []
        fine = np.linspace(-0.5, 0.5, FINE, endpoint=False) * EVERY
        turned = np.exp(2j * np.pi * np.outer(fine, f))
        for one in self.copies:
            change = self._white(roots, one.change, one.frames)
            push = np.real(turned @ np.einsum("ftc,ftc->f", np.conj(change), white[:, one.frames]))
            size = float(np.sum(np.abs(change) ** 2))
            at = self._scale(self._time(one.place) + fine)
            rows += [(place, pushed, size, one.values) for place, pushed in zip(at, push, strict=True)]
        if self.spacing is not None:
            return self._series(rows)
        found: list[dict[str, float]] = []
        for place, pushed, size, values in sorted(rows, key=lambda row: -self._gain(row[1], row[2])):
            apart = [abs(self._time(place) - self._time(old[self.where])) for old in found]
            if min(apart, default=math.inf) > EVERY:
                found.append({**values, self.where: float(place), self.size: self._sized(pushed, size)})
            if len(found) == LIKELY:
                break
        return found

    def _gain(self, push: float, size: float) -> float:
        """Of the likelihood by a linear size, within what it may be [nats]."""
        one = self.numbers[self.size]
        both = one.absent is not None and one.low < one.absent < one.high
        return 0.5 * (push if both else max(push, 0.0)) ** 2 / max(size, 1e-30)

    def _sized(self, push: float, size: float) -> float:
        one = self.numbers[self.size]
        assert one.absent is not None
        return float(np.clip(one.absent + push / max(size, 1e-30) * (one.default - one.absent), one.low, one.high))

    def _series(self, rows: list[tuple[float, float, float, dict[str, float]]]) -> list[dict[str, float]]:
        """Of what comes again at equal distances: the first place and the distance that explain most."""
        assert self.spacing is not None
        rows = sorted(rows, key=lambda row: row[0])
        places, push, size = (np.array([row[k] for row in rows]) for k in range(3))
        grid = np.arange(places[0], places[-1], 0.1)
        pushed, sized = np.interp(grid, places, push), np.interp(grid, places, size)
        one, best = self.numbers[self.spacing], []
        gap = one.low
        while gap < min(0.5 * (grid[-1] - grid[0]), one.high):
            first = np.arange(0.0, gap, 0.1)
            at = np.rint((first[:, None] + gap * np.arange(int((grid[-1] - grid[0]) / gap))) / 0.1).astype(int)
            at = np.minimum(at, len(grid) - 1)
            along, whole = pushed[at].sum(axis=1), sized[at].sum(axis=1)
            gains = np.where(along > 0.0, 0.5 * along**2 / np.maximum(whole, 1e-30), 0.0)
            k = int(np.argmax(gains))
            best.append((float(gains[k]), float(grid[0] + first[k]), gap, self._sized(along[k], whole[k])))
            gap *= 1.0 + 0.15 / (grid[-1] - grid[0])
        best.sort(reverse=True)
        return [{self.where: begin, self.spacing: gap, self.size: size} for _, begin, gap, size in best[:1]]

    def _stretches(self, roots: list[np.ndarray], white: np.ndarray) -> list[dict[str, float]]:
        """Of what acts over a stretch: the run of frames that it explains most of, and a little less or more."""
        assert self.long is not None
        change = self._white(roots, self.copies[0].change, self.copies[0].frames)
        push = np.concatenate([[0.0], np.cumsum(np.real(np.sum(np.conj(change) * white, axis=(0, 2))))])
        whole = np.concatenate([[0.0], np.cumsum(np.sum(np.abs(change) ** 2, axis=(0, 2)))])
        first, last = np.triu_indices(len(push), 1)
        pushed, sized = push[last] - push[first], whole[last] - whole[first]
        k = int(np.argmax([self._gain(a, b) for a, b in zip(pushed, sized, strict=True)]))
        ends = self.times[[first[k], last[k] - 1]] + 0.25 * WINDOW * np.array([-1.0, 1.0])
        size = self._sized(float(pushed[k]), float(sized[k]))
        found = []
        for moved in itertools.product(ASIDE, ASIDE):
            begin, end = self._scale(ends + np.array(moved))
            long = float(np.clip(end - begin, self.numbers[self.long].low, self.numbers[self.long].high))
            found.append({self.where: float(begin), self.long: long, self.size: size})
        return found
