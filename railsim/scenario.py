"""Scenario: everything that describes a run, read from YAML, checked before anything is simulated."""

import hashlib
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Annotated, Any, Self, get_args

import numpy as np
import pydantic

from railsim.contact.wheel import SLOWEST
from railsim.effects.interface import EFFECTS, Effect, Setup
from railsim.engines.interface import LONGEST_STEP, creep_rate, default_substeps
from railsim.errors import InputError
from railsim.model import Model
from railsim.overrides import override
from railsim.registry import Files, pick
from railsim.sensors.interface import Sensor
from railsim.sensors.suite import build_sensors
from railsim.settings import dump_yaml, load_yaml
from railsim.shown import html
from railsim.spec import Spec, quantity
from railsim.speed import Constant, Driven, Profile, SpeedTables, Traction
from railsim.track.files import TRACKS, read_track
from railsim.track.flexible import FlexibleTrack, check_support, longest_step
from railsim.track.survey import TrackErrors
from railsim.track.track import Track
from railsim.vehicles.interface import Vehicle
from railsim.vehicles.lookup import build_vehicle

CHOSEN = "scenario"
UNSTABLE = 2.7  # product of step and creep rate; the Runge-Kutta limit on the negative axis is 2.78
LONGEST_STABLE_STEP = 4.0 * LONGEST_STEP  # s; beyond it the wheelset's bounce on its contacts grows without bound


class Scenario(Spec, frozen=True):
    """A run: vehicle, track and speed, what is measured on the way, and the seed of every random number.

    `Scenario.build` takes what a YAML file holds (names of vehicles, kinds of sensors and speeds); the fields hold
    what these names stand for.
    """

    name: str = quantity("scenario", unit="-", source=CHOSEN, pattern=r"^[^/\\\n]+$")
    description: str = quantity("", unit="-", source=CHOSEN)
    track: str = quantity(unit="name of a shipped track, or path", source=CHOSEN)
    track_measured: bool = quantity(True, unit="whether the recording holds the track as measured", source=CHOSEN)
    track_errors: TrackErrors = quantity(TrackErrors(), unit="-", source=CHOSEN)
    vehicle: pydantic.SerializeAsAny[Vehicle] = quantity(unit="-", source=CHOSEN)
    flexible_track: FlexibleTrack | None = quantity(None, unit="-, {} takes its defaults", source=CHOSEN)
    effects: tuple[pydantic.SerializeAsAny[Effect], ...] = quantity((), unit="-", source=CHOSEN)
    sensors: tuple[pydantic.SerializeAsAny[Sensor], ...] = quantity((), unit="-", source=CHOSEN)
    speed: Constant | Profile | Driven = quantity(unit="m/s", source=CHOSEN)
    traction: tuple[Traction, ...] = quantity((), unit="N m or slip", source=CHOSEN)
    start: float = quantity(25.0, unit="m, distance of the bogie's centre at time 0", source=CHOSEN)
    duration: float = quantity(unit="s", source=CHOSEN, gt=0.0)
    output_rate: Annotated[float, pydantic.Field(le=100e3)] = quantity(1024.0, unit="Hz", source=CHOSEN, gt=0.0)
    substeps: int | None = quantity(None, unit="steps a row of truth; chosen if not given", source=CHOSEN, ge=1)
    seed: int = quantity(1, unit="-", source=CHOSEN, ge=0)

    @classmethod
    def build(cls, values: Any, where: str = "", *, elsewhere: bool = False) -> Self:
        """A checked scenario from names and numbers; one that runs `elsewhere` may have a track of its own that is too
        short.

        Raises
        ------
        InputError : one line that names the dotted key that is wrong, or what of the whole does not fit together.
        """
        if not isinstance(values, Mapping):
            raise InputError(f"{where or 'scenario'}: give keys and values, not {type(values).__name__}")
        given = dict(values)
        for key, resolve in _RESOLVERS.items():
            if key in given:
                given[key] = resolve(given[key])
        scenario = super().build(given, where)
        scenario.check(elsewhere=elsewhere)
        return scenario

    @property
    def vehicle_name(self) -> str:
        """Name of the vehicle: that of its module, or of the file that holds its parameters."""
        return self.vehicle.name

    @cached_property
    def geometry(self) -> Track:
        """The track as its file has it: what is surveyed, without what effects do to it."""
        return read_track(self.track)

    @cached_property
    def setup(self) -> Setup:
        """What is run: vehicle, track, sensors and speed with all effects.

        Raises
        ------
        InputError : an effect does not fit the scenario; the line begins with its place in the list.
        """
        setup = Setup(
            self.vehicle,
            self.geometry,
            self.sensors,
            self.speed,
            self.traction,
            self.duration,
            flexible_track=self.flexible_track,
        )
        for number, effect in enumerate(self.effects):
            try:
                setup = effect.install(setup)
            except InputError as error:
                raise InputError(f"effects.{number}: {error}") from None
        return setup

    @property
    def model(self) -> Model:
        """Bodies, elements and contacts of what is run."""
        return self.setup.model

    @property
    def speed_tables(self) -> SpeedTables:
        """Speed, torques and slides over time of what is run."""
        return self.setup.speed_tables

    @property
    def steps_a_row(self) -> int:
        """Integration steps between two rows of truth."""
        chosen = self.substeps or default_substeps(self.model, self.speed_tables, self.output_rate)
        finer = 1.0 / (self.output_rate * chosen * self.setup.longest_step)
        return chosen * 2 ** math.ceil(math.log2(max(finer, 1.0)))

    @property
    def step(self) -> float:
        """Integration step [s]."""
        return 1.0 / (self.output_rate * self.steps_a_row)

    @property
    def distance(self) -> float | None:
        """How far the run goes [m]; None where forces decide."""
        driven = self.setup.speed
        if isinstance(driven, Driven):
            return None
        time, speed = driven.knots(self.duration)
        inner = [t for t in time if 0.0 < t < self.duration]
        knots = np.array([0.0, *inner, self.duration])
        return float(np.trapezoid(np.interp(knots, time, speed), knots))

    @property
    def overhang(self) -> tuple[float, float]:
        """How far the rearmost and the foremost wheelset stand from the bogie's centre [m]; the first is negative."""
        places = [self.model.bodies[self.model.index(w.body)].position[0] for w in self.model.wheelsets]
        return min(places), max(places)

    def __eq__(self, other: object) -> bool:
        """Whether all fields are the same; what is kept of them (track, model) does not count."""
        return isinstance(other, Scenario) and self.values() == other.values()

    def _repr_html_(self) -> str:
        """What runs where, for notebooks."""
        sensors = ", ".join(f"{sensor.name} ({sensor.kind}, {sensor.rate:g} Hz)" for sensor in self.sensors)
        rows = [
            ("vehicle", self.vehicle_name), ("track", self.track), ("speed", self.speed.model_dump()["kind"]),
            ("start", f"{self.start:g} m"), ("duration", f"{self.duration:g} s"), ("seed", self.seed),
            ("sensors", sensors or "none"), ("effects", ", ".join(map(repr, self.effects)) or "none"),
        ]  # fmt: skip
        return html(f"Scenario {self.name}: {self.description}", ("what", "value"), rows)

    def __hash__(self) -> int:
        """Hash of the YAML text."""
        return hash(self.to_yaml())

    def check(self, *, elsewhere: bool = False) -> None:
        """Raise `InputError` where parts of the scenario do not fit together; `elsewhere` : as `build`."""
        self._check_wheelsets()
        self._check_sensors()
        self._check_step()
        self._check_support()
        if not elsewhere:
            self._check_track()

    def digest(self) -> str:
        """SHA-256 over all fields, with the track's contents in place of its name."""
        return digest_of(self.values() | {"track": self.geometry.digest()})

    def values(self) -> dict[str, Any]:
        """All fields as plain values that `build` reads."""
        plain = self.model_dump(mode="json")
        if self.flexible_track is None:
            del plain["flexible_track"]
        plain["vehicle"] = self.vehicle.settings()
        plain["sensors"] = [sensor.settings() for sensor in self.sensors]
        plain["effects"] = [effect.settings() for effect in self.effects]
        return plain

    def to_yaml(self, **changes: Any) -> str:
        """YAML of all fields, defaults included, with `changes` of plain values; `load_scenario` reads it."""
        return dump_yaml(self.values() | changes)

    def _check_wheelsets(self) -> None:
        count = len(self.model.wheelsets)
        for number, entry in enumerate(self.traction):
            if entry.wheelset > count:
                raise InputError(
                    f"traction.{number}.wheelset: {entry.wheelset}, but the vehicle has {count} wheelsets; "
                    f"give 1 to {count}"
                )

    def _check_sensors(self) -> None:
        bodies = [body.name for body in self.model.bodies]
        for sensor in self.sensors:
            if sensor.body not in bodies:
                known = ", ".join(bodies)
                raise InputError(f"sensors.{sensor.name}.body: no body '{sensor.body}'; the vehicle has {known}")
            ratio = self.output_rate / sensor.rate
            if abs(ratio - round(ratio)) > 1e-9 * ratio or ratio < 0.5:
                raise InputError(
                    f"sensors.{sensor.name}.rate: {sensor.rate:g} Hz does not divide output_rate "
                    f"({self.output_rate:g} Hz); use {_nearest_rate(self.output_rate, sensor.rate):g} Hz, "
                    "or change output_rate"
                )

    def _check_step(self) -> None:
        if self.substeps is None:
            return
        slowest = max(float(self.speed_tables.speed.min()), SLOWEST)
        limit = min(UNSTABLE / creep_rate(self.model, slowest), LONGEST_STABLE_STEP)
        if self.model.corunning is not None:
            limit = min(limit, longest_step(self.model.corunning))
        if self.step > limit:
            needed = int(np.ceil(1.0 / (self.output_rate * limit)))
            raise InputError(
                f"substeps: a step of {1e3 * self.step:.3g} ms is unstable for this vehicle at {slowest:g} m/s; "
                f"give at least {needed} or leave it out"
            )

    def _check_support(self) -> None:
        if self.model.corunning is not None:
            check_support(self.model.corunning, self.setup.track.stiffness)

    def _check_track(self) -> None:
        track, (behind, ahead) = self.setup.track, self.overhang
        first, last = float(track.s[0]), float(track.s[-1])
        if self.start + behind < first:
            raise InputError(
                f"start: {self.start:g} m puts the rear wheelset at {self.start + behind:g} m, before track "
                f"'{track.name}' begins ({first:g} m); start at {first - behind:g} m or later"
            )
        end = self.start + (self.distance or 0.0)
        if end + ahead > last:
            raise InputError(
                f"track: '{track.name}' ends at {last:.1f} m, but the run goes from {self.start:g} m to {end:.1f} m "
                f"and its front wheelset to {end + ahead:.1f} m; shorten duration to "
                f"{self._longest(last - ahead):.2f} s, drive slower or use a longer track"
            )

    def _longest(self, end: float) -> float:
        """Duration after which the bogie's centre is at `end` [m], rounded down to 10 ms."""
        time = np.linspace(0.0, self.duration, 20001)
        knots, speed = self.setup.speed.knots(self.duration)
        way = np.concatenate([[0.0], np.cumsum(np.interp(time[1:] - time[1] / 2, knots, speed) * time[1])])
        return max(0.0, np.floor(100.0 * float(np.interp(end - self.start, way, time)) - 0.5) / 100.0)


def load_scenario(
    source: str | Path, overrides: Mapping[str, Any] | Sequence[str] = (), *, elsewhere: bool = False
) -> Scenario:
    """Read a scenario.

    Parameters
    ----------
    source : name of a scenario that ships or is plugged in, or path of a YAML file.
    overrides : values by dotted key (`{"vehicle.body_mass": 18000}`), or texts as `--set` takes them
        (`["vehicle.body_mass=18000", "sensors.0.rate=512"]`); a number is a place in a list, from 0.
    elsewhere : whether it runs on another track, for example that of a recording; its own may be too short then.

    Raises
    ------
    InputError : no such file, not YAML, an unknown key, a value out of bounds, parts that do not fit together.
    """
    path, text = SCENARIOS.read(source)
    values = deepcopy(_read(text, f"'{path}'"))
    if not isinstance(values, dict) or not all(isinstance(key, str) for key in values):
        raise InputError(f"'{path}' is not a scenario: it must hold keys and values, for example 'track: smooth'")
    for key, value in _pairs(overrides):
        values = override(values, key, value)
    values.setdefault("name", path.stem)
    if isinstance(values.get("track"), str):
        values["track"] = _locate_track(values["track"], path.parent)
    if "vehicle" in values:
        values["vehicle"] = build_vehicle(values["vehicle"], path.parent)
    return Scenario.build(values, elsewhere=elsewhere)


@lru_cache(maxsize=8)
def _read(text: str, where: str) -> Any:
    """As `load_yaml`; a sweep reads the same scenario for every point."""
    return load_yaml(text, where)


SCENARIOS = Files("scenarios", "scenarios", ".yaml", "scenario")


def shipped_scenarios() -> list[str]:
    """Names of the scenarios that come with the program."""
    return list(SCENARIOS.shipped())


def described_scenarios() -> dict[str, str]:
    """What each scenario is about, by name; read without building its track and vehicle."""
    texts = {name: path.read_text(encoding="utf-8") for name, path in SCENARIOS.paths().items()}
    read = {name: load_yaml(text, f"'{name}'") for name, text in texts.items()}
    return {
        name: str(values.get("description", "") if isinstance(values, dict) else "") for name, values in read.items()
    }


def digest_of(values: Any) -> str:
    """SHA-256 over the canonical JSON of plain values."""
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()


def _pairs(overrides: Mapping[str, Any] | Sequence[str]) -> Iterable[tuple[str, Any]]:
    if isinstance(overrides, Mapping):
        return overrides.items()
    pairs = []
    for text in overrides:
        key, equals, value = text.partition("=")
        if not equals or not key.strip():
            raise InputError(f"--set {text}: write key=value, for example vehicle.body_mass=18000")
        pairs.append((key.strip(), load_yaml(value, f"--set {text}: the value")))
    return pairs


def _locate_track(given: str, folder: Path) -> str:
    """A name as it is; a path taken from the scenario's folder, or else from the working folder."""
    if given in TRACKS.paths():
        return given
    found = [path for path in (folder / given, Path(given)) if path.is_file()]
    return str(found[0].resolve()) if found else given


def _nearest_rate(output_rate: float, wanted: float) -> float:
    """The rate nearest to `wanted` that divides the other, in whole Hz where there is one."""
    rates = output_rate / np.arange(1.0, max(2.0, output_rate) + 1.0)
    whole = rates[rates == np.round(rates)]
    candidates = whole if whole.size else rates
    return float(candidates[np.argmin(np.abs(candidates - wanted))])


def _speed(given: Any) -> Any:
    kinds = {get_args(kind.model_fields["kind"].annotation)[0]: kind for kind in (Constant, Profile, Driven)}
    if isinstance(given, tuple(kinds.values())):
        return given
    if not isinstance(given, Mapping):
        raise InputError("speed: give for example {kind: constant, speed: 20}")
    return pick(kinds, str(given.get("kind", "constant")), "kind of speed").build(given, "speed")


def _traction(given: Any) -> Any:
    if not isinstance(given, list | tuple):
        raise InputError("traction: give a list, for example [{wheelset: 1, time: [0, 10], torque: [0, 2000]}]")
    return tuple(
        entry if isinstance(entry, Traction) else Traction.build(entry, f"traction.{number}")
        for number, entry in enumerate(given)
    )


def _sensors(given: Any) -> tuple[Sensor, ...]:
    if not isinstance(given, list | tuple):
        raise InputError("sensors: give a list, for example [{kind: gyro, name: bogie, body: bogie, rate: 256}]")
    return build_sensors(given)


def _effects(given: Any) -> tuple[Effect, ...]:
    if not isinstance(given, list | tuple):
        raise InputError("effects: give a list, for example [{kind: weak_lateral_damper, factor: 0.5}]")
    return tuple(_effect(entry, f"effects.{number}") for number, entry in enumerate(given))


def _effect(given: Any, where: str) -> Effect:
    if isinstance(given, Effect):
        return given
    values = {"kind": given} if isinstance(given, str) else dict(given) if isinstance(given, Mapping) else {}
    if not isinstance(values.get("kind"), str):
        raise InputError(f"{where}: an effect needs a kind; give one of: {', '.join(EFFECTS.classes())}")
    return EFFECTS.pick(values.pop("kind")).build(values, where)


_RESOLVERS = {
    "vehicle": build_vehicle,
    "speed": _speed,
    "traction": _traction,
    "sensors": _sensors,
    "effects": _effects,
}
