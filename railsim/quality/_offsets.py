"""What the mean of a channel must be, and how far the data sheet and the running of a vehicle let it be off."""

import math
from dataclasses import dataclass

import numpy as np

from railsim.constants import GRAVITY
from railsim.measurements import Measurements
from railsim.quality._signals import kind_of, limit, sheet, standing

CANT_ROLL = 0.12  # rad: 180 mm of cant, the most that EN 13803 allows, over 1.5 m
GRADIENT = 0.025  # -: 1 in 40
PITCH = 0.03  # rad: change of gradient within a record
LOAD = 0.005  # m: primary suspension under curving, braking and payload, illustrative
_LEAN_BLOCK, _LEAN_FEWEST = 2.0, 5  # s of a mean, and means


@dataclass(frozen=True)
class Tolerance:
    """Standard deviation by the data sheet, and what running adds at most; unit of the channel."""

    deviation: float
    running: float


def axis_of(channel: str) -> str:
    """Ending of a channel's quantity: "x", "roll" ...; "" where it has none."""
    return channel.split(" [")[0].rpartition("_")[2] if "_" in channel.rpartition(".")[2] else ""


def speed_channel(measured: Measurements) -> str | None:
    """A channel of running speed: the receiver's, else a tachometer's."""
    found = [name for name in measured if name.endswith(".speed [m/s]")]
    return next((name for name in found if kind_of(measured, name) == "gnss"), found[0] if found else None)


def expected(measured: Measurements, channel: str) -> float:
    """Mean value where nothing is wrong: gravity, change of speed, curving at the mean yaw rate."""
    kind, axis = kind_of(measured, channel), axis_of(channel)
    if kind != "accelerometer":
        return 0.0
    if axis == "z":
        return GRAVITY
    if axis == "x":
        return _acceleration(measured)
    return 0.0


def tolerance(measured: Measurements, channel: str) -> Tolerance:
    """How far from `expected` the mean may be."""
    kind, axis = kind_of(measured, channel), axis_of(channel)
    scale, tilt = (limit(measured, channel, f"{what}_std") for what in ("scale_error", "misalignment"))
    parts = [limit(measured, channel, "bias_std"), limit(measured, channel, "bias_instability")]
    if kind == "accelerometer":
        parts += [scale * GRAVITY if axis == "z" else tilt * GRAVITY]
    deviation = math.sqrt(sum(part**2 for part in parts))
    time = measured.time(channel)
    length = max(1.0, float(time[-1] - time[0]))
    if kind == "accelerometer":
        running = {"x": GRADIENT * GRAVITY, "y": _across(measured), "z": 0.15 + tilt * _across(measured)}[axis or "z"]
    elif kind == "gyro":
        running = {"roll": CANT_ROLL, "pitch": PITCH, "yaw": math.inf}[axis or "yaw"] / length
    else:
        running = LOAD if kind == "displacement" else math.inf
    return Tolerance(deviation, running)


def heading_rate(measured: Measurements) -> tuple[float, float] | None:
    """Mean yaw rate of the path by the receiver's positions and its standard deviation, rad/s; None without one."""
    east = next((name for name in measured if name.endswith(".position_east [m]")), None)
    if east is None:
        return None
    rate, count = measured.rate(east), measured[east].size
    part = min(count // 3, round(8 * rate))
    north = east.replace("_east", "_north")
    ends, errors = [], []
    for piece in (slice(0, part), slice(count - part, count)):
        x, y, t = measured[east][piece], measured[north][piece], measured.time(east)[piece]
        good = np.isfinite(x) & np.isfinite(y)
        if good.sum() < 8:
            return None
        across = np.array([np.polyfit(t[good], axis[good], 1)[0] for axis in (x, y)])
        distance = float(np.hypot(*across)) * float(np.ptp(t[good]))
        if distance < 30.0:
            return None
        ends.append(math.atan2(across[1], across[0]))
        errors.append(_aside(measured, east, float(np.ptp(t[good])), int(good.sum())) / distance)
    length = float(measured.time(east)[-1] - measured.time(east)[0]) - part / rate
    turn = (ends[1] - ends[0] + math.pi) % (2 * math.pi) - math.pi
    return turn / length, math.hypot(*errors) / length


def lean_rate(measured: Measurements, roll: str) -> tuple[float, float] | None:
    """Mean rate by which a roll gyro runs away from the roll that gravity shows, and its standard deviation, rad/s.

    Lateral specific force is speed times yaw rate and gravity times roll; the slope of what the summed roll rate leaves
    of it is the gyro's zero. None without speed, yaw gyro and lateral accelerometer on the gyro's body.
    """
    body, speed = sheet(measured, roll).get("body"), speed_channel(measured)
    beside = [name for name in measured if sheet(measured, name).get("body") == body]
    yaw = next((n for n in beside if kind_of(measured, n) == "gyro" and axis_of(n) == "yaw"), None)
    across = next((n for n in beside if kind_of(measured, n) == "accelerometer" and axis_of(n) == "y"), None)
    if yaw is None or across is None or speed is None:
        return None
    time = measured.time(roll)
    edges = np.arange(time[0], time[-1], _LEAN_BLOCK)
    if edges.size < 2 * _LEAN_FEWEST:
        return None

    def means(at: np.ndarray, values: np.ndarray) -> np.ndarray:
        known = np.isfinite(values)
        total = np.concatenate([[0.0], np.cumsum(np.where(known, values, 0.0))])
        count = np.concatenate([[0], np.cumsum(known)])
        rows = np.searchsorted(at, edges)
        return np.diff(total[rows]) / np.where(np.diff(count[rows]) > 0, np.diff(count[rows]), np.nan)

    summed = np.nancumsum(measured[roll]) / measured.rate(roll)
    running = means(measured.time(speed), measured[speed])
    lean = means(measured.time(across), measured[across]) - running * means(measured.time(yaw), measured[yaw])
    rest, middle = means(time, summed) - lean / GRAVITY, 0.5 * (edges[1:] + edges[:-1])
    good = np.isfinite(rest)
    if good.sum() < _LEAN_FEWEST:
        return None
    rest, middle = rest[good], middle[good] - middle[good].mean()
    slope = float(rest @ middle / (middle @ middle))
    left = rest - rest.mean() - slope * middle
    return slope, math.sqrt(float(left @ left) / (rest.size - 2) / float(middle @ middle))


def _aside(measured: Measurements, channel: str, length: float, count: int) -> float:
    """Standard deviation by which a fitted path of `length` s and `count` positions ends aside, m: data sheet."""
    stated = sheet(measured, channel)
    white, slow, memory = (
        float(value) if isinstance(value := stated.get(key), int | float) else usual
        for key, usual in (("position_std", 1.0), ("drift_std", 2.0), ("drift_correlation_time", 60.0))
    )
    return math.hypot(white * math.sqrt(12 / count), slow * math.sqrt(2 * length / memory))


def still_mean(measured: Measurements, channel: str) -> float | None:
    """Mean of a channel while the vehicle stands; None where it does not for two seconds."""
    still, time = standing(measured), measured.time(channel)
    if still is None or still.size < 2:
        return None
    spacing = float(np.median(np.diff(still)))
    at = np.searchsorted(still, time).clip(1, still.size - 1)
    near = (still[at] - still[at - 1] < 2.5 * spacing) & (time >= still[0]) & (time <= still[-1])
    values = measured[channel][near]
    values = values[np.isfinite(values)]
    return float(values.mean()) if values.size > 2 * measured.rate(channel) else None


def _acceleration(measured: Measurements) -> float:
    """Mean change of speed, m/s2."""
    name = speed_channel(measured)
    if name is None:
        return 0.0
    values, time, part = measured[name], measured.time(name), max(2, round(measured.rate(name)))
    first, last = np.nanmedian(values[:part]), np.nanmedian(values[-part:])
    change = float(last - first) / max(1.0, float(time[-1] - time[0]))
    return change if math.isfinite(change) else 0.0


def _across(measured: Measurements) -> float:
    """Lateral specific force that curves may give, m/s2: what cant does not balance, 1.2 times for the roll of the
    bogie; without a curve by the yaw rate that of cross level.
    """
    yaw = next((name for name in measured if name.endswith("rate_yaw [rad/s]")), None)
    if yaw is None:
        return 1.2 * CANT_ROLL * GRAVITY
    time = measured.time(yaw)
    rate = np.nan_to_num(measured[yaw] - np.nanmedian(measured[yaw]))
    block = max(1, round(4 * measured.rate(yaw)))
    smooth = np.convolve(rate, np.ones(block) / block, mode="valid")
    heading = heading_rate(measured)
    turning = abs(heading[0]) > 5 * heading[1] + 0.003 if heading else abs(float(np.nanmean(measured[yaw]))) > 0.01
    curved = turning or (time.size > block and float(np.ptp(smooth)) > 0.01)
    return 1.2 * CANT_ROLL * GRAVITY if curved else 0.15
