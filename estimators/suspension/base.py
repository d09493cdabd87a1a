"""What all suspension estimators share: settings, the model's assumptions, and the likelihood of parameters."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import ClassVar, Literal

import numpy as np

from estimators.filters.track_spectrum import ERRI_LATERAL, ERRI_VERTICAL, TrackSpectrum
from estimators.interface import Estimator, Missing
from estimators.speed.odometry import missing_speed
from estimators.suspension.discrete_model import Layout, Unknowns, layout, shaped
from estimators.suspension.filter_bank import Gains, exact, gains, run_filters, sizes, unpacked
from estimators.suspension.observations import NO_PLACE, SuspensionRecord, can_locate, read
from estimators.vehicle.affine import (
    COORDINATES,
    FULL,
    STATES,
    WITHOUT_WHEELSETS,
    HalfVehicle,
    half_vehicle,
    nominal,
)
from estimators.vehicle.creep import DRY_ROLLING
from estimators.vehicle.lateral_frequency import is_whole
from estimators.vehicle.lateral_roll import NEEDED
from estimators.vehicle.parameters import numbers
from railsim.measurements import Measurements
from railsim.spec import quantity
from railsim.track.spectra import WC, WS

ILLUSTRATIVE = "illustrative"
ROLL = TrackSpectrum(ERRI_VERTICAL.amplitude / 0.75**2, 0, (WS, WC))
"""Roll of the track, rad: ERRI's cross level over the gauge, without what takes waves longer than 300 m out of it."""
STRETCH = 1.0  # s; parameters stay constant for so long
SHORT = 0.125  # s, the same at first, when every sample tells much
BEGINNING = 8.0  # s
SETTLE = 3.0  # s; the filters' start is forgotten, no likelihood is counted
SPEED_BIN = 0.02  # relative; filters are those of the nearest speed
SLOWEST = 5.0  # m/s; below, the creep model is not used
LEAST_FORCE = 1e-3
HALF = "half a vehicle, while about.json gives a whole one: use suspension_spectral, which models whole vehicles"
"""What is missing where a vehicle is whole."""
TUNED = 256.0  # Hz; rate to which the errors of a sample belong
Track = Literal["exact", "uncertain", "unknown"]
Situation = tuple[int, tuple[int, ...]]
"""Bin of the speed, and which readings are used."""
System = tuple[HalfVehicle, float, Unknowns, Layout]


@dataclass
class Problem:
    """A recording, ready for the filters.

    Attributes
    ----------
    record : readings and track on a grid.
    vehicle : nominal parameters. settings : of the estimator.
    low, high : box of the parameters, shape (3,). nominal : as built, shape (3,).
    """

    record: SuspensionRecord
    vehicle: dict[str, float]
    settings: "SuspensionEstimator"
    low: np.ndarray
    high: np.ndarray
    nominal: np.ndarray
    _tables: dict[Situation, Gains] = field(default_factory=dict)
    _shaped: dict[Situation, np.ndarray] = field(default_factory=dict)
    _systems: dict[tuple[Situation, int], System] = field(default_factory=dict)

    @property
    def stretches(self) -> list[tuple[int, int]]:
        """First sample and the one after the last of every stretch of constant parameters."""
        rate, count = self.record.rate, len(self.record.time)
        first = np.arange(0, min(count, round(BEGINNING * rate)), max(1, round(SHORT * rate)))
        later = np.arange(round(BEGINNING * rate), count, max(1, round(STRETCH * rate)))
        edges = [*first.tolist(), *later.tolist(), count]
        return list(zip(edges[:-1], edges[1:], strict=True))

    @property
    def trust(self) -> float:
        """Share of independent samples: what passed the low-pass changes more slowly than it is sampled."""
        return min(1.0, 2.0 * self.settings.low_pass / self.record.rate)

    def situation(self, first: int, last: int) -> Situation | None:
        """Bin of the speed and the readings that are good throughout; None where nothing can be estimated."""
        speed = self.record.speed[first:last]
        used = tuple(int(j) for j in np.flatnonzero(self.record.good[first:last].all(axis=0)))
        if not used or not np.isfinite(speed).all() or float(speed.min()) < SLOWEST:
            return None
        return round(float(np.log(speed.mean())) / SPEED_BIN), used

    def system(self, situation: Situation, every: int = 1) -> System:
        """Vehicle, speed, unknowns and layout of the state for steps of `every` samples, kept."""
        if (situation, every) not in self._systems:
            self._systems[situation, every] = self._system(situation, self.record.rate / every)
        return self._systems[situation, every]

    def _system(self, situation: Situation, rate: float) -> System:
        speed, used = float(np.exp(situation[0] * SPEED_BIN)), list(situation[1])
        settings, names = self.settings, [self.record.channels[j] for j in used]
        unknowns = settings.unknowns(self.vehicle, names, self.record.noise[used], self.record.rate)
        plan = layout(2.0 * self.vehicle["semi_wheelbase"], speed, rate, unknowns)
        return half_vehicle(self.vehicle, speed, names, settings.creep), speed, unknowns, plan

    def table(self, situation: Situation) -> Gains:
        """Filters over the box of parameters, kept."""
        if situation not in self._tables:
            vehicle, speed, unknowns, plan = self.system(situation)
            box = self.low, self.high
            self._tables[situation] = gains(vehicle, speed, self.record.rate, unknowns, plan, *box)
        return self._tables[situation]

    def shaped(self, situation: Situation) -> np.ndarray:
        """Transition of the shaped noise, kept."""
        if situation not in self._shaped:
            _, speed, unknowns, plan = self.system(situation)
            self._shaped[situation] = shaped(speed, self.record.rate, unknowns, plan)
        return self._shaped[situation]

    def samples(self, first: int, last: int, used: Sequence[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Known track, the same a sample later, and the readings of a stretch."""
        record, part = self.record, slice(first, last)
        return record.inputs[part], record.later[part], np.ascontiguousarray(record.readings[part][:, list(used)])

    def likelihood(self, parameters: np.ndarray, interpolated: bool = True) -> np.ndarray:
        """Logarithm of the whole record's likelihood of some constant parameters (p, 3), shape (p,)."""
        filters = FilterBank(self, len(parameters))
        total = np.zeros(len(parameters))
        for first, last in self.stretches:
            situation = self.situation(first, last)
            if situation is None:
                filters.reset()
                continue
            vehicle = self.system(situation)
            packed = (
                self.table(situation).at(parameters)
                if interpolated
                else exact(*vehicle[:2], self.record.rate, *vehicle[2:], parameters)
            )
            total += filters.run(situation, vehicle[3], packed, first, last)
        return total


class FilterBank:
    """States of the filters of some particles.

    Parameters
    ----------
    problem : what they run on.
    count : of particles.
    """

    def __init__(self, problem: Problem, count: int) -> None:
        self._problem, self._count = problem, count
        self.state = np.zeros((count, STATES))
        self._since = 0.0

    def reset(self) -> None:
        """Start again at rest: there was a gap, or the vehicle was slow."""
        self.state[:] = 0.0
        self._since = 0.0

    def select(self, ancestors: np.ndarray) -> None:
        """Put the states of the ancestors, indices (p,), in the places of the particles."""
        self.state = self.state[ancestors]

    def run(
        self, situation: Situation, plan: Layout, packed: np.ndarray, first: int, last: int, again: bool = False
    ) -> np.ndarray:
        """Logarithm of the likelihood of a stretch, (p,); zero until the start is forgotten. `again`: as before."""
        if self.state.shape[1] != plan.size:
            state = np.zeros((self._count, plan.size))
            same = min(plan.size, self.state.shape[1])
            state[:, :same] = self.state[:, :same]
            self.state = state
        inputs, later, readings = self._problem.samples(first, last, situation[1])
        count, known = readings.shape[1], inputs.shape[1]
        log_likelihood, work = np.zeros(self._count), np.zeros((3, max(sizes(plan, known, count))))
        run_filters(
            self.state,
            *unpacked(packed, plan, known, count),
            plan.columns,
            np.array(plan.sources, dtype=np.int64),
            plan.length,
            self._problem.shaped(situation),
            inputs,
            later,
            readings,
            log_likelihood,
            work,
        )
        self._since += 0.0 if again else (last - first) / self._problem.record.rate
        return log_likelihood if self._since > SETTLE else np.zeros(self._count)


class SuspensionSettings(Estimator, frozen=True):
    """What is read of a recording, and what no model of it holds: of all suspension estimators."""

    wheelset_sensors: bool = quantity(True, unit="-", source="Ward et al. 2011, section 4.1: with and without")
    creep: tuple[float, float, float] = quantity(
        DRY_ROLLING,
        unit="- of Kalker's f11, f22, f23",
        source="Polach's law (2005), dry, rolling on a contact angle of 0.06 rad with creepages of 2e-4 to 8e-4: "
        "statistical linearisation (docs/suspension.md); spin is not reduced by kA and kS",
    )
    start: float | None = quantity(None, unit="m, distance at the first sample; else by GNSS", source="recording")
    high_pass: float = quantity(0.15, unit="Hz", source="a fifth of the body's lateral mode", gt=0.0)
    low_pass: float = quantity(8.0, unit="Hz", source="suspension.yaml; the model is not trusted beyond", gt=0.0)
    track_error: float = quantity(
        0.05, unit="- power of the error of track.csv over ERRI B176 low", source=ILLUSTRATIVE, gt=0.0
    )
    track_level: float = quantity(1.0, unit="- of ERRI B176 low", source="assumed where the track is unknown", gt=0.0)
    wheelset_force: float = quantity(
        40.0, unit="N/sqrt(Hz)", source="what this model leaves of the forces of suspension.yaml's run", ge=0.0
    )
    wheelset_moment: float = quantity(70.0, unit="N m/sqrt(Hz)", source="likewise", ge=0.0)
    bogie_force: float = quantity(3.0, unit="N/sqrt(Hz)", source="likewise, 2 to 8 N in the band", ge=0.0)
    body_force: float = quantity(2.0, unit="N/sqrt(Hz)", source="likewise", ge=0.0)
    wheelset_error: float = quantity(0.1, unit="m/s2, each sample", source="chosen on suspension.yaml", gt=0.0)
    bogie_error: float = quantity(0.01, unit="m/s2, each sample", source="the same", gt=0.0)
    body_error: float = quantity(0.003, unit="m/s2, each sample", source="the same", gt=0.0)
    rate_error: float = quantity(5e-4, unit="rad/s, each sample", source="the same", gt=0.0)

    requires: ClassVar[tuple[str, ...]] = WITHOUT_WHEELSETS
    adds: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            name: "smaller deviations of conicity and dampers (all four sensors of the wheelsets)"
            for name in FULL
            if name.startswith("wheelset")
        }
    )

    @property
    def channels(self) -> tuple[str, ...]:
        """What is used where it is there."""
        return FULL if self.wheelset_sensors else WITHOUT_WHEELSETS

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """What the vehicle's model needs."""
        return NEEDED

    def missing(self, measurements: Measurements) -> Missing:
        """What is needed and not there, a speed among it."""
        return super().missing(measurements) + missing_speed(measurements)

    def placed(self, measurements: Measurements) -> bool:
        """Whether the track was measured, and where the vehicle is on it is known."""
        return can_locate(measurements) or (self.start is not None and measurements.track is not None)

    def forces(self, vehicle: dict[str, float]) -> dict[str, float]:
        """Densities of unknown forces, N/sqrt(Hz) and N m/sqrt(Hz), by body and direction."""
        arm, semi = vehicle["half_gauge"], vehicle["semi_wheelbase"]
        b, c = self.bogie_force, self.body_force
        forces = {"bogie.y": b, "bogie.roll": b * arm, "bogie.yaw": b * semi, "body.y": c, "body.roll": c * arm}
        return forces | {"wheelset.y": self.wheelset_force, "wheelset.yaw": self.wheelset_moment}

    def model_errors(self, channels: Sequence[str]) -> np.ndarray:
        """What the model leaves of each reading besides its sensor's noise, each sample at `TUNED` Hz, shape (m,)."""
        error = {"wheelset": self.wheelset_error, "bogie": self.bogie_error, "body": self.body_error}
        return np.array(
            [self.rate_error if "rate" in name else error[name.split(".")[0].rstrip("12")] for name in channels]
        )

    def tracks(self, share: float) -> tuple[TrackSpectrum, TrackSpectrum]:
        """Spectra of lateral position and roll of a share of the power of ERRI B176 low."""
        return ERRI_LATERAL.scaled(ERRI_LATERAL.amplitude * share), ROLL.scaled(ROLL.amplitude * share)


class SuspensionEstimator(SuspensionSettings, frozen=True):
    """Settings and model of the suspension's filters (Ward et al. 2011, section 4.1)."""

    track: Track = quantity(
        "uncertain",
        unit="exact, uncertain or unknown",
        source="how well the rails' place is known: by track.csv, or not; without an error of its own (exact), what "
        "load and rails add turns into damping",
    )
    keep_every: int = quantity(1, unit="samples", source="the low-pass allows 4 of 256 Hz", ge=1)
    largest: float = quantity(1.6, unit="- of the nominal damping", source=ILLUSTRATIVE, gt=1.0)
    largest_conicity: float = quantity(0.45, unit="-", source="beyond it wheels are turned", gt=0.0)

    def missing(self, measurements: Measurements) -> Missing:
        """What is needed and not there: also half a vehicle, since these filters know no whole body, and the track."""
        whole = (HALF,) if is_whole(measurements.vehicle) else ()
        lost = () if self.track == "unknown" or self.placed(measurements) else (NO_PLACE,)
        return super().missing(measurements) + Missing(others=whole + lost)

    def prepare(self, measurements: Measurements) -> Problem:
        """Read a recording; raises `InputError` where something is missing."""
        self.need(measurements)
        numbers(measurements.vehicle, NEEDED)
        as_built = nominal(measurements.vehicle)
        record = read(
            measurements,
            self.channels,
            (self.high_pass, self.low_pass),
            self.track != "unknown",
            self.start,
            self.keep_every,
        )
        low = np.array([0.0, 0.0, 0.01])
        high = np.array([*(self.largest * as_built[:2]), self.largest_conicity])
        return Problem(record, dict(measurements.vehicle), self, low, high, as_built)

    def unknowns(self, vehicle: dict[str, float], channels: Sequence[str], noise: np.ndarray, rate: float) -> Unknowns:
        """What drives and spoils, for the readings `channels` of the given noise at `rate` Hz."""
        named = self.forces(vehicle)
        force = np.array([named[name.replace("1.", ".").replace("2.", ".")] for name in COORDINATES])
        model = self.model_errors(channels)
        tracks: dict[Track, tuple[TrackSpectrum, ...]] = {
            "exact": (),
            "uncertain": self.tracks(self.track_error),
            "unknown": self.tracks(self.track_level),
        }
        return Unknowns(
            (force + LEAST_FORCE) ** 2, noise**2 + np.square(model) * rate / TUNED, tracks[self.track], self.low_pass
        )
