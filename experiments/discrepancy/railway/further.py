"""Which further recording would tell apart what a verdict could not: with one more sensor, at another speed, laden,
over another track. The vehicle as it was fitted is what would be recorded.
"""

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from experiments.discrepancy.core.levels import middles
from experiments.discrepancy.core.model import Effect, Fit, OneByOne
from experiments.discrepancy.core.next_measurement import Saving, savings
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.verdict import Verdict
from experiments.discrepancy.railway.build import along_coordinates
from experiments.discrepancy.railway.cases import as_measured
from experiments.discrepancy.railway.makers import Maker
from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.scales import SCALES
from experiments.discrepancy.railway.system import Railway
from experiments.discrepancy.recording.evidence import KINDS, evidence_of
from railsim.effects.payload import Payload
from railsim.errors import InputError
from railsim.scenario import Scenario, load_scenario, shipped_scenarios
from railsim.sensors.interface import Sensor

LONGEST = 20.0  # s of a recording that is thought of
SPEEDS = (0.75, 1.25)  # of the speed
LOAD = 3000.0  # kg
TRACK = "straight_erri_high"  # rougher than most
MOST_RATE = 512.0  # Hz, of a further sensor


def further(
    verdict: Verdict,
    options: Iterable[tuple[str, "Railway | Part"]],
    rng: np.random.Generator,
    end: float,
    say: Callable[[str], None],
) -> list[Saving]:
    """What each further recording would save of the expected loss, the best first; those alone that are begun before
    `end` of time.monotonic().
    """
    found: list[Saving] = []
    for name, one in options:
        say(f"further recording: {name}")
        with suppress(InputError):
            rows = tuple(replace(row, fit=carried(row.fit, one)) for row in verdict.rows)
            found += savings(replace(verdict, rows=rows), {name: one}, Policy(), rng)
        if time.monotonic() > end:
            break
    return sorted(found, key=lambda one: one.after)


def options(record: Record, installed: Mapping[str, Maker]) -> Iterator[tuple[str, "Railway | Part"]]:
    """Further recordings by name, as systems; each is made when it is asked for."""
    scenario = record.scenario
    try:
        own = scenario.but(sensors=tuple(record.evidence.sensors), duration=min(LONGEST, scenario.duration))
    except InputError:  # the nominal scenario's own track is too short for its vehicle
        return
    with suppress(InputError):
        yield "the same again", _recorded(own, installed)
    taken = _together(own)
    if taken:
        with suppress(InputError):
            whole = _recorded(own.but(sensors=(*own.sensors, *taken)), installed)
            for sensor in taken:
                names = {name for one in (*own.sensors, sensor) for name in one.channels()}
                axes = ", ".join(name.partition(" [")[0].rpartition(".")[2] for name in sensor.channels())
                yield f"{sensor.kind} {sensor.name} ({axes}) besides", Part(whole, names)
    load = Payload.build({"mass": LOAD})
    changes: list[tuple[str, dict[str, Any]]] = [
        (f"laden with {LOAD:.0f} kg", {"effects": [*own.values()["effects"], load.settings()]}),
        (f"over {TRACK}", {"track": TRACK, "start": 30.0}),
    ]
    values = own.speed.model_dump(mode="json")
    if "speed" in values:
        speeds = np.array(values["speed"])
        changes += [(f"at {share:g} times the speed", {"speed": values | {"speed": (share * speeds).tolist()}})
                    for share in SPEEDS]  # fmt: skip
    for name, change in changes:
        with suppress(InputError):
            yield name, _recorded(Scenario.build(own.values() | change), installed)


def _recorded(scenario: Scenario, installed: Mapping[str, Maker]) -> Railway:
    """A recording of the nominal vehicle as a system."""
    record = Record(evidence_of(as_measured(scenario, scenario, "compiled"), scenario))
    return Railway(record, SCALES, installed)


def further_sensors(scenario: Scenario) -> list[Sensor]:
    """Sensors of the shipped scenarios that this vehicle can have and does not have."""
    have = {name for sensor in scenario.sensors for name in sensor.channels()}
    found: dict[tuple[str, ...], Sensor] = {}
    for name in shipped_scenarios():
        for sensor in load_scenario(name).sensors:
            new = tuple(channel for channel in sensor.channels() if channel not in have)
            if sensor.kind not in KINDS or not new or new in found:
                continue
            slower = sensor.but(rate=min(sensor.rate, MOST_RATE))
            with suppress(InputError):
                scenario.but(sensors=(slower,)).check()
                found[new] = slower
    return list(found.values())


def _together(scenario: Scenario) -> list[Sensor]:
    """Of those, such that no channel and no name comes twice."""
    taken: list[Sensor] = []
    for sensor in further_sensors(scenario):
        have = (*scenario.sensors, *taken)
        names = {name for one in have for name in one.channels()}
        if names & set(sensor.channels()):
            continue
        if any((one.kind, one.name) == (sensor.kind, sensor.name) for one in have):
            taken.append(sensor.but(name=f"{sensor.name}_further"))
        else:
            taken.append(sensor)
    return taken


def carried(fit: Fit, system: "Railway | Part") -> Fit:
    """A fit as what is known of another recording of the same vehicle: coordinates by their names; where the run lies
    on the track is not known again.
    """
    alone = {one.name for one in along_coordinates(system.record)}
    before, after = fit.system.coordinates, system.coordinates
    places = {one.name: place for place, one in enumerate(before) if one.name not in alone}
    own = list(range(len(before), len(fit.x)))
    shared = [places[one.name] for one in after if one.name in places] + own
    here = [place for place, one in enumerate(after) if one.name in places]
    here += list(range(len(after), len(after) + len(own)))
    priors = fit.hypothesis.coordinates(after)
    x, precision = np.array([one.mean for one in priors]), np.diag([one.spread**-2.0 for one in priors])
    x[here] = fit.x[shared]
    precision[np.ix_(here, here)] = np.linalg.inv(np.linalg.inv(fit.precision)[np.ix_(shared, shared)])
    levels = dict(zip([one.name for one in fit.system.levels], fit.psi, strict=True))
    middle = zip(system.levels, middles(system.levels), strict=True)
    psi = np.array([levels.get(one.name, value) for one, value in middle])
    return replace(fit.light(), system=system, x=x, psi=psi, precision=precision)


@dataclass(eq=False)
class Part(OneByOne):
    """A system of which some channels alone are recorded; parts of one whole share its runs."""

    whole: Railway
    names: set[str]

    @property
    def record(self) -> Record:
        """Of the whole."""
        return self.whole.record

    @property
    def coordinates(self) -> tuple[Any, ...]:
        """Of the whole."""
        return self.whole.coordinates

    @property
    def levels(self) -> tuple[Any, ...]:
        """Of the whole."""
        return self.whole.levels

    @property
    def _channels(self) -> list[int]:
        return [place for place, name in enumerate(self.whole.record.channels) if name in self.names]

    def _of(self, parts: Sequence[np.ndarray]) -> tuple[np.ndarray, ...]:
        return tuple(one[..., self._channels] for one in parts)

    @property
    def observed(self) -> tuple[np.ndarray, ...]:
        """In these channels."""
        return self._of(self.whole.observed)

    def starts(self) -> np.ndarray:
        """Of the whole."""
        return self.whole.starts()

    def predict(self, points: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """In these channels."""
        runs = self.whole.kept.setdefault("predicted", {})
        key = (self.whole.survey, points.tobytes(), tuple(one.name for one in effects))
        if key not in runs:
            runs[key] = self.whole.predict(points, effects)
        return self._of(runs[key])

    def covariances(self, x: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        """In these channels."""
        return self._of([np.swapaxes(one, -1, -2)[..., self._channels].swapaxes(-1, -2)
                         for one in self.whole.covariances(x, effects)])  # fmt: skip

    def about(self, x: np.ndarray, effects: tuple[Effect, ...], psi: np.ndarray | None) -> "Part":
        """Of the whole about there."""
        return Part(self.whole.about(x, effects, psi), self.names)
