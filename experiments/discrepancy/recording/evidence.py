"""What the workflow may see: the recording's measured folder and the nominal scenario. Never any truth."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from experiments.discrepancy.recording.samples import sampled
from experiments.discrepancy.recording.speed import MeasuredSpeed, measured_speed
from railsim.dynamics.channels import channel_names
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.model import Model
from railsim.recording import read_measurements
from railsim.scenario import Scenario
from railsim.sensors.displacement import Displacement
from railsim.sensors.interface import Sensor
from railsim.sensors.suite import build_sensor
from railsim.track.files import DISTANCE
from railsim.track.survey import TrackErrors
from railsim.track.track import UNITS, Track
from railsim.vehicles.half_vehicle import HalfVehicle
from railsim.vehicles.lookup import build_vehicle

KINDS = ("accelerometer", "gyro", "displacement")
"""Sensors whose samples are compared; others serve the registration only."""

MOST_AHEAD = 40.0  # m that a run may go beyond the measured track, which is continued there (`railsim.track.ends`)
SHORTEST = 12.0  # s; six sections of 2 s: less leaves nothing to hold out
USUAL_TRACK_ERRORS = TrackErrors(
    vertical_std=2e-4, lateral_std=2e-4, cross_level_std=3e-4, gauge_std=2e-4, curvature_std=2e-6
)
"""Where the recording does not state the track measurement's errors; illustrative."""
TRACK_MAKERS = "track_smoother, alignment_lateral or cross_level"


class GivenTrack(NamedTuple):
    """A track in place of the recording's own (None: its own), its errors (None: those that the recording states), and
    whether it is an estimate, whose errors are what it leaves open.
    """

    track: Track | None = None
    errors: TrackErrors | None = None
    estimated: bool = False


NO_TRACK = GivenTrack()


@dataclass(frozen=True)
class Evidence:
    """Measured channels that are compared, the sensors that gave them, the measured track and the nominal scenario.

    Attributes
    ----------
    channels : names, in the order of `sensors`. samples : channel to (n,) values with NaN where lost.
    rates : channel to Hz; all divide the model's. sensors : as their data sheets say, without hidden errors.
    track : as measured. track_errors : standard deviations of the track's rows. track_estimated : the track is an
    estimate, whose errors are what it leaves open. speed : by tachometer, satellite receiver or scenario.
    left_out : channels that are not used, with the reason.
    slowest : Hz, of the slowest channel as it was measured.
    """

    scenario: Scenario
    channels: tuple[str, ...]
    samples: dict[str, np.ndarray]
    rates: dict[str, float]
    sensors: tuple[Sensor, ...]
    track: Track
    track_errors: TrackErrors
    track_errors_stated: bool
    speed: MeasuredSpeed
    left_out: tuple[str, ...]
    slowest: float = math.inf
    track_estimated: bool = False

    @property
    def duration(self) -> float:
        """Length of the recording [s]."""
        return min(len(self.samples[name]) / self.rates[name] for name in self.channels)


def gather(recording: Path | str, scenario: Scenario, given: GivenTrack = NO_TRACK) -> Evidence:
    """Read the measured part of a recording: `evidence_of` it."""
    return evidence_of(read_measurements(recording), scenario, given, str(recording))


def evidence_of(
    measured: Measurements, scenario: Scenario, given: GivenTrack = NO_TRACK, recording: str = "recording"
) -> Evidence:
    """What of a recording is compared; a track that is given takes the place of the recording's own.

    Raises
    ------
    InputError : the model has no bogie; the recording is too short, has no channel that the model can predict, no
        measured track or no speed, or the vehicle stands.
    """
    if "bogie" not in (body.name for body in scenario.model.bodies):
        raise InputError(
            f"vehicle '{scenario.vehicle.name}' has no bogie; "
            "give a scenario of half a vehicle or of a whole one, as default or whole_coach"
        )
    sensors, unknown = _sensors(measured, scenario)
    found = sampled(measured, sensors, scenario.output_rate)
    if not found.values:
        why = f" ({found.left_out[0]}; {len(found.left_out)} such)" if found.left_out else ""
        raise InputError(
            f"'{recording}' has no channel of {', '.join(KINDS)} that can be compared with a model{why}; "
            "add such sensors, or state them in about.json"
        )
    if found.duration < SHORTEST:
        raise InputError(
            f"the recording is {found.duration:.1f} s long, too short to be judged; give {SHORTEST:g} s or more"
        )
    surveyed = given.track or _track(measured)
    stated = measured.about.get("track", {}).get("errors")
    errors = given.errors or USUAL_TRACK_ERRORS
    if stated and given.errors is None:
        errors = TrackErrors.build(stated, "about.json: track.errors")
    speed = measured_speed(measured, scenario, found.duration, found.begin)
    _check_reach(surveyed, scenario, speed)
    channels = tuple(name for sensor in sensors for name in sensor.channels() if name in found.values)
    return Evidence(
        scenario=scenario,
        channels=channels,
        samples={name: found.values[name] for name in channels},
        rates={name: found.rates[name] for name in channels},
        sensors=tuple(_at_rate(s, found.rates) for s in sensors if any(name in channels for name in s.channels())),
        track=surveyed,
        track_errors=errors,
        track_errors_stated=stated is not None or given.errors is not None,
        speed=speed,
        left_out=(*unknown, *found.left_out),
        slowest=found.slowest,
        track_estimated=given.estimated,
    )


def _at_rate(sensor: Sensor, rates: dict[str, float]) -> Sensor:
    """The sensor at the rate of the grid that its channels were brought on."""
    return sensor.but(rate=next(rates[name] for name in sensor.channels() if name in rates))


def _check_reach(track: Track, scenario: Scenario, speed: MeasuredSpeed) -> None:
    """Raise `InputError` where the measured track does not reach along the whole run."""
    way = float(np.trapezoid(speed.speed, speed.time))
    rear, front = scenario.overhang
    first, last = scenario.start + rear, scenario.start + way + front
    if first < track.s[0] - MOST_AHEAD or last > track.s[-1] + MOST_AHEAD:
        raise InputError(
            f"the measured track holds {track.s[0]:.0f} to {track.s[-1]:.0f} m, "
            f"the run needs {first:.0f} to {last:.0f} m; "
            "give the track of this section, or correct 'start' of the scenario"
        )


def _sensors(measured: Measurements, scenario: Scenario) -> tuple[list[Sensor], tuple[str, ...]]:
    """Sensors that the model can stand for, and the names of those that it cannot, with the reason."""
    found: list[Sensor] = []
    left_out: list[str] = []
    ahead = _ahead(measured.vehicle, scenario)
    for sheet in measured.about["sensors"]:
        if sheet.get("kind") not in KINDS:
            continue
        settings: dict[str, Any] = {key: value for key, value in sheet.items() if key != "channels"}
        try:
            sensor = build_sensor(settings, "about.json: sensors")
        except InputError as error:
            left_out.append(f"{sheet['name']}: {error}")
            continue
        if why := _missing(sensor, scenario.model):
            left_out.append(f"{sensor.name}: {why}")
            continue
        x, y, z = sensor.position
        found.append(sensor.but(position=(x + ahead, y, z)) if sensor.body == "body" else sensor)
    return found, tuple(left_out)


def _missing(sensor: Sensor, model: Model) -> str | None:
    """What the model lacks of that on which the sensor is mounted: the other bogie of half a vehicle. None: nothing."""
    bodies = [body.name for body in model.bodies]
    if sensor.body not in bodies:
        return f"the model has no body '{sensor.body}'; it has {', '.join(bodies)}"
    if isinstance(sensor, Displacement) and sensor.channel not in channel_names(model):
        return f"the model has no element '{sensor.element}'"
    return None


def _ahead(stated: Mapping[str, Any], scenario: Scenario) -> float:
    """How far the body's centre of the recording's vehicle is ahead of that of the nominal one [m]: half a body stands
    over its bogie, a whole one halfway between two. Positions of sensors count from there.
    """
    try:
        half = isinstance(build_vehicle(stated.get("name")), HalfVehicle)
    except InputError:  # a vehicle that is not at hand
        return 0.0
    if half == isinstance(scenario.vehicle, HalfVehicle):
        return 0.0
    spacing = "semi_bogie_spacing"
    return float(getattr(scenario.vehicle, spacing, 0.0) if half else -stated.get(spacing, 0.0))


def _track(measured: Measurements) -> Track:
    table = measured.track
    if table is None:
        raise InputError(
            "the recording has no track.csv, so nothing says what the track did; give --track FILE or --track ESTIMATE "
            f"of another recording of this line, as the estimators {TRACK_MAKERS} make"
        )
    names = {f"{key} [{unit}]": key for key, unit in UNITS.items()}
    columns = {names[title]: table[title].to_numpy(float) for title in table.columns if title in names}
    return Track(table[DISTANCE].to_numpy(float), columns, "measured")
