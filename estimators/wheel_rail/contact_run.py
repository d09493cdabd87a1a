"""What the conicity filters share: settings, channels of a recording on one grid, start of a run, the series."""

from abc import abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple

import numpy as np
import pandas as pd

from estimators.interface import Estimate, Estimator, Missing
from estimators.speed.odometry import channel_speeds, speed_channel, states_speed
from estimators.vehicle import single_wheelset
from estimators.vehicle.creep import DRY
from estimators.vehicle.single_wheelset import WheelsetModel, coefficients, wheelset_model
from estimators.wheel_rail import contact_filter as kernels
from estimators.wheel_rail.contact_filter import BIASES, CHANNELS, DYNAMIC, WIDTH, Memory, Settings
from estimators.wheel_rail.straight import told_of_curves
from railsim.data_sheet import data_sheet
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.spec import quantity
from railsim.track.spectra import WC, WR

NAMES = (
    "wheelset1.acceleration_y [m/s2]",
    "body.acceleration_y [m/s2]",
    "wheelset1.rate_yaw [rad/s]",
    "suspension.displacement [m]",
    "wheelset1.rate_roll [rad/s]",
)
"""Channels in the kernel's order."""
SPEED = "wheelset1.speed [m/s]"
COLUMNS = (
    "conicity [-]",
    "track_lateral [m]",
    "wheelset1.lateral_shift [m]",
    "conicity_std [-]",
    "track_lateral_std [m]",
    "wheelset1.lateral_shift_std [m]",
    "innovation [-]",
)
FASTEST, SPEEDS = 80.0, 160
SLOWEST = 1.0
"""m/s; slower than that the filter waits."""
START = np.array([2e-3, 2e-2, 1e-3, 1e-2, 4e-3, 2e-2])
"""Standard deviations of y, y', psi, psi', y_m, y_m' at the start (illustrative)."""
PAPER = "Ward et al. 2011, section 4.3.2"


class Grid(NamedTuple):
    """Samples (n, CHANNELS) on a uniform grid, NaN where lost; speeds (n,); rows of recorded samples, times, rate."""

    samples: np.ndarray
    speeds: np.ndarray
    rows: np.ndarray
    time: np.ndarray
    rate: float


class ContactEstimator(Estimator, frozen=True):
    """Base: settings of the filter and how it is started."""

    creep: float = quantity(DRY, unit="share of Kalker's slope", source="Polach (2005), dry rail", gt=0.0, le=1.5)
    track_std: float = quantity(2e-3, unit="m", source="Ward et al. 2011, section 4.3.4: about 2 mm", ge=0.0, le=0.1)
    model_lateral: float = quantity(0.3, unit="m/s2", source="trial on other tracks and vehicles", gt=0.0)
    model_yaw: float = quantity(0.3, unit="rad/s2", source="trial on other tracks and vehicles", gt=0.0)
    gauge_std: float = quantity(1e-3, unit="m of shift", source="what 2 mm of gauge do to S1002 on 60E1", ge=0.0)
    gauge_pole: float = quantity(1.5, unit="rad/m", source="what 2 mm of gauge do to S1002 on 60E1", gt=0.0)
    conicity_std: float = quantity(0.7, unit="- of the logarithm", source="illustrative: new to worn", gt=0.0)
    conicity_walk: float = quantity(0.02, unit="1/sqrt(s), of the logarithm", source="illustrative", ge=0.0)
    roll_std: float = quantity(1.0, unit="- of the nominal slope", source="illustrative: wear turns its sign", gt=0.0)
    model_error: float = quantity(0.25, unit="- of the conicity", source="trial on other tracks and vehicles", ge=0.0)
    model_floor: float = quantity(0.02, unit="-", source="trial on other tracks and vehicles", ge=0.0)
    use_roll: bool = quantity(False, unit="-", source="the roll of a worn wheelset does not follow its shift")

    requires: ClassVar[tuple[str, ...]] = (NAMES[2], SPEED)
    adds: ClassVar[Mapping[str, str]] = MappingProxyType(
        dict.fromkeys((NAMES[0], NAMES[1], NAMES[3]), "smaller deviations of the conicity")
    )

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """What the model of a single wheelset needs."""
        return single_wheelset.NEEDED

    def missing(self, measurements: Measurements) -> Missing:
        """What is needed and not there; a stated speed source stands for the tachometer."""
        return without_speed(super().missing(measurements), measurements)

    def nodes(self) -> np.ndarray:
        """Places of the conicity's table, m; one: a constant."""
        return np.zeros(1)

    @abstractmethod
    def drive(self) -> np.ndarray:
        """Variances of the track's lateral position and of what the gauge does to the shift, m2, (2,)."""
        return np.array([self.track_std, self.gauge_std]) ** 2

    def estimate(self, measurements: Measurements) -> Estimate:
        """Filter a whole record.

        Raises
        ------
        InputError : a channel or a vehicle parameter is missing.
        """
        self.need(measurements)
        grid = read(measurements)
        run = self.online(measurements.about, grid.rate)
        rows = run.advance(grid.speeds, grid.samples)[grid.rows]
        series = pd.DataFrame({"time [s]": grid.time, **dict(zip(COLUMNS, rows.T, strict=True))})
        found = Estimate(self.name, series, {"settings": self.model_dump(mode="json"), **self.further(run)})
        return told_of_curves(found, measurements)

    def further(self, run: "Run") -> dict[str, Any]:
        """What else the estimate states at its end."""
        return {"channels used": run.used}

    def online(self, about: Mapping[str, Any], rate: float) -> "Run":
        """Start a run; see `OnlineEstimator`."""
        model = wheelset_model(about["vehicle"], self.creep)
        nodes = self.nodes()
        readings = self._readings(about, rate)
        walks = np.concatenate([np.full(len(nodes), self.conicity_walk**2), np.full(BIASES, 1e-12), [1e-12]])
        speeds = np.linspace(SLOWEST, FASTEST, SPEEDS)
        settings = Settings(
            speeds, speed_table(model, speeds), 1.0 / rate, np.array([WR, WC, self.gauge_pole]),
            self.drive(),
            np.array([self.model_lateral, self.model_yaw]), nodes, walks, 1.0 / model.numbers.l, readings,
        )  # fmt: skip
        return Run(settings, self._memory(model, nodes, about), (self.model_error, self.model_floor))

    def _readings(self, about: Mapping[str, Any], rate: float) -> np.ndarray:
        """Variance of each channel."""
        model = (self.model_lateral, 0.0, 0.0, 0.0, 0.0)
        variances = np.empty(CHANNELS)
        for number, name in enumerate(NAMES):
            white = data_sheet(about, name).variance(rate)
            variances[number] = max(white, LEAST[number] ** 2) + model[number] ** 2
        if not self.use_roll:
            variances[-1] = np.inf
        return variances

    def _memory(self, model: WheelsetModel, nodes: np.ndarray, about: Mapping[str, Any]) -> Memory:
        size = DYNAMIC + len(nodes) + BIASES + 1
        mean, deviation = np.zeros(size), np.zeros(size)
        speed = 20.0  # for the track's rate at the start only
        track, gauge = np.sqrt(self.drive())
        deviation[:6] = START
        deviation[6:DYNAMIC] = track, track * speed * np.sqrt(WR * WC), gauge
        mean[DYNAMIC : DYNAMIC + len(nodes)] = np.log(model.conicity)
        covariance = np.diag(deviation**2)
        inner = slice(DYNAMIC, DYNAMIC + len(nodes))
        covariance[inner, inner] = self.prior(nodes)
        for number, name in enumerate(NAMES):
            place = DYNAMIC + len(nodes) + number
            covariance[place, place] = max(data_sheet(about, name).error("bias_std"), 1e-9) ** 2
        mean[-1], covariance[-1, -1] = model.s, (self.roll_std * model.s) ** 2
        wide = np.zeros((DYNAMIC, DYNAMIC + WIDTH))
        return Memory(
            mean, covariance, wide, np.zeros((DYNAMIC, DYNAMIC)), np.zeros((DYNAMIC, size)), np.zeros((DYNAMIC, size)),
            np.zeros(size), np.zeros(size), np.zeros(DYNAMIC), np.zeros(24), np.zeros(7),
        )  # fmt: skip

    def prior(self, nodes: np.ndarray) -> np.ndarray:
        """Covariance of the logarithm of the conicity at the nodes at the start."""
        return np.full((1, 1), self.conicity_std**2)


LEAST = (1e-3, 1e-3, 1e-4, 1e-5, 1e-4)
"""Least standard deviation of each channel's noise that the filter is given: an ideal sensor has none."""


class Run:
    """A running filter; `used`: the channels it has had, `wrong`: share and floor of the model's error."""

    def __init__(self, settings: Settings, memory: Memory, wrong: tuple[float, float]) -> None:
        self.settings, self.memory, self.wrong = settings, memory, wrong
        self.used: list[str] = []
        self._speed = np.nan

    def advance(self, speeds: np.ndarray, samples: np.ndarray) -> np.ndarray:
        """Rows of `COLUMNS` for samples (n, CHANNELS) at speeds (n,)."""
        out = np.full((len(samples), len(COLUMNS)), np.nan)
        ready = np.isfinite(speeds) & (speeds >= SLOWEST)
        first = int(np.argmax(ready)) if ready.any() else len(speeds)
        known = np.where(ready, speeds, SLOWEST)[first:]
        present = np.isfinite(samples).any(axis=0) & np.isfinite(self.settings.readings)
        self.used = sorted({*self.used, *(name for name, there in zip(NAMES, present, strict=True) if there)})
        kernels.advance(self.settings, self.memory, known, np.ascontiguousarray(samples[first:]), out[first:])
        out[:, 3] = self._honest(out[:, 3], out[:, 0])
        out[:, 5] = np.hypot(out[:, 5], self.wrong[0] * out[:, 2])
        return out

    def step(self, sample: Mapping[str, float]) -> dict[str, float]:
        """One sample by the channels' names; the wheel's speed may come more rarely than the others."""
        speed = sample.get(SPEED, np.nan)
        self._speed = speed if np.isfinite(speed) else self._speed
        values = np.array([[sample.get(name, np.nan) for name in NAMES]])
        row = self.advance(np.array([self._speed]), values)[0]
        return {"time [s]": sample["time [s]"], **dict(zip(COLUMNS, (float(value) for value in row), strict=True))}

    def table(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Nodes (m), conicity and standard deviation there."""
        count = len(self.settings.nodes)
        inner = slice(DYNAMIC, DYNAMIC + count)
        conicity = np.exp(self.memory.mean[inner])
        spread = conicity * np.sqrt(np.diag(self.memory.covariance)[inner])
        return self.settings.nodes, conicity, self._honest(spread, conicity)

    def _honest(self, spread: np.ndarray, conicity: np.ndarray) -> np.ndarray:
        """Standard deviation with what the model does not know: a share of the conicity, and a least one."""
        share, floor = self.wrong
        return np.sqrt(spread**2 + (share * conicity) ** 2 + floor**2)


def speed_table(model: WheelsetModel, speeds: np.ndarray) -> np.ndarray:
    """Coefficients (s, 24): y'' and psi'' by x, x', D, then rows y'', psi'', y_m'' by the six states."""
    rows = [np.concatenate([part.ravel() for part in coefficients(model, float(speed))]) for speed in speeds]
    return np.array(rows)


def read(measurements: Measurements) -> Grid:
    """Channels of the filters on the grid of the yaw gyro; the wheel's speed is the last one known.

    Raises
    ------
    InputError : a channel has another rate than the gyro.
    """
    gyro = NAMES[2]
    time, rate = measurements.time(gyro), measurements.rate(gyro)
    rows = np.round((time - time[0]) * rate).astype(int)
    samples = np.full((rows[-1] + 1, CHANNELS), np.nan)
    for number, name in enumerate(NAMES):
        if name in measurements:
            if measurements.rate(name) != rate:
                raise InputError(f"'{name}' must have the rate of '{gyro}', {rate:g} Hz; record both with one logger")
            samples[rows, number] = measurements[name]
    return Grid(samples, held(measurements, time[0] + np.arange(len(samples)) / rate), rows, time, rate)


def without_speed(missing: Missing, measurements: Measurements) -> Missing:
    """What is missing, less the tachometer where the recording states another source of speed."""
    if not states_speed(measurements):
        return missing
    return replace(missing, channels=tuple(name for name in missing.channels if name != SPEED))


def held(measurements: Measurements, time: np.ndarray) -> np.ndarray:
    """Last known wheel speed at the times, NaN before the first; or the speed by the source that is stated."""
    if states_speed(measurements) and speed_channel(measurements) != SPEED:
        speeds = channel_speeds(measurements)
        return np.interp(time, speeds.time, speeds.speed)
    good = np.isfinite(measurements[SPEED])
    known, values = measurements.time(SPEED)[good], measurements[SPEED][good]
    place = np.searchsorted(known, time + 1e-9, side="right") - 1
    return np.where(place >= 0, values[np.clip(place, 0, None)], np.nan) if len(known) else np.full(len(time), np.nan)
