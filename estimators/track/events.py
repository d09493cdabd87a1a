"""What the estimators of dips share: settings, and what a recording must have."""

from estimators.interface import Estimator
from estimators.speed.odometry import SpeedSource, has_speed
from railsim.measurements import Measurements
from railsim.spec import quantity


class EventEstimator(Estimator, frozen=True):
    """Base: distance from a speed source, curvature up to `cut_off`."""

    speed_source: SpeedSource = quantity("tachometer", unit="-", source="scenario: tachometer, or refined")
    slowest: float = quantity(2.0, unit="m/s", source="illustrative: gyro noise over speed", ge=0.5)
    cut_off: float = quantity(60.0, unit="Hz", source="illustrative: below half of 256 Hz", gt=5.0)

    def fits(self, measurements: Measurements) -> bool:
        """Whether the recording has every channel, and a speed."""
        return super().fits(measurements) and has_speed(measurements, self.speed_source)
