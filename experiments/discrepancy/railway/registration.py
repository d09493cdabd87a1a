"""Registration: where the recording began and how far off its speed is, from the lag between model and measurement.

A tachometer tells how its wheel rolls: in a curve on other radii than on straight track. What the nominal vehicle's
wheel does there beside the speed is taken off.
"""

from dataclasses import dataclass
from functools import reduce
from itertools import islice

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.signal import butter, correlate, sosfiltfilt

from experiments.discrepancy.railway.creep_law import as_run
from experiments.discrepancy.railway.survey import Surveyed
from experiments.discrepancy.recording.evidence import Evidence
from experiments.discrepancy.recording.speed import SLOW
from railsim.dynamics.channels import channel_names
from railsim.effects.interface import Setup
from railsim.engines.interface import Run, default_substeps
from railsim.engines.verlet import integrate
from railsim.errors import InputError
from railsim.model import Model
from railsim.sensors.errors import SensorErrors
from railsim.speed import Profile
from railsim.stamps import usual_step
from railsim.track.kernel import build_tables
from railsim.track.track import Track
from railsim.truth import HeldTruth

WINDOW = 6.0  # s
FARTHEST = 0.6  # s of lag that is searched to each side
BAND = (0.8, 12.0)  # Hz
ALIKE = 0.5  # correlation from which a window counts
PREFERRED = ("acceleration_z", "rate_pitch", "displacement", "rate_roll", "acceleration_y", "rate_yaw")
MOST = 3  # channels that count: the first of these that follow the track at all
SPEEDS = (0.05, 119.0)  # m/s, of a run


@dataclass(frozen=True, eq=False)
class Registration:
    """Where the first sample was taken [m], and by how much the measured speed is off, both roughly; `rolling`: speed
    that the tachometer's wheel tells over that of the vehicle, at the instants of the measured speed.
    """

    start: float
    scale: float = 1.0
    rolling: np.ndarray | float = 1.0

    def speed(self, measured: np.ndarray) -> np.ndarray:
        """Of the vehicle [m/s]."""
        return measured * self.scale / self.rolling


def register(evidence: Evidence, tries: int = 3) -> Registration:
    """Start and scale of the speed by which the model's motion fits the measured one in time.

    Raises
    ------
    InputError : model and measurement have nothing in common in any window, so the track or the start is wrong.
    """
    registration = Registration(evidence.scenario.start)
    surveyed = Surveyed(evidence.track, evidence.track_errors, evidence.track_estimated)
    track = surveyed.expected(dict.fromkeys(surveyed.kinds(), 1.0))
    for number in range(tries):
        prediction, rolling = _predicted(evidence, track, registration)
        time, lag, weight = _lags(evidence, prediction)
        if not len(time):
            raise InputError(
                "nothing in the recording follows the measured track; check the track file and 'start', "
                "or take a rougher section"
            )
        measured = evidence.speed
        along = np.interp(time, measured.time, measured.speed) * lag  # m that the model is behind
        way = cumulative_trapezoid(measured.speed, measured.time, initial=0.0)
        travelled = np.interp(time, measured.time, way)
        offset, slope = robust_line(travelled, along, weight)
        registration = Registration(registration.start - offset, registration.scale * (1.0 - slope), rolling)
        if number and abs(offset) < 0.02 and abs(slope) < 1e-4:
            break
    return registration


def ideal(errors: SensorErrors) -> SensorErrors:
    """Filter and latency only."""
    return SensorErrors(bandwidth=errors.bandwidth, bandwidth_order=errors.bandwidth_order, latency=errors.latency)


def _predicted(
    evidence: Evidence, track: Track, registration: Registration
) -> tuple[dict[str, np.ndarray], np.ndarray | float]:
    """Samples of the compared channels by the nominal vehicle and sensors without errors, and how it rolls."""
    scenario, speed = evidence.scenario, np.clip(registration.speed(evidence.speed.speed), *SPEEDS)
    profile = Profile(kind="profile", time=tuple(evidence.speed.time.tolist()), speed=tuple(speed.tolist()))
    sensors = tuple(sensor.but(errors=ideal(sensor.errors)) for sensor in evidence.sensors)
    plain = Setup(
        as_run(scenario.vehicle), track, sensors, profile, scenario.traction, evidence.duration,
        flexible_track=scenario.flexible_track,
    )  # fmt: skip
    setup = reduce(lambda made, effect: effect.install(made), scenario.effects, plain)
    rate = scenario.output_rate
    substeps = default_substeps(setup.model, setup.speed_tables, rate)
    tables = build_tables(setup.track)
    run = Run(setup.model, tables, setup.speed_tables, registration.start, setup.duration, rate, substeps)
    about = {"vehicle": {"wheel_radius [m]": setup.model.wheelsets[0].radius}}
    rows = np.concatenate(list(integrate(run)))
    truth, rng = HeldTruth(rows.T.copy(), rate, channel_names(setup.model), about), np.random.default_rng(0)
    measured = [(sensor, sensor.measure(truth, rng)) for sensor in setup.sensors]  # ideal sensors draw nothing
    samples = {name: table[name].to_numpy() for sensor, table in measured for name in sensor.channels()}
    return samples, _rolling(evidence, setup.model, truth, speed)


def _rolling(evidence: Evidence, model: Model, truth: HeldTruth, speed: np.ndarray) -> np.ndarray | float:
    """What the tachometer's wheel tells over `speed`, both smoothed as the measured samples are."""
    wheel = evidence.speed.wheel
    if wheel is None or (angle := f"{wheel.body}.spin_angle [rad]") not in truth:
        return 1.0
    instants = wheel.smoother.signal.time
    half = 0.5 * usual_step(instants).size
    ends = np.clip(instants[:, None] + [-half, half], truth.time[0], truth.time[-1])
    way = cumulative_trapezoid(speed, evidence.speed.time, initial=0.0)
    gone = np.diff(np.interp(ends, evidence.speed.time, way))[:, 0]
    rolled = model.wheelsets[0].radius * np.diff(np.interp(ends, truth.time, truth[angle]))[:, 0]
    moves, at = gone > SLOW * half, np.interp(instants, evidence.speed.time, speed)
    told = wheel.smoother.speed(at * np.where(moves, rolled / np.where(moves, gone, 1.0), 1.0))
    smooth = wheel.smoother.speed(at)
    return np.where(smooth > SLOW, told / np.maximum(smooth, SLOW), 1.0)


def _lags(evidence: Evidence, prediction: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middle of each window, how much later the measurement is than the model [s], and a weight, over channels."""
    ranked = [name for quantity in PREFERRED for name in evidence.channels if f".{quantity}" in name]
    following = (windows for name in ranked if (windows := _of_channel(evidence, prediction, name)))
    table = np.array([window for windows in islice(following, MOST) for window in windows]).reshape(-1, 3)
    return table[:, 0], table[:, 1], table[:, 2]


def _of_channel(evidence: Evidence, prediction: dict[str, np.ndarray], name: str) -> list[tuple[float, float, float]]:
    rate = evidence.rates[name]
    high = min(BAND[1], 0.4 * rate)
    sections = butter(2, (BAND[0], high), "bandpass", fs=rate, output="sos")
    measured, modelled = evidence.samples[name], prediction[name]
    count = min(len(measured), len(modelled))
    lost = ~np.isfinite(measured[:count])
    filled = np.where(lost, np.nanmean(measured), measured[:count])
    pair = [sosfiltfilt(sections, one - one.mean()) for one in (filled, modelled[:count])]
    size, reach = int(WINDOW * rate), int(FARTHEST * rate)
    out = []
    for first in range(int(rate), count - size, size // 2):
        here = slice(first, first + size)
        a, b = pair[0][here], pair[1][here]
        scale = np.sqrt(float(a @ a) * float(b @ b))
        if lost[here].mean() > 0.1 or scale <= 0.0:
            continue
        curve = correlate(a, b, mode="same")[size // 2 - reach : size // 2 + reach + 1] / scale
        peak = int(np.argmax(curve))
        if curve[peak] < ALIKE or not 0 < peak < 2 * reach:
            continue
        left, top, right = curve[peak - 1 : peak + 2]
        shift = peak - reach + 0.5 * (left - right) / (left - 2.0 * top + right)
        out.append(((first + size / 2) / rate, shift / rate, float(curve[peak]) ** 2))
    return out


def robust_line(x: np.ndarray, y: np.ndarray, weight: np.ndarray) -> tuple[float, float]:
    """Offset and slope of y over x, outliers weighted down (Tukey's biweight on iterated least squares).

    The slope is taken as small: a ridge of one metre per kilometre keeps few windows from inventing one.
    """
    design = np.column_stack([np.ones_like(x), x])
    value = np.array([float(np.median(y)), 0.0])
    ridge = np.diag([1e-6, 1e-4 * max(float(np.ptp(x)), 1.0) ** 2 / 1e2])
    for _ in range(12):
        away = y - design @ value
        spread = 1.48 * float(np.median(np.abs(away))) + 0.02
        kept = weight * np.clip(1.0 - (away / (4.0 * spread)) ** 2, 0.0, None) ** 2
        normal = design.T @ (kept[:, None] * design) + ridge
        value = np.linalg.solve(normal, design.T @ (kept * y))
    return float(value[0]), float(value[1])
