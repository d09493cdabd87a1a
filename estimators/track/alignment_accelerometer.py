"""Vertical alignment from a bogie accelerometer, in space or in time: what pitch-rate alignment is compared with."""

from typing import ClassVar, Literal

import numpy as np

from estimators.interface import Estimate
from estimators.signals.bands import ORDER
from estimators.signals.frequency_response import filter_time
from estimators.speed.odometry import Odometry
from estimators.track.geometry import TrackEstimator, filled, geometry
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements
from railsim.spec import quantity

PAPER = "Ward et al. 2011, section 3.1"


class AlignmentAccelerometer(TrackEstimator, frozen=True):
    """Vertical acceleration twice integrated, the path of the bogie at the sensor's place.

    In space: acceleration over the square of speed is curvature, as with a gyro. In time: integrated with a high pass
    whose corner is the median speed over `cut`, then put on the grid. Where on the bogie the sensor stands matters.
    """

    requires: ClassVar[tuple[str, ...]] = ("bogie.acceleration_z [m/s2]",)

    sensor: str = quantity("bogie", unit="name of the accelerometer", source=PAPER, pattern=r"^\w+$")
    domain: Literal["space", "time"] = quantity("space", unit="-", source=PAPER)

    def needed(self) -> tuple[str, ...]:
        """The vertical channel of `sensor`."""
        return (f"{self.sensor}.acceleration_z [m/s2]",)

    def estimate(self, measurements: Measurements) -> Estimate:
        """Alignment over the whole record.

        Raises
        ------
        InputError : no such accelerometer, no speed, or no movement.
        """
        odometry = self.odometry(measurements)
        name = self.needed()[0]
        ahead = data_sheet(measurements.about, name).position[0]
        raw = filled(measurements[name])
        raw = raw - float(np.mean(raw))
        if self.domain == "space":
            acceleration, good = odometry.channel(measurements, name, ahead, raw)
            curvature = acceleration / odometry.speed**2
            columns = geometry("vertical", curvature, good, odometry, self.cut, integrate=2)
            columns["vertical_curvature [1/m]"] = np.where(good, curvature, np.nan)
        else:
            height = filter_time(raw, measurements.rate(name), self._integral(odometry))
            values, good = odometry.channel(measurements, name, ahead, height)
            columns = geometry("vertical", values, good, odometry, self.cut)
        return self.result(odometry, columns, good)

    def _integral(self, odometry: Odometry):
        """-1 / w^2 above the corner."""
        speed = float(np.median(odometry.speed[odometry.valid])) if odometry.valid.any() else odometry.slowest
        corner = 2.0 * np.pi * speed / max(self.cut, 150.0)

        def gain(omega: np.ndarray) -> np.ndarray:
            safe = np.maximum(omega, 1e-9)
            power = (safe / corner) ** ORDER
            return -power / (1.0 + power) / safe**2

        return gain
