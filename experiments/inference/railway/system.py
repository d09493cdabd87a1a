"""A recording of a railway vehicle as a system of the inference: vertical channels on straight track.

Coordinates: build and payload, alignment with the track file, gains and delays of the channels, then what effects
bring. Every number of the vehicle's data sheet that moves the channels is a coordinate.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property

import numpy as np

from experiments.inference.model import Coordinate, Effect, Level
from experiments.inference.priors import HalfNormal, LogNormal
from experiments.inference.railway.answers import Answers, force_of
from experiments.inference.railway.record import Record
from experiments.inference.railway.runs import run_all
from experiments.inference.railway.survey import HIDDEN, Surveyed
from railsim.dynamics.channels import channel_names
from railsim.effects.interface import EFFECTS, Setup
from railsim.effects.interface import Effect as Plugin
from railsim.engines.interface import Run, default_substeps
from railsim.errors import InputError
from railsim.sensors.interface import Sensor
from railsim.speed import Profile
from railsim.track.kernel import TrackTables, build_tables
from railsim.track.track import Track
from railsim.truth import HeldTruth

SHEET = {"_mass": 0.02, "_inertia": 0.04, "_stiffness": 0.06, "_damping": 0.10, "contact_damping_ratio": 0.3}
"""Standard deviations of the logs of a build's numbers by the ending of their names; illustrative."""
PAYLOAD = 1500.0  # kg; spread of what nobody has weighed
OFFSET, SCALE, WANDER, WANDERS = 0.3, 2e-3, 0.02, 2  # m at mid-run, -, m; number of slow sines
GAIN, DELAY = 0.01, 2e-4  # -, s; where the data sheet states no spread of the scale
HIDDEN_SPREAD = 1.5  # of the log of the level of what the track file hides: a factor of 4.5
HEALTHY = 0.005  # scale of latent levels before any are learned, relative to what acts at the place
SEEN = 0.1  # standard deviations of the noise: what moves the record less is no coordinate
DRAWS = 8  # tracks with other errors, of which the survey's covariance is made
STEPS = 0.5  # of the log of the survey's level, between which the expected track is the same
SEED = 20110901  # of these draws: the same for every hypothesis

Choices = dict[str, object]


@dataclass(frozen=True)
class Installed:
    """How an effect is made: its plug-in, choices that are fixed, fields that are its own coordinates."""

    plugin: type[Plugin]
    choices: Choices
    fields: tuple[str, ...]

    def make(self, values: np.ndarray) -> Plugin:
        """With these values, each within what the plug-in allows."""
        found = dict(self.choices)
        for name, value in zip(self.fields, values, strict=True):
            low, high = self.plugin.limits(name)
            found[name] = float(min(max(value, -math.inf if low is None else low), math.inf if high is None else high))
        return self.plugin.build(found)


@dataclass(frozen=True, eq=False)
class Railway:
    """A `System` of the inference. `scales` of healthy levels by name; `installed`: how effects are made, by name;
    `survey_level`: of the file's errors over the stated ones, at which the track is expected; `kept`: what systems of
    one record share.
    """

    record: Record
    scales: Mapping[str, float] = field(default_factory=dict)
    installed: dict[str, Installed] = field(default_factory=dict)
    survey_level: float = 1.0
    kept: dict[str, object] = field(default_factory=dict)

    @cached_property
    def build(self) -> tuple[Coordinate, ...]:
        """Numbers of the data sheet that move the channels, and the payload."""
        if "build" not in self.kept:
            self.kept["build"] = self._seen_build()
        return self.kept["build"]  # type: ignore[return-value]

    def _seen_build(self) -> tuple[Coordinate, ...]:
        vehicle = self.record.scenario.vehicle
        found = []
        for name in type(vehicle).model_fields:
            value, spread = getattr(vehicle, name), next((s for end, s in SHEET.items() if name.endswith(end)), None)
            if spread and isinstance(value, float) and value > 0.0:
                found.append(Coordinate(f"log {name}", "-", 0.0, spread))
        found.append(Coordinate("payload", "kg", 0.0, PAYLOAD))
        moved = [self._setup({one.name: one.spread}, ()) for one in found]
        outputs = self.outputs([(self._nominal, 0.0), *((one, 0.0) for one in moved)])
        sizes = np.abs(outputs[1:] - outputs[0]) ** 2 / self.record.densities
        sizes = np.nan_to_num(sizes, nan=0.0).sum(axis=(1, 2, 3))
        return tuple(one for one, size in zip(found, sizes, strict=True) if size > SEEN**2)

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """Build, payload, alignment, sensors."""
        return self._coordinates

    @cached_property
    def _coordinates(self) -> tuple[Coordinate, ...]:
        along = (
            Coordinate("offset", "m", 0.0, OFFSET, 1e-3), Coordinate("speed", "-", 0.0, SCALE, 1e-5),
            *(Coordinate(f"wander {k + 1}", "m", 0.0, WANDER, 1e-3) for k in range(WANDERS)),
        )  # fmt: skip
        gains = [
            Coordinate(f"gain {name}", "-", 0.0, max(one.errors.scale_error_std, GAIN))
            for name, one in self.record.channels.items()
        ]
        delays = [Coordinate(f"delay {name}", "s", 0.0, DELAY) for name in self.record.channels]
        return (*self.build, *along, *gains, *delays)

    @property
    def levels(self) -> tuple[Level, ...]:
        """Sensors, survey, latent forces and readings."""
        return self._levels

    @cached_property
    def _levels(self) -> tuple[Level, ...]:
        spread = 0.5 if self.record.stated else 1.2
        channels = list(self.record.channels)
        names = [one.name for one in self._answers.places]
        return (
            *(Level(f"noise {name}", "sensor", LogNormal(1.0, 0.3)) for name in channels),
            *(Level(f"survey {kind}", "input", LogNormal(1.0, HIDDEN_SPREAD if kind.endswith(HIDDEN) else spread))
              for kind in self._surveyed.sources()),
            *(Level(f"force {n}", "force", HalfNormal(self.scales.get(f"force {n}", HEALTHY)), n) for n in names),
            *(Level(f"reading {n}", "reading", HalfNormal(self.scales.get(f"reading {n}", HEALTHY)), n)
              for n in channels),
        )  # fmt: skip

    @property
    def observed(self) -> tuple[np.ndarray, ...]:
        """The record's frames."""
        return (self.record.seen,)

    def starts(self) -> np.ndarray:
        """A grid of place and speed."""
        offsets, scales = np.meshgrid(0.15 * np.arange(-5, 6), 1.2e-3 * np.arange(-3, 4), indexing="ij")
        points = np.zeros((offsets.size, len(self.coordinates)))
        points[:, self._index["offset"]], points[:, self._index["speed"]] = offsets.ravel(), scales.ravel()
        return points

    def predict(self, points: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """(points, F, frames, channels); not finite where a run has failed."""
        first, count = self._index[self._gains[0]], len(self.record.channels)
        still = points.copy()
        still[:, first : first + 2 * count] = 0.0
        moved, back = np.unique(still, axis=0, return_inverse=True)
        found = self.outputs([self._at(x, effects) for x in moved])[back.ravel()]
        gains, delays = points[:, first : first + count], points[:, first + count : first + 2 * count]
        turn = np.exp(gains[:, None] - 2j * np.pi * self.record.frequencies[:, None] * delays[:, None])
        return (found * turn[:, :, None, :],)

    def covariances(self, x: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """(levels, F, channels, channels); linear answers of the nominal build."""
        f, count, answers = self.record.frequencies, len(self.record.channels), self._answers
        setup, start = self._at(x, effects)
        truth = self._run([(setup, start)])[0]
        if truth is None:
            return (np.full((len(self.levels), len(f), count, count), np.nan + 0j),)
        read = self._read(setup.sensors, truth)
        frames = {
            name: self.record.framed(name, truth[name], truth.rate)
            for place in answers.places for name in place.needs if name in truth
        }  # fmt: skip
        eye, parts = np.eye(count), [d * np.eye(count)[[k]].T @ np.eye(count)[[k]] for k, d in enumerate(self._noise)]
        whole = [np.broadcast_to(one, (len(f), count, count)) for one in parts]
        whole += [self._survey[kind] for kind in self._surveyed.sources()]
        for number, place in enumerate(answers.places):
            power = np.mean(np.abs(force_of(place, self._nominal.model, frames, f)) ** 2, axis=1)
            one = answers.forces[:, :, number]
            whole.append(_smooth(power)[:, None, None] * one[:, :, None] * np.conj(one[:, None, :]))
        power = np.mean(np.abs(read) ** 2, axis=1)
        whole += [_smooth(power[:, k])[:, None, None] * np.outer(eye[k], eye[k]) for k in range(count)]
        found = np.stack([one.astype(complex) for one in whole])
        found[:, :, range(count), range(count)] += 1e-12 * self._noise
        return (found,)

    def about(self, x: np.ndarray, effects: tuple[Effect, ...], psi: np.ndarray | None) -> "Railway":
        """The system over the track that is expected with the survey's errors as loud as they are."""
        del x, effects
        if psi is None:
            return self
        names = [one.name for one in self.levels]
        if "survey vertical" not in names:
            return self
        level = float(np.clip(psi[names.index("survey vertical")], -3.0, 3.0))
        level = math.exp(STEPS * round(level / STEPS))
        if level == self.survey_level:
            return self
        key = f"level {level:.3f}"
        if key not in self.kept:
            self.kept[key] = Railway(self.record, self.scales, self.installed, level, self.kept)
        return self.kept[key]  # type: ignore[return-value]

    def nominal_with(self, effect: Plugin) -> Setup:
        """The nominal setup with an effect; raises `InputError` where it does not fit."""
        return effect.install(self._nominal)

    @property
    def _surveyed(self) -> Surveyed:
        return self.record.surveyed

    @cached_property
    def _index(self) -> dict[str, int]:
        return {one.name: number for number, one in enumerate(self.coordinates)}

    @property
    def _gains(self) -> list[str]:
        return [f"gain {name}" for name in self.record.channels]

    @cached_property
    def _noise(self) -> np.ndarray:
        return self.record.densities

    @cached_property
    def _nominal(self) -> Setup:
        return self._setup({}, ())

    @cached_property
    def _answers(self) -> Answers:
        if "answers" not in self.kept:
            speed = float(np.mean(self.record.speed[1]))
            self.kept["answers"] = Answers.of(self._nominal.model, speed, self.record.channels, self.record.frequencies)
        return self.kept["answers"]  # type: ignore[return-value]

    @cached_property
    def _tables(self) -> TrackTables:
        return build_tables(self._track)

    @cached_property
    def _track(self) -> Track:
        return self._surveyed.expected(dict.fromkeys(self._surveyed.kinds(), self.survey_level))

    @cached_property
    def _survey(self) -> dict[str, np.ndarray]:
        """(F, channels, channels) of each kind of error, as loud as stated, from runs over other tracks."""
        rng, found = np.random.default_rng(SEED), {}
        nominal = self.outputs([(self._nominal, 0.0)])[0]
        for kind in self._surveyed.sources():
            tracks = [self._surveyed.drawn(kind, self.survey_level, rng) for _ in range(DRAWS)]
            change = self.outputs([(self._nominal.but(track=one), 0.0) for one in tracks]) - nominal
            outer = np.einsum("rftc,rftd->fcd", change, np.conj(change)) / (change.shape[0] * change.shape[2])
            found[kind] = _smooth(outer)
        return found

    def _at(self, x: np.ndarray, effects: tuple[Effect, ...]) -> tuple[Setup, float]:
        values = dict(zip([one.name for one in self.coordinates], x, strict=False))
        column, made = len(self.coordinates), []
        for effect in effects:
            own = x[column : column + len(effect.own)]
            column += len(effect.own)
            if effect.own:
                made.append(self.installed[effect.name.removeprefix("small ")].make(own))
        ahead = values["offset"] - values["speed"] * 0.5 * self._way
        try:
            return self._setup(values, tuple(made)), float(ahead)
        except InputError:
            return self._nominal, math.nan

    @cached_property
    def _way(self) -> float:
        return float(np.trapezoid(self.record.speed[1], self.record.speed[0]))

    def _setup(self, values: Mapping[str, float], effects: tuple[Plugin, ...]) -> Setup:
        scenario = self.record.scenario
        changed = {
            name.removeprefix("log "): getattr(scenario.vehicle, name.removeprefix("log ")) * math.exp(value)
            for name, value in values.items()
            if name.startswith("log ") and value != 0.0
        }
        setup = Setup(
            scenario.vehicle.but(**changed), self._track, self.record.ideal, self._speed(values), scenario.traction,
            self.record.duration, flexible_track=scenario.flexible_track,
        )  # fmt: skip
        laden = values.get("payload", 0.0)
        load = (EFFECTS.pick("payload").build({"mass": float(np.clip(laden, -2000.0, 10e3))}),) if laden else ()
        for effect in (*scenario.effects, *load, *effects):
            setup = effect.install(setup)
        return setup

    def _speed(self, values: Mapping[str, float]) -> Profile:
        time, speed = self.record.speed
        turn = np.pi * np.arange(1, WANDERS + 1) / self.record.duration
        sizes = np.array([values.get(f"wander {k + 1}", 0.0) for k in range(WANDERS)])
        moved = speed * (1.0 + values.get("speed", 0.0)) + (sizes * turn) @ np.cos(turn[:, None] * time)
        return Profile(kind="profile", time=tuple(time.tolist()), speed=tuple(moved.tolist()))

    def _run(self, setups: list[tuple[Setup, float]]) -> list[HeldTruth | None]:
        runs, numbers = [], []
        for number, (setup, ahead) in enumerate(setups):
            if not math.isfinite(ahead):
                continue
            rate = self.record.scenario.output_rate
            sub = default_substeps(setup.model, setup.speed_tables, rate)
            sub *= 2 ** math.ceil(math.log2(max(1.0, 1.0 / (rate * sub * setup.longest_step))))
            tables = self._tables if setup.track is self._track else build_tables(setup.track)
            start = self.record.scenario.start + ahead
            runs.append(Run(setup.model, tables, setup.speed_tables, start, setup.duration, rate, sub))
            numbers.append(number)
        about: dict[str, object] = {"vehicle": {"wheel_radius [m]": self._nominal.model.wheelsets[0].radius}}
        found: list[HeldTruth | None] = [None] * len(setups)
        for number, truth in zip(numbers, run_all(runs, about, self._needed), strict=True):
            found[number] = truth
        return found

    @cached_property
    def _needed(self) -> list[str]:
        """Channels of truth that sensors and places read."""
        if "needed" not in self.kept:
            places = [name for one in self._answers.places for name in one.needs]
            bodies = {one.body for one in self.record.sensors}
            setup = self._nominal
            names = channel_names(setup.model)
            wanted = [n for n in names if n.split(".")[0] in bodies or n in places or n.endswith("displacement [m]")]
            self.kept["needed"] = [*wanted, *(n for n in names if n.startswith(("speed", "acceleration")))]
        return self.kept["needed"]  # type: ignore[return-value]

    def outputs(self, setups: list[tuple[Setup, float]]) -> np.ndarray:
        """(setups, F, frames, channels)."""
        found = np.full((len(setups), *self.record.seen.shape), np.nan + 0j)
        moving = [
            number for number, (one, ahead) in enumerate(setups) if ahead != 0.0 or not self._moves_as_nominal(one)
        ]
        truths = dict(zip(moving, self._run([setups[number] for number in moving]), strict=True))
        for number, (setup, _) in enumerate(setups):
            truth = truths.get(number) if number in moving else self._nominal_truth
            if truth is not None:
                found[number] = self._read(setup.sensors, truth)
        return found

    def _moves_as_nominal(self, setup: Setup) -> bool:
        """Whether it differs from the nominal setup in its sensors alone."""
        names = [one.name for one in fields(Setup) if one.name != "sensors"]
        return all(getattr(setup, name) is getattr(self._nominal, name) for name in names)

    @cached_property
    def _nominal_truth(self) -> HeldTruth | None:
        return self._run([(self._nominal, 0.0)])[0]

    def _read(self, sensors: tuple[Sensor, ...], truth: HeldTruth) -> np.ndarray:
        rng, parts = np.random.default_rng(0), {}  # ideal sensors draw nothing
        for sensor in sensors:
            table = sensor.measure(truth, rng)
            for name in sensor.channels():
                if name in self.record.channels:
                    parts[name] = self.record.framed(name, table[name].to_numpy(), sensor.rate)
        return np.stack([parts[name] for name in self.record.channels], axis=-1)


def _smooth(power: np.ndarray) -> np.ndarray:
    """Over three neighbouring frequencies."""
    padded = np.concatenate([power[:1], power, power[-1:]])
    return 0.25 * padded[:-2] + 0.5 * padded[1:-1] + 0.25 * padded[2:]
