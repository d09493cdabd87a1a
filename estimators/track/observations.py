"""What the fused estimate reads: bogie sensors on the grid of distance, each with what its data sheet says of it."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from estimators.signals.bands import stretches, transform
from estimators.signals.curves import CURVED
from estimators.speed.odometry import Odometry
from estimators.vehicle.state_space import Output
from railsim.constants import GRAVITY
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements

LEAST_DENSITY = 1e-7  # a sensor without any stated noise is taken to have this one
LEAST_BIAS = 1e-6
CROSSOVER = 60.0  # m; roll comes from the lateral acceleration above this wavelength, from the roll gyro below it
BRIDGE_ONE, BRIDGE_MORE = 20.0, 4.0
"""m marked as lost, of which 3 m are the resampling's: over longer gaps of one, or of more, of lateral accelerometer,
roll and yaw gyro the attitude is not known. Trial on straight_erri_low at 20 m/s: where D3 is more off than stated."""
CURVE_REACH = 60.0  # m; the error in a transition is felt this far
LOAD = 0.3
"""Share of a lean in curves that the load leaves open, 30 to 45 % of a body in a crowded coach (EN 15663). A fused
cross level states it since bogie sensors alone had failed on curve_r400.
"""
CURVE = 20.0  # m; yaw rates of longer wavelengths turn about the vertical, shorter ones about the bogie's own axis


@dataclass(frozen=True)
class Observation:
    """One sensor (or the mean or difference of two) over the steps of the grid.

    Attributes
    ----------
    name : of the channel.
    output : what it measures of the plane.
    values : mean over the step that ends at each place, NaN where there is none, shape (n,).
    density, bias, drift, drift_time, scale : as in `SensorErrors`; scale is the factor's standard deviation.
    tilt : standard deviations of two angles between what is taken to be its axis and where that really points, rad.
    turning : what it reads per radian of each, shape (n, 2).
    late : m that its values come after those of other readings, being means over twice that more; see `delay`.
    """

    name: str
    output: Output
    values: np.ndarray
    density: float
    bias: float
    drift: float
    drift_time: float
    scale: float
    tilt: tuple[float, float]
    turning: np.ndarray
    late: float = 0.0

    def delay(self, wavenumber: np.ndarray) -> np.ndarray:
        """Its values over those that it would have with the others, complex, shape of the wavenumbers (rad/m)."""
        return np.sinc(wavenumber * self.late / np.pi) * np.exp(-1j * wavenumber * self.late)


@dataclass(frozen=True)
class Attitude:
    """Motion across the vertical plane, over the grid, shapes (n,).

    Attributes
    ----------
    roll : rad, left side up; `roll_std` : standard deviation of its constant part.
    curving_rate : yaw rate about the vertical, rad/s; `curving_rate_std` : standard deviation of its constant part.
    roll_rate, yaw_rate, side : as measured, rad/s, rad/s, m/s2.
    bridged : where what was lost of these reaches, a gap and the memory of the roll on either side.
    """

    roll: np.ndarray
    curving_rate: np.ndarray
    roll_rate: np.ndarray
    yaw_rate: np.ndarray
    side: np.ndarray
    roll_std: float
    curving_rate_std: float
    bridged: np.ndarray


def observation(
    measurements: Measurements,
    odometry: Odometry,
    name: str,
    output: Output,
    correction: np.ndarray | None = None,
    turning: tuple[np.ndarray, np.ndarray] | None = None,
    typical: float = 0.0,
    roll_std: float = 0.0,
    mounting: float | None = None,
    late: float = 0.0,
) -> Observation:
    """A channel on the grid.

    Parameters
    ----------
    correction : is taken off, shape (n,), at the places of the grid.
    turning : motions across the sensor's axis, shapes (n,), of which it shows a little by its mounting; the first also
        by an error of the roll, of which `roll_std` is the standard deviation, rad.
    typical : what the sensor shows at rest, unit of the channel; its scale error makes a bias of that.
    late : how far before the middle of the step its values stand, m.
    mounting : standard deviation of the share of `turning` that is seen; that of the data sheet where not given.
    """
    values, valid = odometry.channel(measurements, name, ahead=odometry.spacing / 2 + late)
    sheet = data_sheet(measurements.about, name)
    scale = sheet.error("scale_error_std")
    mounting = sheet.error("misalignment_std") if mounting is None else mounting
    correction = np.zeros(len(odometry.s)) if correction is None else correction
    return Observation(
        name,
        output,
        np.where(valid, values - correction - typical, np.nan),
        sheet.density(measurements.rate(name)) + LEAST_DENSITY,
        float(np.hypot(sheet.error("bias_std"), typical * scale)) + LEAST_BIAS,
        sheet.error("bias_instability") + LEAST_DENSITY,
        sheet.error("bias_correlation_time", 100.0),
        scale,
        _tilt(turning, float(np.hypot(mounting, roll_std)), mounting),
        np.zeros((len(odometry.s), 2)) if turning is None else np.stack(turning, axis=1),
        late,
    )


def _tilt(turning: tuple[np.ndarray, np.ndarray] | None, first: float, second: float) -> tuple[float, float]:
    """Standard deviations of the two angles, 0 where there is no motion that would show them."""
    if turning is None:
        return 0.0, 0.0
    return first * float(turning[0].any()), second * float(turning[1].any())


def combined(
    left: Observation, right: Observation, half_difference: bool, step: float, skew: float = 0.0
) -> Observation:
    """(left + right) / 2, or (left - right) / 2, of two sensors alike.

    Parameters
    ----------
    step : of the grid, s. skew : standard deviation of the share that each shows of motions across its axis, of the
        size of those along it. What is unlike in the two sensors' scales and axes shows some of the other combination,
        which is taken as noise.
    """
    sign = -1.0 if half_difference else 1.0
    share = np.sqrt(0.5)
    other = (left.values - sign * right.values) / 2.0
    shown = float(np.nanstd(other)) if np.isfinite(other).any() else 0.0
    crossed = share * np.hypot(left.scale, skew) * shown * np.sqrt(2.0 * step)
    density = share * np.sqrt((left.density**2 + right.density**2) / 2.0)
    return Observation(
        f"{left.name} and {right.name}",
        left.output,
        (left.values + sign * right.values) / 2.0,
        float(np.hypot(density, crossed)),
        share * left.bias,
        share * left.drift,
        left.drift_time,
        share * left.scale,
        left.tilt,
        left.turning,
        left.late,
    )


def attitude(measurements: Measurements, odometry: Odometry, sensor: str = "bogie") -> Attitude | None:
    """Roll and yaw rate in curves; None without lateral accelerometer, roll and yaw gyro."""
    names = [f"{sensor}.acceleration_y [m/s2]", f"{sensor}.rate_roll [rad/s]", f"{sensor}.rate_yaw [rad/s]"]
    if not all(name in measurements for name in names):
        return None
    readings = [odometry.channel(measurements, name) for name in names]
    side, roll_rate, yaw_rate = (_filled(*one) for one in readings)
    slow = (side - odometry.speed * yaw_rate) / GRAVITY
    corner = 2 * np.pi / CROSSOVER

    def low(k: np.ndarray, corner: float = corner) -> np.ndarray:
        return 1.0 / (1.0 + (k / corner) ** 4)

    def integrated(k: np.ndarray) -> np.ndarray:
        gain = np.zeros(len(k), dtype=complex)
        gain[1:] = (1.0 - low(k[1:])) / (1j * k[1:])
        return gain

    roll = transform(slow, odometry.spacing, low, 3 * CROSSOVER, detrend=False)
    roll += transform(roll_rate / odometry.speed, odometry.spacing, integrated, 3 * CROSSOVER, detrend=False)
    design = transform(yaw_rate, odometry.spacing, lambda k: low(k, 2 * np.pi / CURVE), 3 * CURVE, detrend=False)
    roll_std, curving_rate_std = (
        data_sheet(measurements.about, name).error("bias_std") for name in (names[0], names[2])
    )
    lost = np.sum([odometry.valid & ~valid for _, valid in readings], axis=0)
    gaps = _gaps(lost > 0, BRIDGE_ONE / odometry.spacing) | _gaps(lost > 1, BRIDGE_MORE / odometry.spacing)
    bridged = maximum_filter1d(gaps, 2 * round(CROSSOVER / odometry.spacing) + 1)
    return Attitude(roll, design, roll_rate, yaw_rate, side, roll_std / GRAVITY, curving_rate_std, bridged)


def curved(moved: Attitude, odometry: Odometry) -> np.ndarray:
    """Where the track is curved, and not only the yaw gyro biased."""
    count = max(1, round(CURVE_REACH / odometry.spacing))
    curvature = np.abs(uniform_filter1d(moved.curving_rate / odometry.speed, count))
    return curvature > CURVED + 2.0 * moved.curving_rate_std / odometry.speed


def beyond_straight(values: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """Values less their median outside curves, which is the sensor's bias; as they are where all is curve."""
    return values if curve.all() else values - np.median(values[~curve])


def _gaps(lost: np.ndarray, longest: float) -> np.ndarray:
    """What is lost over more than `longest` samples; not what is lost at an end."""
    gaps = np.zeros(len(lost), dtype=bool)
    for first, last in stretches(lost):
        gaps[first:last] = first > 0 and last < len(lost) and last - first > longest
    return gaps


def _filled(values: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Values with a line through what is not valid."""
    if not valid.any():
        return np.zeros_like(values)
    places = np.arange(len(values))
    return np.interp(places, places[valid], values[valid])
