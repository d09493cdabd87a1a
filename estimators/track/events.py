"""What the estimators of dips share: settings, and what a recording must have."""

from collections.abc import Iterable

from estimators.interface import Estimator, Missing
from estimators.speed.odometry import SpeedSource, missing_speed
from estimators.track.curvature import needed_parameters
from railsim.measurements import Measurements
from railsim.spec import quantity


class EventEstimator(Estimator, frozen=True):
    """Base: distance from a speed source, curvature up to `cut_off`."""

    speed_source: SpeedSource = quantity("tachometer", unit="-", source="scenario: tachometer, or refined")
    slowest: float = quantity(2.0, unit="m/s", source="illustrative: gyro noise over speed", ge=0.5)
    cut_off: float = quantity(60.0, unit="Hz", source="illustrative: below half of 256 Hz", gt=5.0)

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """What the vehicle's model needs."""
        return needed_parameters(measurements)

    def missing(self, measurements: Measurements) -> Missing:
        """What is needed and not there, a speed among it."""
        return super().missing(measurements) + missing_speed(measurements, self.speed_source)
