"""Runs of a vehicle over one track, read by the sensors of a record as they should be."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from experiments.discrepancy.railway.answers import needed
from experiments.discrepancy.railway.build import setup_at, turns
from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.runs import run_all
from experiments.discrepancy.railway.together import Together
from railsim.dynamics.channels import channel_names
from railsim.effects.interface import Effect, Setup
from railsim.engines.interface import LONGEST_STEP, Run, default_substeps
from railsim.sensors.interface import Sensor
from railsim.track.kernel import TrackTables, build_tables
from railsim.track.track import Track
from railsim.truth import HeldTruth

READ = ("y [m]", "yaw [rad]", "spin", "specific_force", "angular_")
"""Beginnings of channels of a body that sensors read."""
ERRS = 0.03  # of what a channel shows at a frequency: by so much any model of a vehicle errs; illustrative
SLIGHT = 2.0  # nats that a longer step may change the predictions by: odds of seven; illustrative
ROOM = 2**30  # bytes of all tasks that go on at once
TASKS = 12  # of them at most
BUILT, COPIES, LEVELS = 50, 3, 4  # coordinates but for three a channel; of slopes; levels a channel, over the frames


@dataclass(frozen=True, eq=False)
class Shown:
    """Of one run: `read` (F, frames, components) by the ideal sensors, `acting` (F, frames) of each channel of truth
    that latent forces are relative to.
    """

    read: np.ndarray
    acting: dict[str, np.ndarray]


def together_for(record: Record) -> Together:
    """A place where runs for a record are asked for; they keep what its sensors and places read."""
    model = record.scenario.model
    needs, bodies, names = needed(model), {one.body for one in record.ideal}, channel_names(model)
    read = tuple(f"{body}.{quantity}" for body in bodies for quantity in READ)
    wanted = [n for n in names if n.startswith(read) or n in needs or n.endswith("displacement [m]")]
    wanted += [n for n in names if n.startswith(("speed", "acceleration"))]
    about: dict[str, object] = {"vehicle": {"wheel_radius [m]": model.wheelsets[0].radius}}
    channels, values = len(record.channels), record.seen.nbytes
    each = values * (COPIES * (BUILT + 3 * channels) + LEVELS * channels)
    return Together(lambda runs: run_all(runs, about, wanted), min(TASKS, max(2, round(ROOM / each))))


def simulated_over(record: Record, track: Track, together: Together, kept: dict[object, Any]) -> "Simulated":
    """The vehicle over a track, with twice the usual step where the frames hardly tell it from the usual one; `kept`:
    what is shared, for one step serves all runs.
    """
    usual = Simulated(record, track, together)
    if "step" not in kept:
        fine, coarse = (one.channels([(one.nominal, 0.0)])[0] for one in (usual, replace(usual, step=2.0 * usual.step)))
        errors = ERRS**2 * np.mean(np.abs(fine) ** 2, axis=1, keepdims=True) + record.densities
        nats = 0.5 * float(np.sum(np.abs(coarse - fine) ** 2 / errors))
        kept["step"] = 2.0 * usual.step if nats < SLIGHT else usual.step
    return replace(usual, step=kept["step"])


@dataclass(frozen=True, eq=False)
class Simulated:
    """A record's vehicle over a track. A run is asked for by its setup and by how far ahead of the registered start it
    begins [m]. `step`: longest one [s].
    """

    record: Record
    track: Track
    together: Together
    step: float = LONGEST_STEP

    @cached_property
    def nominal(self) -> Setup:
        """The nominal setup."""
        return self.setup({}, ())

    @cached_property
    def nominal_truth(self) -> HeldTruth | None:
        """A run of the nominal setup."""
        found: list[HeldTruth] = []
        self.visit([(self.nominal, 0.0)], lambda _, truth: found.append(truth))
        return found[0] if found else None

    @cached_property
    def turns(self) -> tuple[list[str], np.ndarray]:
        """Components that the ideal sensors show, and what the channels are of them, see `build.turns`."""
        return turns(self.record)

    def setup(self, values: Mapping[str, float], effects: tuple[Effect, ...]) -> Setup:
        """With these coordinates and effects; raises `InputError` where an effect does not fit."""
        return setup_at(self.record, self.track, values, effects)

    def shown(self, setup: Setup, ahead: float) -> Shown | None:
        """Of one run; None where it fails."""
        found: list[Shown] = []

        def visit(_: int, truth: HeldTruth) -> None:
            acting = {n: self.record.modelled(truth[n], truth.rate) for n in needed(self.nominal.model) if n in truth}
            found.append(Shown(self.read(setup.sensors, truth), acting))

        self.visit([(setup, ahead)], visit)
        return found[0] if found else None

    def outputs(self, setups: Sequence[tuple[Setup, float]]) -> np.ndarray:
        """(setups, F, frames, components) of what the ideal sensors show; not finite where a run fails."""
        found = np.full((len(setups), *self.record.seen.shape[:2], len(self.turns[0])), np.nan + 0j)
        still = [ahead == 0.0 and self._moves_as_nominal(one) for one, ahead in setups]
        moving = [number for number, one in enumerate(still) if not one]

        def visit(place: int, truth: HeldTruth) -> None:
            found[moving[place]] = self.read(setups[moving[place]][0].sensors, truth)

        self.visit([setups[number] for number in moving], visit)
        for number in (number for number, one in enumerate(still) if one):
            if self.nominal_truth is not None:
                found[number] = self.read(setups[number][0].sensors, self.nominal_truth)
        return found

    def channels(self, setups: Sequence[tuple[Setup, float]]) -> np.ndarray:
        """(setups, F, frames, channels) of sensors as they should be."""
        return self.outputs(setups) @ self.turns[1][0].T

    def read(self, sensors: tuple[Sensor, ...], truth: HeldTruth) -> np.ndarray:
        """(F, frames, components) of a run."""
        rng, parts = np.random.default_rng(0), {}  # ideal sensors draw nothing
        for sensor in sensors:
            table = sensor.measure(truth, rng)
            for name in sensor.channels():
                parts[name] = self.record.modelled(table[name].to_numpy(), sensor.rate)
        return np.stack([parts[name] for name in self.turns[0]], axis=-1)

    def visit(self, setups: Sequence[tuple[Setup, float]], visit: Callable[[int, HeldTruth], None]) -> None:
        """Tell places and truths of the runs that do not fail, in any order."""
        runs, numbers = [], []
        for number, (setup, ahead) in enumerate(setups):
            if not math.isfinite(ahead) or not _can_be_built(setup):
                continue
            rate = self.record.scenario.output_rate
            sub = default_substeps(setup.model, setup.speed_tables, rate, self.step)
            sub *= 2 ** math.ceil(math.log2(max(1.0, 1.0 / (rate * sub * setup.longest_step))))
            tables = self._tables if setup.track is self.track else build_tables(setup.track)
            start = self.record.registration.start + ahead
            runs.append(Run(setup.model, tables, setup.speed_tables, start, setup.duration, rate, sub))
            numbers.append(number)
        self.together.ask(runs, lambda place, truth: None if truth is None else visit(numbers[place], truth))

    @cached_property
    def _tables(self) -> TrackTables:
        return build_tables(self.track)

    def _moves_as_nominal(self, setup: Setup) -> bool:
        """Whether it differs from the nominal setup in its sensors alone."""
        names = [one.name for one in fields(Setup) if one.name != "sensors"]
        return all(getattr(setup, name) is getattr(self.nominal, name) for name in names)


def _can_be_built(setup: Setup) -> bool:
    """Whether there is such a vehicle; a step of a search may end where a wheel does not fit its rail any more."""
    try:
        return setup.model is not None
    except ValueError:
        return False
