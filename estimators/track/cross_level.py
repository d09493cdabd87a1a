"""Cross level, absolute cant and twist from the bogie's roll."""

from collections.abc import Callable
from typing import ClassVar

import numpy as np

from estimators.interface import Estimate
from estimators.signals.bands import transform
from estimators.signals.frequency_response import filter_time
from estimators.speed.odometry import Odometry
from estimators.track.geometry import CANT_BASE, TrackEstimator, by_speed, filled, geometry, turning, without_bias
from estimators.vehicle.roll_plane import over_track
from railsim.constants import GRAVITY
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements
from railsim.spec import quantity

ROLL, YAW = "bogie.rate_roll [rad/s]", "bogie.rate_yaw [rad/s]"
LATERAL = "bogie.acceleration_y [m/s2]"
MEMORY = 60.0  # m; the body's roll has decayed


class CrossLevel(TrackEstimator, frozen=True):
    """Roll rate over speed, integrated, is the roll of the track; cross level is -1.5 m times that.

    The bogie rolls by the mean of its wheelsets, which does not show waves of four semi wheelbases, through the primary
    suspension; `compensate` takes that out as far as can be, with the vehicle's nominal parameters.

    Absolute roll: a lateral accelerometer feels V yaw rate + g roll, which holds over long times; the roll rate holds
    over short ones. Both are joined by complementary filters without phase at `crossover`. Twist over `base` is the
    mean slope of cant, straight from the roll rate, so that it holds the ramps of transitions too.
    """

    requires: ClassVar[tuple[str, ...]] = (ROLL,)

    compensate: bool = quantity(False, unit="-", source="the paper's chain does without")
    regularisation: float = quantity(
        0.01, unit="-", source="power of what the model leaves over that of cross level; straight_erri_low", gt=0.0
    )
    base: float = quantity(3.0, unit="m", source="EN 13848-1: twist base, commonly 3 m", ge=0.5, le=20.0)
    crossover: float = quantity(
        20.0, unit="s", source="MEMS gyro drift over accelerometer bias; illustrative", gt=1.0, le=1000.0
    )

    def estimate(self, measurements: Measurements) -> Estimate:
        """Cross level and twist over the whole record, and cant where lateral acceleration and yaw rate are there.

        Raises
        ------
        InputError : no roll rate, no speed, or no movement.
        """
        odometry = self.odometry(measurements)
        rolling, good = turning(measurements, ROLL, odometry)
        if self.compensate:
            seen = np.where(good, rolling, np.nan)
            rolling = by_speed([seen], odometry, lambda speed: [self._inverse(measurements, speed)], MEMORY)
        columns = geometry("cross_level", -CANT_BASE * rolling, good, odometry, self.cut, integrate=1)
        slope = np.where(good, -CANT_BASE * rolling, np.nan)
        columns["twist [m/m]"] = transform(
            slope, odometry.spacing, lambda k: np.sinc(k * self.base / (2.0 * np.pi)), self.base, detrend=False
        )
        if {LATERAL, YAW} <= set(measurements.channels) and self._together(measurements):
            roll = self._absolute(measurements, odometry)
            values, known = odometry.channel(measurements, ROLL, values=roll)
            columns["cant [m]"] = np.where(good & known, -CANT_BASE * np.sin(values), np.nan)
        return self.result(odometry, columns, good, **{"twist_base [m]": self.base})

    def _inverse(self, measurements: Measurements, speed: float) -> Callable[[np.ndarray], np.ndarray]:
        def gain(k: np.ndarray) -> np.ndarray:
            follows = over_track(measurements.vehicle, speed, k)
            return np.conj(follows) / (np.abs(follows) ** 2 + self.regularisation)

        return gain

    def _together(self, measurements: Measurements) -> bool:
        return len(measurements.time(LATERAL)) == len(measurements.time(ROLL)) == len(measurements.time(YAW))

    def _absolute(self, measurements: Measurements, odometry: Odometry) -> np.ndarray:
        """Roll of the bogie against the horizon at the samples of the roll rate, rad."""
        time, rate = measurements.time(ROLL), measurements.rate(ROLL)
        speed = np.interp(time - data_sheet(measurements.about, YAW).delay, odometry.knots, odometry.speed_at_knots)
        yaw = filled(without_bias(measurements[YAW], time, odometry, still_only=True))
        level = (filled(measurements[LATERAL]) - speed * yaw) / GRAVITY
        corner = 2.0 * np.pi / self.crossover
        slow = filter_time(level, rate, lambda w: 1.0 / (1.0 + (w / corner) ** 4))
        fast = filter_time(
            filled(without_bias(measurements[ROLL], time, odometry)), rate, lambda w: _integral(w, corner)
        )
        return slow + fast


def _integral(omega: np.ndarray, corner: float) -> np.ndarray:
    """1 / (i w) times what the slow path leaves: w^4 / (w^4 + corner^4)."""
    return -1j * omega**3 / (omega**4 + corner**4)
