"""Accelerometer: specific force at a place on a body, gravity included."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from railsim.sensors.errors import SensorErrors
from railsim.sensors.inertial import InertialSensor
from railsim.spec import quantity
from railsim.truth import Truth

MEMS = SensorErrors(
    range=100.0,  # ADXL356/ADXL357 data sheet, Rev. A (2020): 10 g
    resolution=1.9e-4,  # same: 51200 LSB/g
    noise_density=7.4e-4,  # same: 75 ug/sqrt(Hz)
    bias_std=0.05,  # illustrative, after calibration
    bias_instability=2e-4,  # illustrative
    scale_error_std=0.003,  # illustrative, after calibration
    misalignment_std=0.005,  # illustrative, about 0.3 degrees of mounting
    bandwidth=100.0,  # illustrative, for samples at 256 Hz
)
INDUSTRIAL = SensorErrors(
    range=78.5,  # ADIS16475 data sheet, Rev. D: 8 g
    resolution=1e-5,  # illustrative: 32-bit output, its last bits carry no information
    noise_density=2.3e-4,  # illustrative of this class: 23 ug/sqrt(Hz)
    bias_std=0.02,  # illustrative, after calibration
    bias_instability=3.5e-5,  # ADIS16475 data sheet: 3.6 ug in run
    scale_error_std=0.002,  # illustrative, after calibration
    misalignment_std=0.005,  # illustrative, about 0.3 degrees of mounting
    bandwidth=100.0,  # illustrative, for samples at 256 Hz
)
AXLEBOX = SensorErrors(
    range=1000.0,  # Ward et al. 2011, section 3.1: 100 g
    resolution=0.031,  # illustrative, 16 bits over the range
    noise_density=0.01,  # illustrative, about 1 mg/sqrt(Hz)
    bias_std=0.5,  # illustrative
    scale_error_std=0.01,  # illustrative
    misalignment_std=0.01,  # illustrative
    bandwidth=400.0,  # illustrative, for samples at 1024 Hz
)


class Accelerometer(InertialSensor, frozen=True):
    """Specific force along the sensor's axes, m/s2; at rest on level track z shows +9.81.

    An axlebox accelerometer stands on `wheelset1` or `wheelset2` at (0, +-half the spring spacing, 0); it does not spin
    with the axle.
    """

    axes: tuple[str, ...] = quantity(("x", "y", "z"), unit="-", source="scenario", min_length=1)

    axis_names: ClassVar[tuple[str, str, str]] = ("x", "y", "z")
    quantity_name: ClassVar[str] = "acceleration"
    unit: ClassVar[str] = "m/s2"
    presets: ClassVar[Mapping[str, SensorErrors]] = MappingProxyType(
        {"mems": MEMS, "industrial": INDUSTRIAL, "axlebox": AXLEBOX}
    )

    def component(self, truth: Truth, axis: int) -> np.ndarray:
        """f + alpha x r + omega x (omega x r) along one body axis: rigid-body kinematics with the lever arm r."""
        self.need(truth, f"{self.body}.specific_force_{'xyz'[axis]} [m/s2]")
        place = "specific force", self.body, self.position, axis
        return truth.derived(place, lambda: self._force(truth, axis))

    def _force(self, truth: Truth, axis: int) -> np.ndarray:
        force = truth[f"{self.body}.specific_force_{'xyz'[axis]} [m/s2]"]
        if not any(self.position):
            return force
        omega = [truth[f"{self.body}.angular_velocity_{name} [rad/s]"] for name in "xyz"]
        after, last = (axis + 1) % 3, (axis + 2) % 3
        along = sum(rate * arm for rate, arm in zip(omega, self.position, strict=True))
        squared = sum(rate * rate for rate in omega)
        force = force + omega[axis] * along - squared * self.position[axis]
        if self.position[last]:
            force += truth[f"{self.body}.angular_acceleration_{'xyz'[after]} [rad/s2]"] * self.position[last]
        if self.position[after]:
            force -= truth[f"{self.body}.angular_acceleration_{'xyz'[last]} [rad/s2]"] * self.position[after]
        return force
