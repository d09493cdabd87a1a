"""Short waves of each rail from the accelerometers on both axleboxes of the leading wheelset."""

from typing import ClassVar

import numpy as np

from estimators.interface import Estimate
from estimators.track.geometry import CANT_BASE, TrackEstimator, filled, geometry, number, rails
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements
from railsim.spec import quantity

LEFT, RIGHT = "axlebox1_left.acceleration_z [m/s2]", "axlebox1_right.acceleration_z [m/s2]"


class AxleboxProfile(TrackEstimator, frozen=True):
    """Vertical accelerations of the axleboxes over the square of speed, twice integrated in space.

    The wheelset is rigid between its axleboxes, so their mean is the mean of the rails and their difference its roll.
    A range of 100 g leaves noise that buries long waves (Ward et al. 2011, section 3.1); `cut` is therefore short.
    """

    requires: ClassVar[tuple[str, ...]] = (LEFT, RIGHT)

    cut: float = quantity(25.0, unit="m", source="long edge of D1, EN 13848-1", gt=1.0, le=300.0)

    def estimate(self, measurements: Measurements) -> Estimate:
        """Profile of both rails over the whole record.

        Raises
        ------
        InputError : a channel is missing, no speed, no movement, or a vehicle parameter is not given.
        """
        odometry = self.odometry(measurements)
        arm = number(measurements, "semi_wheelbase")
        speed = np.interp(odometry.s - arm, odometry.s, odometry.speed)
        curvature, present = [], np.ones(len(odometry.s), dtype=bool)
        for name in (LEFT, RIGHT):
            raw = filled(measurements[name])
            acceleration, good = odometry.channel(measurements, name, arm, raw - float(np.mean(raw)))
            curvature.append(acceleration / speed**2)
            present &= good
        apart = data_sheet(measurements.about, LEFT).position[1] - data_sheet(measurements.about, RIGHT).position[1]
        apart = apart or 2.0 * number(measurements, "primary_half_spacing")
        left, right = curvature
        vertical = geometry("vertical", (left + right) / 2.0, present, odometry, self.cut, integrate=2)
        level = geometry("cross_level", (right - left) * CANT_BASE / apart, present, odometry, self.cut, integrate=2)
        return self.result(odometry, vertical | level | rails(vertical, level), present)
