"""What the speed estimators share that compare both wheelsets' accelerations: settings, and the run over a record."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import pandas as pd

from estimators.interface import Estimate, Estimator
from estimators.speed.bogie_channels import Stepper, read, together
from estimators.speed.wheelset_filters import ACCELERATION, PITCH_RATE
from railsim.measurements import Measurements
from railsim.spec import quantity


class WheelsetCorrelation(Estimator, frozen=True):
    """Speed from the time after which the trailing wheelset's vertical acceleration is like the leading one's."""

    requires: ClassVar[tuple[str, ...]] = (ACCELERATION, PITCH_RATE)

    window: float = quantity(
        4.0, unit="s", source="illustrative; longer at low speed (Ward et al. 2011, section 5.2)", gt=0.2, le=60
    )
    low: float = quantity(
        1.0, unit="Hz", source="body bounce stays below; trial on tests/estimators/bogie_rig.py", gt=0.05, lt=50
    )
    slowest: float = quantity(3.0, unit="m/s", source="the travel time must lie well inside the window", gt=0.5)
    fastest: float = quantity(80.0, unit="m/s", source="above every conventional train", gt=5)
    floor: float = quantity(0.02, unit="m/s2", source="root mean square of MEMS noise after the inverse", gt=0)

    @abstractmethod
    def start(self, about: Mapping[str, Any], rate: float, forward: bool) -> Stepper:
        """Start a run.

        Parameters
        ----------
        about : as in a recording's about.json.
        rate : samples per second.
        forward : whether the bogie's longitudinal acceleration comes with the samples.

        Raises
        ------
        InputError : a vehicle parameter is missing, or the sampling cannot serve the settings.
        """

    def estimate(self, measurements: Measurements) -> Estimate:
        """Speed at every sample of the record, causal: the same numbers as `online`.

        Raises
        ------
        InputError : a channel or a vehicle parameter is missing, or the sampling cannot serve the settings.
        """
        self.need(measurements)
        grid = read(measurements)
        run = self.start(measurements.about, grid.rate, grid.has_forward)
        rows = run.advance(grid.acceleration, grid.pitch_rate, grid.forward)[grid.rows]
        series = pd.DataFrame(dict(zip(("time [s]", *run.columns), (grid.time, *rows.T), strict=True)))
        return Estimate(self.name, series, {"settings": self.model_dump(mode="json"), "rate [Hz]": grid.rate})

    def online(self, about: Mapping[str, Any], rate: float) -> Stepper:
        """Start a run; see `OnlineEstimator`. Where `about` states a sensor of it, samples also hold `FORWARD`."""
        return self.start(about, rate, together(about, rate))
