"""Vertical alignment and curvature from the bogie's pitch rate: equation z'' = -pitch rate / speed."""

from collections.abc import Iterable
from functools import partial
from typing import ClassVar

import numpy as np

from estimators.interface import Estimate
from estimators.signals.bands import transform
from estimators.speed.odometry import Odometry
from estimators.track.chain_error import Chain, Reading, vertical_chain
from estimators.track.geometry import TrackEstimator, geometry, turning
from estimators.track.slow_motions import stated
from estimators.vehicle.state_space import Output
from estimators.vehicle.vertical import NEEDED_IN_PITCH, pitch_inverse
from railsim.measurements import Measurements
from railsim.spec import quantity

RATE = "bogie.rate_pitch [rad/s]"
MEMORY = 30.0  # m; the inverse of the chord rings no longer


class AlignmentVertical(TrackEstimator, frozen=True):
    """Vertical alignment from the pitch rate of the bogie and the speed.

    Pitch rate over speed is curvature. It is integrated twice on a grid of 0.125 m; long waves are cut with zero phase.
    This is the chain of Ward et al. 2011, section 3.2 (reference [10] there). The bogie's slope is that of the chord
    between its wheelsets, which shows a wave k only as sin(k Lb) / (k Lb) of itself, and the primary suspension filters
    it; `compensate` takes both out with the vehicle's nominal parameters.
    """

    requires: ClassVar[tuple[str, ...]] = (RATE,)
    nearby: ClassVar[bool] = True

    compensate: bool = quantity(False, unit="-", source="the paper's chain does without")
    regularisation: float = quantity(
        1e-3, unit="-", source="noise over signal in curvature: MEMS gyro on ERRI B176 low at 20 m/s, 3 m waves", gt=0.0
    )

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """What the vehicle's model needs."""
        return NEEDED_IN_PITCH if self.compensate else ()

    def estimate(self, measurements: Measurements) -> Estimate:
        """Alignment over the whole record.

        Raises
        ------
        InputError : no pitch rate, no speed, or no movement.
        """
        odometry = self.odometry(measurements)
        curvature, good = self._curvature(measurements, odometry)
        columns = geometry("vertical", curvature, good, odometry, self.cut, integrate=2)
        felt = {RATE: lambda rows: self._curvature(measurements, odometry, rows)[0]}
        columns |= stated("vertical", columns, self._chain(measurements), felt, measurements, odometry, good, 2)
        columns["vertical_curvature [1/m]"] = np.where(good, curvature, np.nan)
        return self.result(odometry, columns, good)

    def _chain(self, measurements: Measurements) -> Chain | None:
        def gain(speed: float, k: np.ndarray) -> list[np.ndarray]:
            height = 1.0 / (speed * k**2)
            if not self.compensate:
                return [height]
            return [height * pitch_inverse(measurements.vehicle).whole(k * speed) * self._chord(measurements, k)]

        return vertical_chain(measurements, [Reading((RATE,), Output("rate"))], gain)

    def _curvature(
        self, measurements: Measurements, odometry: Odometry, samples: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """From the pitch rate, or from samples in its place, rad/s, in rows."""
        if not self.compensate:
            rate, good = turning(measurements, RATE, odometry, samples=samples)
            return np.negative(rate, out=rate), good
        inverse = pitch_inverse(measurements.vehicle).whole
        rate, good = turning(measurements, RATE, odometry, inverse, samples=samples)
        seen = np.where(good, -rate, np.nan)
        return transform(seen, odometry.spacing, partial(self._chord, measurements), MEMORY, detrend=False), good

    def _chord(self, measurements: Measurements, k: np.ndarray) -> np.ndarray:
        """Slope of the track over that of the chord between the wheelsets."""
        chord = np.sinc(k * measurements.vehicle["semi_wheelbase"] / np.pi)
        return chord / (chord**2 + self.regularisation)
