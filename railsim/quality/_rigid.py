"""Rigid-body kinematics of the bogie as relations between channels, in bands of the spectrum.

Each relation is a sum over channels that vanishes for a rigid bogie: the acceleration of one place is that of another
and the angular acceleration times the arm between them; a transducer's second derivative is the difference of the
accelerations at its ends; both boxes of an axle have one lateral acceleration.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np
from scipy.ndimage import minimum_filter1d
from scipy.signal.windows import tukey

from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements
from railsim.quality._offsets import axis_of
from railsim.quality._signals import filled, kind_of, limit, runs
from railsim.sensors.errors import low_pass

LOW, HIGH = 1.0, 20.0  # Hz
_COARSE = 64.0  # Hz
_SOFT = 8.0  # Hz
_AXES = ("x", "y", "z")
_ROTATIONS = ("roll", "pitch", "yaw")
_SIDES = {"left": 1.0, "right": -1.0}


@dataclass(frozen=True)
class Relation:
    """A sum of channels' spectra times weights that should vanish.

    Attributes
    ----------
    weights : by channel, over frequency, shape (k,); the sensors' low-passes and latencies undone.
    tolerance : energy that scale errors and misalignment by the data sheets, and `give`, may leave over.
    give : by channel, share of it by which springs between the bodies give way, over frequency, shape (k,).
    """

    weights: Mapping[str, np.ndarray]

    tolerance: float = 0.0
    give: Mapping[str, np.ndarray] = field(default_factory=dict)

    def residual(self, spectra: Mapping[str, np.ndarray], signs: Mapping[str, tuple[str, float]]) -> float:
        """Energy left over where each channel is read as (channel, sign) of `signs`."""
        total = 0.0
        for name, weight in self.weights.items():
            source, sign = signs.get(name, (name, 1.0))
            total = total + sign * weight * spectra[source]
        return float(np.sum(np.abs(total) ** 2)) + self.tolerance


def spectra_of(measured: Measurements, taper: float | None = None) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Frequencies [Hz] of the band, shape (k,), and spectra of inertial and displacement channels over them.

    Parameters
    ----------
    taper : s at each end of the record over which it fades in and out; None: Hann's window over the whole of it.
    """
    wanted = [n for n in measured if kind_of(measured, n) in ("accelerometer", "gyro", "displacement")]
    wanted = [n for n in wanted if measured.rate(n) > 2.5 * HIGH]
    if not wanted:
        return np.zeros(0), {}
    length = math.floor(min(measured[n].size / measured.rate(n) for n in wanted) + 1e-9)
    at = np.arange(math.ceil(LOW * length), math.floor(HIGH * length) + 1)
    keep = window_of(measured, wanted, length, taper)
    transformed = {}
    for name in wanted:
        values = filled(measured[name])[: round(length * measured.rate(name))]
        window = np.interp(np.arange(values.size) / measured.rate(name), np.arange(keep.size) / _COARSE, keep)
        transformed[name] = np.fft.rfft((values - values.mean()) * window)[at] / values.size
    return at / max(length, 1), transformed


def window_of(measured: Measurements, names: list[str], length: float, taper: float | None = None) -> np.ndarray:
    """Window over a record of `length` s at 64 Hz: 0 at the ends (see `spectra_of`) and beside lost samples."""
    count = round(length * _COARSE)
    keep = np.ones(count + 1)
    for name in names:
        rate = measured.rate(name)
        for first, last in runs(np.isnan(measured[name])):
            if last - first > 0.1 * rate:
                keep[max(0, int(first / rate * _COARSE) - 1) : int(last / rate * _COARSE) + 2] = 0.0
    smooth = np.hanning(round(1.0 * _COARSE))
    wide = minimum_filter1d(keep, smooth.size)
    share = 1.0 if taper is None else min(1.0, 2.0 * taper / max(length, 1e-9))
    return tukey(keep.size, share) * np.convolve(wide, smooth / smooth.sum(), mode="same")


def relations(measured: Measurements, frequency: np.ndarray, spectra: Mapping[str, np.ndarray]) -> list[Relation]:
    """All that the channels of a recording allow."""
    gyros = _by_body(measured, spectra, "gyro")
    accelerometers = _by_body(measured, spectra, "accelerometer")
    related = []
    for body, mounts in accelerometers.items():
        turning = next(iter(gyros.get(body, {}).values()), {})
        for first, second in combinations(mounts.items(), 2):
            related += _between_positions(first, second, turning, frequency)
    bogie = accelerometers.get("bogie", {})
    turning = next(iter(gyros.get("bogie", {}).values()), {})
    for body in ("wheelset1", "wheelset2"):
        for position, axes in accelerometers.get(body, {}).items():
            for frame in bogie.items():
                related += _primary(measured, body, position, axes, frame, turning, frequency)
    late = {name: response(measured, name, frequency) for name in spectra}
    related = [
        replace(one, weights={name: weight / late[name] for name, weight in one.weights.items()})
        for one in related
        if late.keys() >= one.weights.keys()  # a channel that no data sheet states has no spectrum
    ]
    return [replace(one, tolerance=_tolerance(measured, one, spectra)) for one in related]


def response(measured: Measurements, name: str, frequency: np.ndarray) -> np.ndarray:
    """What a channel's sensor does to each frequency, Hz, by its data sheet: Butterworth low-pass and latency, (k,)."""
    delay = np.exp(-2j * np.pi * frequency * limit(measured, name, "latency"))
    band = limit(measured, name, "bandwidth")
    if not band:
        return np.asarray(delay)
    order = max(1, round(limit(measured, name, "bandwidth_order")))
    return np.asarray(delay * low_pass(2.0 * np.pi * frequency, band, order))


_Position = tuple[float, float, float]
_Mounts = dict[str, dict[_Position, dict[str, str]]]


def _by_body(measured: Measurements, spectra: Mapping[str, np.ndarray], kind: str) -> _Mounts:
    """Channels by body, place and axis."""
    mounts: _Mounts = {}
    for name in spectra:
        if kind_of(measured, name) == kind:
            stated = data_sheet(measured.about, name)
            axes = mounts.setdefault(str(stated.stated.get("body")), {}).setdefault(stated.position, {})
            axes.setdefault(axis_of(name), name)
    return mounts


def _turning_weights(
    turning: Mapping[str, str], arm: np.ndarray, axis: int, frequency: np.ndarray
) -> dict[str, np.ndarray] | None:
    """Weights of the gyro's channels in (alpha x arm) along an axis; None where one is missing."""
    weights = {}
    after, last = (axis + 1) % 3, (axis + 2) % 3
    for rotation, lever in ((after, arm[last]), (last, -arm[after])):
        if abs(lever) < 0.02:
            continue
        name = turning.get(_ROTATIONS[rotation])
        if name is None:
            return None
        weights[name] = 2j * np.pi * frequency * lever
    return weights


def _between_positions(
    first: tuple[_Position, dict[str, str]],
    second: tuple[_Position, dict[str, str]],
    turning: Mapping[str, str],
    frequency: np.ndarray,
) -> list[Relation]:
    """f(second) - f(first) - alpha x arm, along each axis that both have; both boxes of an axle along it."""
    arm = np.array(second[0]) - np.array(first[0])
    related = []
    for number, axis in enumerate(_AXES):
        if axis not in first[1] or axis not in second[1]:
            continue
        weights = (
            _turning_weights(turning, arm, number, frequency)
            if turning
            else ({} if axis == "y" and not arm[0] else None)
        )
        if weights is None:
            continue
        unit = np.ones(frequency.size)
        minus = {name: -weight for name, weight in weights.items()}
        related.append(Relation({second[1][axis]: unit, first[1][axis]: -unit} | minus))
    return related


def _primary(
    measured: Measurements,
    body: str,
    position: _Position,
    axes: Mapping[str, str],
    frame: tuple[_Position, dict[str, str]],
    turning: Mapping[str, str],
    frequency: np.ndarray,
) -> list[Relation]:
    """Bogie above an axlebox: minus the box's acceleration, minus the transducer's second derivative; and lateral
    acceleration of bogie and axle below 3 Hz, where the primary suspension hardly moves.
    """
    vehicle = measured.vehicle
    number = int(body.removeprefix("wheelset"))
    ahead = float(vehicle.get("semi_wheelbase", 1.3)) * (1.0 if number == 1 else -1.0)
    drop = float(vehicle.get("wheel_radius", 0.45)) - float(vehicle.get("bogie_height", 0.6))
    side = "left" if position[1] > 0 else "right"
    arm = np.array([ahead, position[1], drop]) - np.array(frame[0])
    unit = np.ones(frequency.size)
    related = []
    transducer = f"primary{number}_{side}.displacement [m]"
    vertical = _turning_weights(turning, arm, 2, frequency)
    if "z" in axes and "z" in frame[1] and transducer in measured and vertical is not None:
        weights = {frame[1]["z"]: unit, axes["z"]: -unit, transducer: (2 * np.pi * frequency) ** 2}
        related.append(Relation(weights | vertical))
    lateral = _turning_weights(turning, arm, 1, frequency)
    if "y" in axes and "y" in frame[1] and lateral is not None:
        low = (frequency < 3.0).astype(float)
        slow = {name: weight * low for name, weight in ({frame[1]["y"]: unit, axes["y"]: -unit} | lateral).items()}
        related.append(Relation(slow, give={frame[1]["y"]: low * _give(vehicle, frequency)}))
    return related


def _give(vehicle: Mapping[str, object], frequency: np.ndarray) -> np.ndarray:
    """Acceleration that the primary suspension gives way by over that of the bogie, shape (k,): (w / w0)^2.

    An axle's springs carry half of the bogie: w0^2 is their lateral stiffness over that mass. Where the vehicle is not
    known, w0 is that of 8 Hz (illustrative).
    """
    numbers = [vehicle.get(key) for key in ("primary_lateral_stiffness", "bogie_mass")]
    stiffness, mass = (float(one) if isinstance(one, int | float) else math.nan for one in numbers)
    square = 2.0 * stiffness / (0.5 * mass) if stiffness * mass > 0.0 else (2.0 * math.pi * _SOFT) ** 2
    return (2.0 * math.pi * frequency) ** 2 / square


def _tolerance(measured: Measurements, relation: Relation, spectra: Mapping[str, np.ndarray]) -> float:
    """Energy, at four standard deviations, by scale errors of the channels and their sensors' other axes."""
    total = 0.0
    for name, weight in relation.weights.items():
        scale, tilt = (limit(measured, name, f"{what}_std") for what in ("scale_error", "misalignment"))
        own = float(np.sum(np.abs(weight * spectra[name]) ** 2))
        stem = name.split(" [")[0].rpartition("_")[0]
        across = [other for other in spectra if other != name and other.split(" [")[0].rpartition("_")[0] == stem]
        other = sum(float(np.sum(np.abs(weight * spectra[one]) ** 2)) for one in across)
        total += 16.0 * (scale**2 * own + tilt**2 * other)
    total += sum(16.0 * float(np.sum(np.abs(share * spectra[name]) ** 2)) for name, share in relation.give.items())
    return total
