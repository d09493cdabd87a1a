"""Forward: what the sensors would give if the nominal model, a little off and with some effects, were true.

By the Verlet engine unless another is asked for. Nuisances are given as scores z: 0 = nominal, 1 = one standard
deviation of the prior.
"""

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from experiments.discrepancy.baseline.evidence import Evidence
from experiments.discrepancy.baseline.memory import MemoryTruth
from experiments.discrepancy.baseline.nuisances import Nuisance, most_of, nuisances_of
from railsim.dynamics.channels import channel_names
from railsim.effects.interface import Effect, Setup
from railsim.engines.interface import Run, default_substeps
from railsim.sensors.errors import SensorErrors, sample
from railsim.sensors.interface import Sensor
from railsim.simulation import load_engine
from railsim.speed import Profile
from railsim.track.ends import continued
from railsim.track.kernel import TrackTables, build_tables
from railsim.track.track import Track

OVERRUN = 50.0  # m that the measured track is continued straight at its ends, so that a shifted run stays on it
DEARER = {"fastsim": 2.0}  # what a run with a creep law costs, in runs with Polach's
Prediction = dict[str, np.ndarray]


@dataclass(frozen=True)
class Registration:
    """Where the recording's first sample was taken, and by how much the measured speed is off, both known roughly."""

    start: float
    scale: float = 1.0


class Meter:
    """Counts runs of the model, those with shorter steps for more: a measure of time that is the same everywhere."""

    def __init__(self) -> None:
        self.spent = 0.0
        self._lock = threading.Lock()

    def add(self, runs: float) -> None:
        """Count so many."""
        with self._lock:
            self.spent += runs


@dataclass(frozen=True)
class Forward:
    """Model, nuisances and registration of a recording; `track` in place of the measured one propagates its errors,
    `law` in place of the vehicle's creep law tells whether what is left is the law's.
    """

    evidence: Evidence
    registration: Registration
    track: Track
    engine: str = "verlet"
    law: str = ""
    meter: Meter = field(default_factory=Meter, compare=False)

    @cached_property
    def nuisances(self) -> tuple[Nuisance, ...]:
        """All nuisances, in the order of z."""
        e = self.evidence
        way = float(np.trapezoid(e.speed[1], e.speed[0]))
        return tuple(nuisances_of(e.scenario.vehicle, e.sensors, e.channels, e.speed[2], way))

    @cached_property
    def bounds(self) -> np.ndarray:
        """(2, n) least and largest score of each nuisance."""
        return np.array([(nuisance.least, nuisance.most) for nuisance in self.nuisances]).T

    @cached_property
    def ideal_sensors(self) -> tuple[Sensor, ...]:
        """The sensors with what shapes their signals and without anything random."""
        return tuple(sensor.but(errors=ideal(sensor.errors)) for sensor in self.evidence.sensors)

    def but(self, **changes: Any) -> "Forward":
        """A copy with another registration, track or engine."""
        return replace(self, **changes)

    def setup(self, z: np.ndarray, effects: Sequence[Effect] = ()) -> Setup:
        """What is run: nominal vehicle, measured track and speed, each moved by the nuisances; then the effects."""
        scenario = self.evidence.scenario
        setup = Setup(
            self._vehicle(z),
            self.track,
            self.ideal_sensors,
            self._speed(z),
            scenario.traction,
            self.evidence.duration,
            flexible_track=scenario.flexible_track,
        )
        for effect in (*scenario.effects, *effects):
            setup = effect.install(setup)
        return setup

    def run(self, z: np.ndarray, effects: Sequence[Effect] = ()) -> tuple[Setup, MemoryTruth]:
        """Integrate; raises `InputError` where an effect does not fit or the run leaves the rails."""
        setup = self.setup(z, effects)
        rate = self.evidence.scenario.output_rate
        substeps = default_substeps(setup.model, setup.speed_tables, rate)
        usual = substeps
        substeps *= 2 ** math.ceil(math.log2(max(1.0, 1.0 / (rate * substeps * setup.longest_step))))
        start = self.registration.start + self._value(z, "start.distance", additive=True)
        tables = self._tables if setup.track is self.track else build_tables(setup.track)
        run = Run(setup.model, tables, setup.speed_tables, start, setup.duration, rate, substeps)
        self.meter.add(substeps / usual * DEARER.get(self.law, 1.0))
        names = channel_names(setup.model)
        pieces = list(load_engine(self.engine)(run))
        about = {"vehicle": {"wheel_radius [m]": getattr(setup.vehicle, "wheel_radius", 0.5)}}
        return setup, MemoryTruth(names, pieces, rate, about)

    def observe(self, setup: Setup, truth: MemoryTruth, z: np.ndarray) -> Prediction:
        """Noise-free samples of every compared channel, with the sensors' nuisances."""
        found: Prediction = {}
        rng = np.random.default_rng(0)  # ideal sensors do not use it
        for sensor in setup.sensors:
            mounted = self._mounted(sensor, z)
            table = mounted.measure(truth, rng)
            for name in mounted.channels():
                if name in self.evidence.samples:
                    signal = table[name].to_numpy()
                    scale = 1.0 + self._value(z, f"scale.{name}", additive=True)
                    bias = self._value(z, f"bias.{name}", additive=True)
                    delay = self._value(z, f"latency.{name}", additive=True) * sensor.rate
                    signal = sample(signal, 1, delay) if delay > 0.0 else signal
                    found[name] = scale * signal + bias
        return found

    def predict(self, z: np.ndarray, effects: Sequence[Effect] = ()) -> Prediction:
        """Run and observe."""
        setup, truth = self.run(z, effects)
        return self.observe(setup, truth, z)

    @cached_property
    def _tables(self) -> TrackTables:
        return build_tables(self.track)

    @cached_property
    def _places(self) -> dict[str, int]:
        return {nuisance.label: number for number, nuisance in enumerate(self.nuisances)}

    def _value(self, z: np.ndarray, label: str, additive: bool = False) -> float:
        """std z, or the factor exp(std z); nothing where there is no such nuisance."""
        number = self._places.get(label)
        change = 0.0 if number is None else self.nuisances[number].std * float(z[number])
        return change if additive else math.exp(change)

    def _vehicle(self, z: np.ndarray) -> Any:
        vehicle = self.evidence.scenario.vehicle
        moved: dict[str, dict[str, Any]] = {"vehicle": {}, "pair": {}, "adhesion": {}}
        for nuisance in self.nuisances:
            if nuisance.kind in moved:
                owner = vehicle if nuisance.kind == "vehicle" else getattr(vehicle, nuisance.kind)
                value = getattr(owner, nuisance.name) * self._value(z, nuisance.label)
                moved[nuisance.kind][nuisance.name] = min(value, most_of(owner, nuisance.name))
        if self.law:
            moved["adhesion"]["law"] = self.law
        parts = {name: getattr(vehicle, name).but(**moved[name]) for name in ("pair", "adhesion") if moved[name]}
        return vehicle.but(**moved["vehicle"], **parts)

    def _speed(self, z: np.ndarray) -> Profile:
        time, speed, _ = self.evidence.speed
        scale = self.registration.scale * (1.0 + self._value(z, "speed.scale", additive=True))
        pieces = [n for n in self.nuisances if n.kind == "speed" and n.name == "wander"]
        wander = np.array([n.std * z[self._places[n.label]] for n in pieces])
        at = np.linspace(0.0, self.evidence.duration, len(pieces)) if pieces else np.zeros(1)
        slow = np.interp(time, at, wander) if pieces else 0.0
        values = np.clip(speed * scale * (1.0 + slow), 0.05, 119.0)
        return Profile(kind="profile", time=tuple(time.tolist()), speed=tuple(values.tolist()))

    def _mounted(self, sensor: Sensor, z: np.ndarray) -> Sensor:
        name = f"mounting.{sensor.name}.{sensor.kind}"
        turn = [self._value(z, f"{name}.{i}", additive=True) for i in range(3)]
        if not any(turn):
            return sensor
        angles = tuple(a + b for a, b in zip(sensor.errors.misalignment, turn, strict=True))
        return sensor.but(errors=sensor.errors.but(misalignment=angles))


def forward_over(evidence: Evidence, registration: Registration, law: str = "") -> Forward:
    """The nominal model over the track that the measured one lets expect."""
    return Forward(evidence, registration, continued(evidence.surveyed.expected, OVERRUN), law=law)


def ideal(errors: SensorErrors) -> SensorErrors:
    """Filter and latency only."""
    return SensorErrors(bandwidth=errors.bandwidth, bandwidth_order=errors.bandwidth_order, latency=errors.latency)
