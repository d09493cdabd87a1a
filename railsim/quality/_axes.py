"""Which way a three-axis accelerometer stands, by gravity, by changes of speed and by curves (Wahba 1965)."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.spatial.transform import Rotation

from railsim.measurements import Measurements
from railsim.quality._offsets import axis_of, speed_channel
from railsim.quality._signals import filled, kind_of, sheet

AXES, TURNS = ("x", "y", "z"), ("roll", "pitch", "yaw")
_BLOCK = 2.0  # s, over which accelerations and the change of speed are averaged
_SURE = 5.0  # standard deviations of a regression
_ALONG, _ACROSS = (0.5, 1.5), (0.3, 1.5)  # between which the regression has to be: cant takes a part off in curves
_LEAST = 0.05  # m/s2, root mean square of the change of speed, or of speed times turning rate
_UPRIGHT = 89.9  # deg
_GRAVITY_WEIGHT = 100.0  # of gravity's direction beside those of the regressions


@dataclass(frozen=True)
class Axes:
    """Channels of one accelerometer by axis, of the gyro in the same box by its axis, and the means.

    Attributes
    ----------
    accelerations, rates : channel by axis.
    mean : specific force by axis of `accelerations`, m/s2, NaN where an axis is not there, shape (3,).
    """

    accelerations: Mapping[str, str]
    rates: Mapping[str, str]
    mean: np.ndarray

    @property
    def size(self) -> float:
        """Of the mean specific force, m/s2, by the axes that are there."""
        return float(np.sqrt(np.nansum(self.mean**2)))


def sensors_of(measured: Measurements) -> list[Axes]:
    """Every accelerometer that has an axis z and whose samples change."""
    boxes: dict[str, dict[str, str]] = {}
    for name in measured:
        if kind_of(measured, name) == "accelerometer":
            boxes.setdefault(_stem(name), {})[axis_of(name)] = name
    found = []
    for stem, axes in boxes.items():
        known = {axis: name for axis, name in axes.items() if np.nanstd(_numbers(measured, name)) > 0.0}
        if "z" not in known:
            continue
        mean = np.array([np.nanmean(measured[known[axis]]) if axis in known else np.nan for axis in AXES])
        found.append(Axes(known, _rates(measured, stem, known["z"]), mean))
    return found


def _stem(name: str) -> str:
    return name.split(".")[0]


def _numbers(measured: Measurements, name: str) -> np.ndarray:
    values = measured[name]
    good = values[np.isfinite(values)]
    return good if good.size else np.zeros(1)


def _rates(measured: Measurements, stem: str, beside: str) -> dict[str, str]:
    """Gyro of the same name and body."""
    body = sheet(measured, beside).get("body")
    names = [name for name in measured if kind_of(measured, name) == "gyro" and _stem(name) == stem]
    return {axis_of(name): name for name in names if sheet(measured, name).get("body") == body}


def mounting(measured: Measurements, axes: Axes) -> tuple[Rotation, bool]:
    """Rotation from the sensor's axes to the body's, and whether the heading about the vertical is known.

    Gravity gives two angles of three. The third is where the specific force changes with the speed, or with speed times
    the turning rate about the vertical, which needs a gyro. Without it, the smallest rotation is taken.
    """
    down = axes.mean / axes.size
    targets, seen, weights = [np.array([0.0, 0.0, 1.0])], [down], [_GRAVITY_WEIGHT]
    level_axes = (([1.0, 0.0, 0.0], _forward(measured, axes)), ([0.0, 1.0, 0.0], _left(measured, axes, down)))
    for target, found in level_axes:
        if found is not None:
            level = found - (found @ down) * down
            targets.append(np.array(target))
            seen.append(level / np.linalg.norm(level))
            weights.append(1.0)
    if len(targets) == 1 and down[2] < -0.999:
        return Rotation.from_euler("x", 180.0, degrees=True), False
    return Rotation.align_vectors(targets, seen, weights)[0], len(targets) > 1


def angles(rotation: Rotation) -> list[float]:
    """Roll, pitch and yaw about fixed axes, deg; no roll where the pitch is 90 deg, for roll and yaw are one there."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # gimbal lock, which is resolved here
        roll, pitch, yaw = (float(one) for one in rotation.as_euler("xyz", degrees=True))
    if abs(pitch) > _UPRIGHT:
        yaw, roll = (yaw + roll if pitch < 0 else yaw - roll), 0.0
        yaw = (yaw + 180.0) % 360.0 - 180.0
    return [round(one, 1) + 0.0 for one in (roll, pitch, yaw)]


def _blocks(measured: Measurements, axes: Axes) -> tuple[np.ndarray, np.ndarray]:
    """Edges of blocks, s, shape (k + 1,), and mean specific force in each, shape (k, 3)."""
    first = axes.accelerations["z"]
    time, count = measured.time(first), round(_BLOCK * measured.rate(first))
    at = np.arange(0, time.size - count, count)
    values = [filled(measured[axes.accelerations[axis]]) for axis in AXES]
    means = np.array([[one[begin : begin + count].mean() for begin in at] for one in values]).T
    return np.append(time[at], time[at[-1]] + _BLOCK) if at.size else np.zeros(0), means.reshape(-1, 3)


def _forward(measured: Measurements, axes: Axes) -> np.ndarray | None:
    """Specific force per change of speed, shape (3,); None where speed does not tell."""
    name = speed_channel(measured)
    if name is None:
        return None
    edges, force = _blocks(measured, axes)
    speed, time = filled(measured[name]), measured.time(name)
    size = max(1, round(measured.rate(name)))
    calm = uniform_filter1d(speed, size, mode="nearest")
    change = np.diff(np.interp(edges, time, calm)) / _BLOCK
    return _slope(force, change, _ALONG)


def _left(measured: Measurements, axes: Axes, down: np.ndarray) -> np.ndarray | None:
    """Specific force per speed times turning rate about the vertical, shape (3,); None where there are no curves."""
    name = speed_channel(measured)
    if name is None or not set(TURNS) <= set(axes.rates):
        return None
    edges, force = _blocks(measured, axes)
    middle = 0.5 * (edges[1:] + edges[:-1])
    turning = np.zeros(middle.size)
    for share, axis in zip(down, TURNS, strict=True):
        channel = axes.rates[axis]
        summed = np.cumsum(filled(measured[channel])) / measured.rate(channel)
        turning += share * np.diff(np.interp(edges, measured.time(channel), summed)) / _BLOCK
    pull = turning * np.interp(middle, measured.time(name), filled(measured[name]))
    return _slope(force, pull, _ACROSS)


def _slope(force: np.ndarray, cause: np.ndarray, between: tuple[float, float]) -> np.ndarray | None:
    """Regression of each axis on a cause, less the means; None where it is not sure or of no likely size."""
    if cause.size < 6:
        return None
    cause, force = cause - cause.mean(), force - force.mean(axis=0)
    power = float(cause @ cause)
    if np.sqrt(power / cause.size) < _LEAST:
        return None
    slope = force.T @ cause / power
    rest = force - np.outer(cause, slope)
    deviation = float(np.sqrt(np.sum(rest**2) / max(cause.size - 2, 1) / power))
    size = float(np.linalg.norm(slope))
    return slope if size > _SURE * deviation and between[0] < size < between[1] else None
