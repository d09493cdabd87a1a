"""A recording of a railway vehicle as a system of the inference.

Coordinates: build and payload, alignment with the track file, gains and delays of channels and turns of sensors, then
what effects bring. Every number of the vehicle's data sheet that moves the channels is a coordinate.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from experiments.discrepancy.core.levels import fit_levels, sums
from experiments.discrepancy.core.model import Coordinate, Effect, Group, Level, T, as_healthy
from experiments.discrepancy.core.priors import HalfNormal, LogNormal
from experiments.discrepancy.core.problem import raised
from experiments.discrepancy.railway.answers import Answers
from experiments.discrepancy.railway.build import (
    along_coordinates,
    built_coordinates,
    sensor_coordinates,
)
from experiments.discrepancy.railway.creep_law import LawChange, law_coordinates, with_fastsim
from experiments.discrepancy.railway.makers import Maker
from experiments.discrepancy.railway.passing import Passing, smooth
from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.runs import remembered
from experiments.discrepancy.railway.simulated import Shown, Simulated, simulated_over, together_for
from experiments.discrepancy.railway.survey import HIDDEN, Surveyed, sources
from experiments.discrepancy.railway.survey_levels import TOLD, LevelSearch, Steps, moved
from experiments.discrepancy.railway.together import Together
from experiments.discrepancy.railway.tolerances import WIDEST
from railsim.effects.interface import Effect as Plugin
from railsim.effects.interface import Setup
from railsim.errors import InputError
from railsim.track.track import Track

HIDDEN_SPREAD = 1.5  # of the log of the level of what the track file hides: a factor of 4.5
HEALTHY = 0.005  # scale of latent levels before any are learned, relative to what acts at the place
SEEN = 0.1  # standard deviations of the noise: what moves the record less is no coordinate
OFF = 1.0  # standard deviations of the noise: where what FASTSIM changes is more off, it is taken anew
GRID = 0.15 * np.arange(-2, 3)  # m
STEPS = 0.7  # of the log of the survey's level, between which the expected track is the same: a factor of two
FIRST = (-5, -4, -3, -2, -1, 0, 1, 2)  # of these steps, among which the first is chosen


@dataclass(frozen=True, eq=False)
class Railway:
    """A `System` of the inference. `scales` of healthy levels by their `kind_of`; `installed`: how effects are made, by
    name; `survey`: steps of the logs of the levels of the file's errors, kind by kind, at which the track is expected
    (None: as stated); `kept`: what systems of one record share.
    """

    record: Record
    scales: Mapping[str, float] = field(default_factory=dict)
    installed: Mapping[str, Maker] = field(default_factory=dict)
    survey: tuple[int, ...] | None = None
    kept: dict[object, Any] = field(default_factory=dict)
    last: dict[bytes, Shown | None] = field(default_factory=dict)

    @cached_property
    def build(self) -> tuple[Coordinate, ...]:
        """Numbers of the data sheet that move the channels, and the payload."""
        if "build" not in self.kept:
            self.kept["build"] = self._seen_build()
        return self.kept["build"]

    def _seen_build(self) -> tuple[Coordinate, ...]:
        found = built_coordinates(self.record.scenario.vehicle)
        moved = [self.simulated.setup({one.name: math.copysign(one.spread, one.step or 1.0)}, ()) for one in found]
        shown = self.simulated.channels([(one, 0.0) for one in (self.nominal, *moved)])
        return tuple(one for one, other in zip(found, shown[1:], strict=True) if self._seen(other - shown[0]))

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """Build, payload, alignment, creep law, sensors."""
        return self._coordinates

    @cached_property
    def _coordinates(self) -> tuple[Coordinate, ...]:
        return (*self.build, *along_coordinates(self.record), *self._law, *sensor_coordinates(self.record))

    @property
    def _law(self) -> tuple[Coordinate, ...]:
        """The creep law, where another one would show."""
        if "law" not in self.kept:
            seen = self._seen(self._law_change.there @ self.simulated.turns[1][0].T)
            self.kept["law"] = tuple(law_coordinates(self.record.scenario.vehicle)) if seen else ()
        return self.kept["law"]

    @property
    def _law_change(self) -> LawChange:
        """What FASTSIM changes in runs by Polach's law, 0 where they have neither: that of the nominal one until
        `settle`. It is the same of all hypotheses, because FASTSIM takes many times as long.
        """
        if "law change" not in self.kept:
            (change,) = self._law_changes([(self.nominal, 0.0)])
            found = change if np.isfinite(change).all() else np.zeros_like(change)
            self.kept["law change"] = LawChange(np.empty(0), found)
        return self.kept["law change"]

    def _law_is_off(self, x: np.ndarray) -> bool:
        """Whether what is taken for FASTSIM's change is off at x; no where a run fails, and the old one stays."""
        change = self._law_changes([self.at(x, ())])[0] - self._law_change.at(x)
        return self._seen(x[self._index["creep law"]] * change @ self.simulated.turns[1][0].T, OFF)

    def _law_change_about(self, x: np.ndarray) -> LawChange:
        """With slopes by all that runs depend on and that show; they hold as far as a build may be off."""
        moving, read = self.coordinates[: self._after_runs.start], self.simulated.turns[1][0].T
        most = np.array([one.most for one in self.coordinates])
        x = np.minimum(x, most)
        moves = np.diag([one.difference for one in self.coordinates])[: len(moving)]
        there, *beside = self._law_changes([self.at(one, ()) for one in (x, *(x + moves))])
        slopes = {place: (one - there) / moves[place, place] for place, one in enumerate(beside)}
        seen = {place: one for place, one in slopes.items() if self._seen(moving[place].spread * one @ read)}
        far = WIDEST * np.array([one.spread for one in self.coordinates])
        return LawChange(x, there, seen, x - far, np.minimum(x + far, most))

    def _law_changes(self, setups: Sequence[tuple[Setup, float]]) -> np.ndarray:
        """(setups, F, frames, components); not finite where a run fails."""
        others = [with_fastsim(setup.vehicle) or setup.vehicle for setup, _ in setups]
        by_other = [(setup.but(vehicle=one), ahead) for (setup, ahead), one in zip(setups, others, strict=True)]
        polach, other = np.split(self.simulated.outputs([*setups, *by_other]), 2)
        return other - polach

    def _seen(self, change: np.ndarray, least: float = SEEN) -> bool:
        """Whether (F, frames, channels) would show; False of a run that has failed."""
        return float(np.sum(np.abs(change) ** 2 / self.record.densities)) > least**2

    @property
    def middle(self) -> np.ndarray:
        """Means of the coordinates."""
        return np.array([one.mean for one in self.coordinates])

    @property
    def levels(self) -> tuple[Level, ...]:
        """Sensors, survey, latent forces and readings."""
        return self._levels

    @cached_property
    def _levels(self) -> tuple[Level, ...]:
        spread = 0.5 if self.record.stated else 1.2
        channels = list(self.record.channels)
        names = [one.name for one in self.answers[0].places]
        return (
            *(Level(f"noise {name}", "sensor", LogNormal(1.0, 0.3)) for name in channels),
            *(Level(f"survey {kind}", "input", LogNormal(1.0, HIDDEN_SPREAD if kind.endswith(HIDDEN) else spread))
              for kind in self._sources),
            *(Level(f"force {n}", "force", HalfNormal(self.scales.get(kind_of(f"force {n}"), HEALTHY)), n)
              for n in names),
            *(Level(f"reading {n}", "reading", HalfNormal(self.scales.get(kind_of(f"reading {n}"), HEALTHY)), n)
              for n in channels),
        )  # fmt: skip

    @property
    def observed(self) -> tuple[np.ndarray, ...]:
        """The record's frames, by sections of like speed."""
        return self._sections(self.record.seen)

    def _sections(self, values: np.ndarray) -> tuple[np.ndarray, ...]:
        return tuple(values[..., part, :] for part in self.record.sections)

    def starts(self) -> np.ndarray:
        """A grid about the registration: shifts of the run's middle and of its ends."""
        middles, ends = np.meshgrid(GRID, GRID, indexing="ij")
        points = np.tile(self.middle, (middles.size, 1))
        points[:, self._index["offset"]] = middles.ravel()
        points[:, self._index["speed"]] = ends.ravel() / (0.5 * self.record.way)
        return points

    def predict(self, points: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """(points, F, frames, channels) of each section; not finite where a run has failed."""
        points, effects = as_healthy(points, effects, self.coordinates)
        still = points.copy()
        still[:, self._after_runs] = 0.0
        moved, back = np.unique(still, axis=0, return_inverse=True)
        raw = self._raw([(x, effects) for x in moved])
        return self._sections(self._sensed(points, raw[back.ravel()]))

    def predict_each(self, points: Sequence[tuple[np.ndarray, tuple[Effect, ...]]]) -> list[tuple[np.ndarray, ...]]:
        """`predict` of several hypotheses, all runs at once."""
        points = [as_healthy(at, effects, self.coordinates) for at, effects in points]
        ends = np.cumsum([len(at) for at, _ in points])
        raw = self._raw([(x, effects) for at, effects in points for x in at])
        parts = zip(points, np.split(raw, ends[:-1]), strict=True)
        return [self._sections(self._sensed(at, part)) for (at, _), part in parts]

    def _sensed(self, points: np.ndarray, raw: np.ndarray) -> np.ndarray:
        """(points, F, frames, channels) of what the ideal sensors show, with creep law, gains, delays and turns."""
        count, (_, whole) = len(self.record.channels), self.simulated.turns
        found = np.empty((*raw.shape[:3], count), complex)
        for row, x in enumerate(points[:, self._of_sensors]):
            gains, delays, angles = x[:count], x[count : 2 * count], x[2 * count :]
            shown = np.tensordot(np.concatenate([[1.0], angles]), whole, 1)
            factor = np.exp(gains - 2j * np.pi * self.record.frequencies[:, None] * delays)
            law = points[row, self._index["creep law"]] * self._law_change.at(points[row]) if self._law else 0.0
            found[row] = ((raw[row] + law) @ shown.T) * factor[:, None, :]
        return found

    def covariances(self, x: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """(levels, F, channels, channels) of each section; linear answers to forces are those of the nominal build."""
        still = x.copy()
        still[self._after_runs] = 0.0
        shown = self._one(still, effects)
        f, count = self.record.frequencies, len(self.record.channels)
        if shown is None:
            return tuple(np.full((len(self.levels), len(f), count, count), np.nan + 0j) for _ in self.record.sections)
        read = shown.read @ self.simulated.turns[1][0].T
        gains = self._passing.gains(_key(still, effects), *self.at(still, effects))
        return tuple(self._of_section(number, read, shown.acting, one) for number, one in enumerate(gains))

    def _one(self, x: np.ndarray, effects: tuple[Effect, ...]) -> Shown | None:
        """One run, of which the last few are remembered."""
        return remembered(self.last, _key(x, effects), lambda: self.simulated.shown(*self.at(x, effects)))

    def _raw(self, points: Sequence[tuple[np.ndarray, tuple[Effect, ...]]]) -> np.ndarray:
        """(points, F, frames, components)."""
        if len(points) > 1:
            return self.simulated.outputs([self.at(x, effects) for x, effects in points])
        shown = self._one(*points[0])
        if shown is None:
            return np.full((1, *self.record.seen.shape[:2], len(self.simulated.turns[0])), np.nan + 0j)
        return shown.read[None]

    def side_by_side(self, tasks: Sequence[Callable[[], T]]) -> list[T]:
        """Results of tasks that ask for predictions, in their order; what they ask for at a time is run together."""
        return self._together.all_of(tasks)

    @property
    def dear(self) -> bool:
        """Runs take most of the time."""
        return True

    @property
    def _together(self) -> Together:
        if "together" not in self.kept:
            self.kept["together"] = together_for(self.record)
        return self.kept["together"]

    def _of_section(
        self, number: int, read: np.ndarray, frames: Mapping[str, np.ndarray], gains: Mapping[str, np.ndarray]
    ) -> np.ndarray:
        answers, part = self.answers[number], self.record.sections[number]
        count, shape = len(self.record.channels), (len(self.record.frequencies), *[len(self.record.channels)] * 2)
        units = [np.outer(one, one) for one in np.eye(count)]
        whole = [np.broadcast_to(density * unit, shape) for density, unit in zip(self._noise, units, strict=True)]
        whole += [self._survey(number, source, gains) for source in self._sources]
        for column, place in enumerate(answers.places):
            power = smooth(np.mean(np.abs(answers.acting(place, frames)[:, part]) ** 2, axis=1))
            one = answers.forces[:, :, column]
            whole.append(power[:, None, None] * one[:, :, None] * np.conj(one[:, None, :]))
        power = smooth(np.mean(np.abs(read[:, part]) ** 2, axis=1))
        whole += [power[:, k, None, None] * unit for k, unit in enumerate(units)]
        found = np.stack([one.astype(complex) for one in whole])
        found[:, :, range(count), range(count)] += 1e-12 * self._noise
        return found

    def about(self, x: np.ndarray, effects: tuple[Effect, ...], psi: np.ndarray | None) -> "Railway":
        """The system over the track that is expected, the same for all hypotheses: what a fit gained by another track
        would be no evidence.
        """
        del x, effects, psi
        return self._over(self._chosen_survey)

    @property
    def _kinds(self) -> tuple[str, ...]:
        """Of errors of the track file that the channels show."""
        if "kinds" not in self.kept:
            self.kept["kinds"] = tuple(kind for kind in self._surveyed.kinds() if self._shows(kind))
        return self.kept["kinds"]

    def _shows(self, kind: str) -> bool:
        powers = (part for column in self._surveyed.columns(kind) for part in self._passing.nominal[column])
        sizes = [np.einsum("fcc->fc", one).real.sum(axis=0) / self._noise for one in powers]
        return float(np.sum(sizes)) * self.record.seen.shape[1] > SEEN**2

    @property
    def _sources(self) -> tuple[str, ...]:
        return sources(self._kinds)

    def _over(self, survey: tuple[int, ...]) -> "Railway":
        if survey == self._steps:
            return self
        if survey not in self.kept:
            self.kept[survey] = Railway(self.record, self.scales, self.installed, survey, self.kept)
        return self.kept[survey]

    @property
    def _steps(self) -> tuple[int, ...]:
        return (0,) * len(self._kinds) if self.survey is None else self.survey

    @property
    def _chosen_survey(self) -> Steps:
        """Levels of the file's errors, kind by kind, by the likelihood of the nominal model where it lies best on the
        track: a track that is taken as too uncertain loses its short waves, and then their absence speaks for that
        uncertainty, an optimum of its own; and where the model is decimetres off, short waves are better absent. The
        nominal model takes its own faults for errors of the file, so `settle` may lower the levels afterwards.
        """
        if "survey" not in self.kept:
            x, best = self._laid(), (0,) * len(self._kinds)
            for kind in range(len(best)):
                tried = [moved(best, kind, step) for step in FIRST]
                left = dict(zip(tried, self._left([(one, x) for one in tried]), strict=True))  # `best` among them
                rough = min(tried, key=left.__getitem__)
                if left[best] - left[rough] >= TOLD:
                    best = self._levels_near(x).beside(rough, kind)
            self.kept["survey"] = best
        return self.kept["survey"]

    def settle(self, x: np.ndarray) -> bool:
        """Lower the levels of the file's errors where that leaves less at x; take what FASTSIM changes anew if off."""
        begun, change = self._chosen_survey, self._law_change
        self.kept["survey"] = self._levels_near(x).lowered(begun)
        over = self._over(self._chosen_survey)
        if self._law and over._law_is_off(x):
            self.kept["law change"] = over._law_change_about(x)
        return self._chosen_survey != begun or self._law_change is not change

    def _levels_near(self, x: np.ndarray) -> LevelSearch:
        return LevelSearch(lambda all_of: self.side_by_side([partial(self._over(one).cost_at, x) for one in all_of]))

    def _laid(self) -> np.ndarray:
        """The start that leaves least over the file's track as stated."""
        starts, stated = self.starts(), (0,) * len(self._kinds)
        return starts[int(np.argmin(self._left([(stated, x) for x in starts])))]

    def _left(self, at: Sequence[tuple[tuple[int, ...], np.ndarray]]) -> list[float]:
        """Of levels and coordinates: sum of the logs of what is left, the likelihood with a free spectrum in each
        channel.
        """
        tracks = {one: self._expected(self._levels_at(one)) for one, _ in at}
        placed = [(tracks[one], *self.at(x, ())) for one, x in at]
        raw = self.simulated.outputs([(setup.but(track=track), ahead) for track, setup, ahead in placed])
        shown = self._sensed(np.stack([x for _, x in at]), raw)
        power = np.mean(np.abs(shown - self.record.seen) ** 2, axis=2)
        return [float(np.log(one).sum()) if np.isfinite(one).all() else math.inf for one in power]

    def cost_at(self, x: np.ndarray) -> float:
        """Minus the log likelihood at x with the levels that fit best there, and their priors."""
        pairs = zip(self.observed, self.predict(x[None], ()), self.covariances(x, ()), strict=True)
        groups = [Group(seen - shown[0], parts) for seen, shown, parts in pairs]
        if not all(np.isfinite(one.residual).all() for one in groups):
            return math.inf
        start = raised(self.levels)
        return fit_levels(sums(groups), self.levels, start, 0.5, 20).cost

    def _levels_at(self, steps: Sequence[int]) -> dict[str, float]:
        moved = {kind: math.exp(STEPS * step) for kind, step in zip(self._kinds, steps, strict=True)}
        return dict.fromkeys(self._surveyed.kinds(), 1.0) | moved

    def nominal_with(self, effect: Plugin) -> Setup:
        """The nominal setup with an effect; raises `InputError` where it does not fit."""
        return effect.install(self.nominal)

    @property
    def _surveyed(self) -> Surveyed:
        return self.record.surveyed

    @cached_property
    def _index(self) -> dict[str, int]:
        return {one.name: number for number, one in enumerate(self.coordinates)}

    @property
    def alignment(self) -> list[int]:
        """Places of the coordinates of the alignment with the track."""
        return [self._index[one.name] for one in along_coordinates(self.record)]

    @cached_property
    def _of_sensors(self) -> slice:
        """Where gains, delays and turns stand among the coordinates."""
        first = len(self.coordinates) - len(sensor_coordinates(self.record))
        return slice(first, len(self.coordinates))

    @cached_property
    def _after_runs(self) -> slice:
        """Where the coordinates stand that no run depends on: creep law and sensors."""
        return slice(self._of_sensors.start - len(self._law), len(self.coordinates))

    @cached_property
    def _noise(self) -> np.ndarray:
        return self.record.densities

    @cached_property
    def simulated(self) -> Simulated:
        """The vehicle over the expected track."""
        as_stated = dict.fromkeys(self._surveyed.kinds(), 1.0)
        levels = as_stated if self.survey is None else self._levels_at(self.survey)
        return simulated_over(self.record, self._expected(levels), self._together, self.kept)

    def _expected(self, levels: dict[str, float]) -> Track:
        return self.record.passed(self._surveyed.expected(levels))

    @property
    def nominal(self) -> Setup:
        """The nominal setup over the expected track."""
        return self.simulated.nominal

    @cached_property
    def answers(self) -> tuple[Answers, ...]:
        """Linear answers in each section."""
        if "answers" not in self.kept:
            model, f = self.nominal.model, self.record.frequencies
            speeds = [self.record.speed_of(number) for number in range(len(self.record.sections))]
            self.kept["answers"] = tuple(Answers(model, speed, self.record.channels, f) for speed in speeds)
        return self.kept["answers"]

    def answer(self, level: Level, section: int) -> np.ndarray:
        """(F, channels) to 1 N, 1 N m or one unit of a reading, of a latent level."""
        channels, answers = list(self.record.channels), self.answers[section]
        if level.kind == "reading":
            return np.tile(np.eye(len(channels))[channels.index(str(level.place))], (len(answers.f), 1))
        return answers.forces[:, :, [one.name for one in answers.places].index(str(level.place))]

    def joint(self, x: np.ndarray, effects: tuple[Effect, ...], level: Level) -> tuple[np.ndarray, np.ndarray] | None:
        """(F, frames) how far the place of a latent force opens at x [m or rad], and the force or moment on its upper
        body by which tolerances there are off the data sheet; None where it joins no two bodies.
        """
        nominal, count = self.answers[0], len(self.coordinates)
        place = next((one for one in nominal.places if one.name == level.place and one.lower), None)
        still = x.copy()
        still[self._after_runs] = 0.0
        if place is None or (shown := self._one(still, effects)) is None:
            return None
        for fault in (fault for one in effects for fault in one.faults):
            still[self._index[fault.name]] = self.coordinates[self._index[fault.name]].mean
        built = replace(nominal, model=self.at(still[:count], ())[0].model)
        beyond = nominal.acting(place, shown.acting) - built.acting(place, shown.acting)
        return nominal.opened(place, shown.acting), beyond

    def unit_of(self, level: Level) -> str:
        """Of what acts at the place of a latent level."""
        if level.kind == "reading":
            return str(level.place).rpartition("[")[2].rstrip("]")
        return "N m" if str(level.place).rpartition(" ")[2] in ("roll", "yaw") else "N"

    @cached_property
    def _shares(self) -> list[dict[str, dict[str, np.ndarray]]]:
        """Of each section, source of errors and column: the share of its power that is left open, (F,)."""
        levels, found = self._levels_at(self._steps), []
        for number in range(len(self.record.sections)):
            waves = self.record.frequencies / self.record.speed_of(number)
            found.append({one: self._surveyed.shares(one, levels[one.removesuffix(HIDDEN)], waves)
                          for one in self._sources})  # fmt: skip
        return found

    def _survey(self, number: int, source: str, gains: Mapping[str, np.ndarray]) -> np.ndarray:
        """(F, channels, channels) of a source of errors in a section, as loud as stated."""
        nominal, found = self._passing.nominal, 0.0
        for column, share in self._shares[number][source].items():
            gain = gains[column]
            found = found + (share[:, None] * gain)[:, :, None] * np.conj(gain)[:, None, :] * nominal[column][number]
        return np.asarray(found)

    @property
    def _passing(self) -> Passing:
        """What errors of the track file do, through any vehicle."""
        if "passing" not in self.kept:
            as_stated = dict.fromkeys(self._surveyed.kinds(), 1.0)
            over = replace(self.simulated, track=self._expected(as_stated))
            self.kept["passing"] = Passing(self.record, over)
        return self.kept["passing"]

    def at(self, x: np.ndarray, effects: tuple[Effect, ...]) -> tuple[Setup, float]:
        """Setup of a hypothesis at x, and how far ahead of the registered start it begins [m], not finite where there
        is no such vehicle.
        """
        x, effects = as_healthy(x, effects, self.coordinates)
        values = dict(zip([one.name for one in self.coordinates], x, strict=False))
        column, made = len(self.coordinates), []
        ahead = self.ahead(values)
        try:
            for effect in effects:
                own = x[column : column + len(effect.own)]
                column += len(effect.own)
                if effect.own:
                    made.append(self.installed[effect.listed].make(own))
            return self.simulated.setup(values, tuple(made)), ahead
        except InputError:
            return self.nominal, math.nan

    def ahead(self, values: Mapping[str, float]) -> float:
        """Of the registered start: where a run with these coordinates begins [m]."""
        return float(values["offset"] - values["speed"] * 0.5 * self.record.way)

    def shown(self, setups: Sequence[tuple[Setup, float]]) -> tuple[np.ndarray, ...]:
        """(setups, F, frames, channels) of each section, of sensors as they should be."""
        return self._sections(self.simulated.channels(setups))


def _key(x: np.ndarray, effects: tuple[Effect, ...]) -> bytes:
    """Of a vehicle's run."""
    return x.tobytes() + "".join(one.name for one in effects).encode()


def kind_of(level: str) -> str:
    """Of a level's name: without numbers and sides, for all axles and both sides are alike."""
    return re.sub(r"\d+|_left|_right", "", level.partition(" [")[0])
