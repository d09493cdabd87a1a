"""Rate gyro: absolute angular velocity of a body about its own axes."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from railsim.sensors.errors import SensorErrors
from railsim.sensors.inertial import InertialSensor
from railsim.spec import quantity
from railsim.truth import Truth

MEMS = SensorErrors(
    range=4.36,  # MPU-6050 product specification: 250 degrees/s
    resolution=1.33e-4,  # same: 131 LSB per degree/s
    noise_density=8.7e-5,  # same: 0.005 degrees/s/sqrt(Hz)
    bias_std=2e-3,  # illustrative, after calibration
    bias_instability=5e-5,  # illustrative, about 10 degrees/h
    scale_error_std=0.003,  # illustrative, after calibration
    misalignment_std=0.005,  # illustrative, about 0.3 degrees of mounting
    bandwidth=100.0,  # illustrative, for samples at 256 Hz
)
INDUSTRIAL = SensorErrors(
    range=8.73,  # ADIS16475-2 data sheet, Rev. D: 500 degrees/s
    resolution=1e-6,  # illustrative: 32-bit output, its last bits carry no information
    noise_density=4.4e-5,  # same data sheet: angle random walk 0.15 degrees/sqrt(h) = 0.0025 degrees/s/sqrt(Hz)
    bias_std=1e-3,  # illustrative, after calibration
    bias_instability=1e-5,  # same data sheet: 2 degrees/h in run (first variant)
    scale_error_std=0.002,  # illustrative, after calibration
    misalignment_std=0.005,  # illustrative, about 0.3 degrees of mounting
    bandwidth=100.0,  # illustrative, for samples at 256 Hz
)


class Gyro(InertialSensor, frozen=True):
    """Angular velocity about the sensor's axes, rad/s: roll to the left side up, pitch nose down, yaw to the left."""

    axes: tuple[str, ...] = quantity(("roll", "pitch", "yaw"), unit="-", source="scenario", min_length=1)

    axis_names: ClassVar[tuple[str, str, str]] = ("roll", "pitch", "yaw")
    quantity_name: ClassVar[str] = "rate"
    unit: ClassVar[str] = "rad/s"
    presets: ClassVar[Mapping[str, SensorErrors]] = MappingProxyType({"mems": MEMS, "industrial": INDUSTRIAL})

    def component(self, truth: Truth, axis: int) -> np.ndarray:
        """Angular velocity along one body axis; the place on the body does not matter."""
        channel = f"{self.body}.angular_velocity_{'xyz'[axis]} [rad/s]"
        self.need(truth, channel)
        return truth[channel]
