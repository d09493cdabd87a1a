"""How a wheelset moves sideways and turns, from sensors on it or across its suspension: filtered over the whole record.

Lateral position y comes from the path of the suspended mass (its accelerometer, integrated twice) less the length of
the lateral transducer, where both are there; else from the wheelset's own accelerometer, from which gravity's share is
taken off by the roll gyro where there is one. Yaw is the integral of the yaw gyro. Integration needs a longest
wavelength; the same high-pass must be applied to whatever the motion is compared with (`MotionBand.filter`). On
straight track the wheelset follows longer waves of the rails, so that its shift relative to them has almost nothing
there.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from estimators.interface import Missing
from estimators.signals.bands import ORDER, transform
from estimators.speed.odometry import channel_speeds, speed_channel, states_speed
from estimators.vehicle.parameters import numbers
from railsim.constants import GRAVITY
from railsim.data_sheet import data_sheet
from railsim.errors import InputError
from railsim.measurements import Measurements

YAW, ROLL = "wheelset1.rate_yaw [rad/s]", "wheelset1.rate_roll [rad/s]"
SIDE = "wheelset1.acceleration_y [m/s2]"
BODY, TRANSDUCER = "body.acceleration_y [m/s2]", "suspension.displacement [m]"
SPEEDS = ("wheelset1.speed [m/s]", "wheelset1.wheel_speed [rad/s]")
NO_WHEEL_SPEED = (
    f"the wheelset's speed: add a tachometer ('{SPEEDS[0]}'), or name another channel by --speed-source CHANNEL"
)
"""What is missing where no such speed is there, and how to give it."""
GAP = 0.1  # s; longer gaps make the samples around them invalid
NEEDED = ("wheel_radius", "half_gauge", "wheelset_yaw_inertia", "yaw_stiffness", "yaw_damping")


@dataclass(frozen=True)
class MotionBand:
    """Zero-phase band-pass over time.

    Attributes
    ----------
    lowest, highest : frequencies at half amplitude, Hz. rate : of the samples, Hz.
    """

    lowest: float
    highest: float
    rate: float

    def filter(self, values: np.ndarray, derivative: int = 0, shift: float = 0.0) -> np.ndarray:
        """`values` (n,) in the band, differentiated (or, negative, integrated) as often as told, `shift` s earlier."""

        def gain(omega: np.ndarray) -> np.ndarray:
            return _gain(self, omega.tobytes(), derivative, shift)

        return transform(values, 1.0 / self.rate, gain, 2.0 / self.lowest, detrend=True)


@lru_cache(maxsize=8)
def _gain(band: MotionBand, frequencies: bytes, derivative: int, shift: float) -> np.ndarray:
    """Response of a filter at angular frequencies, rad/s, float64; a search asks for the same again and again."""
    omega = np.frombuffer(frequencies)
    low = (omega / (2.0 * np.pi * band.lowest)) ** ORDER
    response = low / (1.0 + low) / (1.0 + (omega / (2.0 * np.pi * band.highest)) ** ORDER)
    response = response.astype(complex)
    response[1:] *= (1j * omega[1:]) ** derivative * np.exp(1j * omega[1:] * shift)
    response.setflags(write=False)
    return response


@dataclass(frozen=True)
class WheelsetMotion:
    """Motion over time, all shapes (n,), in the band; `speed` and `distance` (since the first sample) as they are.

    y (m, left +), yaw (rad, to the left +) and their rates; roll (rad, left side up +), zero without a roll gyro.
    """

    time: np.ndarray
    speed: np.ndarray
    distance: np.ndarray
    y: np.ndarray
    y_rate: np.ndarray
    yaw: np.ndarray
    yaw_rate: np.ndarray
    yaw_acceleration: np.ndarray
    roll: np.ndarray
    valid: np.ndarray
    band: MotionBand


def missing_motion(measurements: Measurements) -> Missing:
    """What the wheelset's motion needs and the recording does not have."""
    gyro = () if YAW in measurements else (YAW,)
    lateral = SIDE in measurements or (BODY in measurements and TRANSDUCER in measurements)
    others = () if lateral else (f"'{SIDE}', or '{BODY}' with '{TRANSDUCER}': add those sensors",)
    return Missing(gyro, others=others) + missing_wheel_speed(measurements)


def missing_wheel_speed(measurements: Measurements) -> Missing:
    """What is missing where neither the tachometer of wheelset 1 nor a stated source gives a speed."""
    there = any(name in measurements for name in SPEEDS) or states_speed(measurements)
    return Missing() if there else Missing(others=(NO_WHEEL_SPEED,))


def wheelset_motion(measurements: Measurements, longest: float, highest: float) -> WheelsetMotion:
    """Motion of wheelset 1.

    Parameters
    ----------
    longest : wavelength in m, at the mean speed, above which nothing is kept. highest : frequency in Hz.

    Raises
    ------
    InputError : a channel is missing, the vehicle stands, or the record is too short for the longest wavelength.
    """
    if missing := missing_motion(measurements):
        raise InputError(f"the wheelset's motion needs {missing.text()}")
    numbers(measurements.vehicle, NEEDED)
    time, rate = measurements.time(YAW), measurements.rate(YAW)
    speed = wheelset_speed(measurements, time)
    if float(np.mean(speed)) < 1.0:
        raise InputError(f"mean speed {np.mean(speed):.2g} m/s: the wheelset must roll; choose a part with movement")
    band = MotionBand(float(np.mean(speed)) / longest, min(highest, 0.45 * rate), rate)
    if time[-1] - time[0] < 3.0 / band.lowest:
        raise InputError(
            f"{time[-1] - time[0]:.3g} s of record are too short for waves of {longest:g} m; "
            f"give {3.0 / band.lowest:.3g} s or more"
        )
    gyro, valid = filled(measurements, YAW, time)
    late = data_sheet(measurements.about, YAW).delay
    yaw, yaw_rate, turning = (band.filter(gyro, order, late) for order in (-1, 0, 1))
    roll = np.zeros(len(time))
    if ROLL in measurements:
        rolling, good = filled(measurements, ROLL, time)
        roll, valid = band.filter(rolling, -1, data_sheet(measurements.about, ROLL).delay), valid & good
    y, y_rate, good = _lateral(measurements, band, time, roll)
    ends = 1.0 / band.lowest
    valid = valid & good & (time > time[0] + ends) & (time < time[-1] - ends)
    distance = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
    return WheelsetMotion(time, speed, distance, y, y_rate, yaw, yaw_rate, turning, roll, valid, band)


def wheelset_speed(measurements: Measurements, time: np.ndarray) -> np.ndarray:
    """Running speed at `time`, m/s: by the tachometer and the nominal wheel radius, smoothed over 0.5 s, or by the
    source that the recording states.

    Raises
    ------
    InputError : neither tachometer nor another source of speed.
    """
    name = speed_channel(measurements) if states_speed(measurements) else None
    name = name or next((one for one in SPEEDS if one in measurements), None)
    if name is None:
        raise InputError(f"the wheelset's motion needs {NO_WHEEL_SPEED}")
    if name not in SPEEDS:
        speeds = channel_speeds(measurements)
        known = np.isfinite(speeds.speed)
        return np.interp(time, speeds.time[known], speeds.speed[known])
    values = np.array(measurements[name])
    if name == SPEEDS[1]:
        values = values * nominal(measurements, "wheel_radius")
    good = np.isfinite(values)
    count = max(1, round(0.5 * measurements.rate(name)))
    padded = np.pad(np.interp(measurements.time(name), measurements.time(name)[good], values[good]), count, "edge")
    smooth = np.convolve(padded, np.ones(count) / count, "same")[count:-count]
    return np.interp(time, measurements.time(name), smooth)


def nominal(measurements: Measurements, name: str) -> float:
    """A nominal parameter of the vehicle.

    Raises
    ------
    InputError : about.json does not give it.
    """
    value = measurements.vehicle.get(name)
    if not isinstance(value, int | float):
        raise InputError(f"about.json gives no '{name}' of the vehicle; add it to the nominal parameters")
    return float(value)


def filled(measurements: Measurements, name: str, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A channel at `time` with gaps bridged by lines, and where no gap longer than `GAP` is; shapes (n,)."""
    values, own = measurements[name], measurements.time(name)
    good = np.isfinite(values)
    if np.count_nonzero(good) < 2:
        raise InputError(f"channel '{name}' holds nothing; leave it out")
    nearest = np.searchsorted(own[good], time)
    before, after = np.maximum(nearest - 1, 0), np.minimum(nearest, np.count_nonzero(good) - 1)
    bridged = own[good][after] - own[good][before]
    return np.interp(time, own[good], values[good]), bridged <= GAP


def _lateral(
    measurements: Measurements, band: MotionBand, time: np.ndarray, roll: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """y, its rate, and where they are valid."""
    if BODY in measurements and TRANSDUCER in measurements:
        force, good = filled(measurements, BODY, time)
        length, present = filled(measurements, TRANSDUCER, time)
        first, second = (data_sheet(measurements.about, name).delay for name in (BODY, TRANSDUCER))
        parts = [(force, first, -2, 1.0), (length, second, 0, -1.0)]
        y, rate = (sum(sign * band.filter(v, order + k, late) for v, late, order, sign in parts) for k in (0, 1))
        return np.asarray(y), np.asarray(rate), good & present
    force, good = filled(measurements, SIDE, time)
    late = data_sheet(measurements.about, SIDE).delay
    y, rate = (band.filter(force, order, late) - band.filter(GRAVITY * roll, order) for order in (-2, -1))
    return y, rate, good
