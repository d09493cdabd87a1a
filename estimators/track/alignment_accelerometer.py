"""Vertical alignment from a bogie accelerometer, in space or in time: what pitch-rate alignment is compared with."""

from typing import ClassVar, Literal

import numpy as np

from estimators.interface import Estimate, Missing
from estimators.signals.bands import ORDER
from estimators.signals.frequency_response import filter_time
from estimators.speed.odometry import Odometry
from estimators.track.chain_error import Chain, Reading, over_centre, vertical_chain
from estimators.track.geometry import TrackEstimator, by_speed, geometry
from estimators.track.slow_motions import stated, without_mean
from estimators.vehicle.parameters import given
from estimators.vehicle.state_space import Output
from estimators.vehicle.vertical import NEEDED, vertical
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements
from railsim.spec import quantity

PAPER = "Ward et al. 2011, section 3.1"
MEMORY = 30.0  # m; the inverse of the mean of both wheelsets rings no longer


class AlignmentAccelerometer(TrackEstimator, frozen=True):
    """Vertical alignment from one accelerometer on the bogie.

    The acceleration is integrated twice, which gives the path of the bogie at the sensor's place. In space:
    acceleration over the square of speed is curvature, as with a gyro. In time: integrated with a high pass whose
    corner is the median speed over `cut`, then put on the grid. Where on the bogie the sensor stands matters: in its
    middle it feels the mean of both wheelsets, which hides waves of four semi wheelbases. `compensate` undoes what can
    be undone of that and of the primary suspension, with the vehicle's nominal parameters (Wiener filter).
    """

    requires: ClassVar[tuple[str, ...]] = ("bogie.acceleration_z [m/s2]",)
    nearby: ClassVar[bool] = True

    sensor: str = quantity("bogie", unit="name of the accelerometer", source=PAPER, pattern=r"^\w+$")
    domain: Literal["space", "time"] = quantity("space", unit="-", source=PAPER)
    compensate: bool = quantity(
        True, unit="- (in space, where the vehicle's parameters are given)", source="as alignment_vertical"
    )
    regularisation: float = quantity(
        0.01, unit="-", source="power of what the model leaves over that of the track; as cross_level", gt=0.0
    )

    def needed(self) -> tuple[str, ...]:
        """The vertical channel of `sensor`."""
        return (f"{self.sensor}.acceleration_z [m/s2]",)

    def missing(self, measurements: Measurements) -> Missing:
        """What is needed and not there: also that the sensor stands on a bogie, where its data sheet says on what."""
        missing, name = super().missing(measurements), self.needed()[0]
        body = str(data_sheet(measurements.about, name).stated.get("body", "bogie"))
        if missing.channels or body.startswith("bogie"):
            return missing
        other = "take alignment_body" if body == "body" else "take axlebox_profile or another sensor"
        return missing + Missing(others=(f"an accelerometer on a bogie, while '{name}' stands on '{body}': {other}",))

    def estimate(self, measurements: Measurements) -> Estimate:
        """Alignment over the whole record.

        Raises
        ------
        InputError : no such accelerometer, no speed, or no movement.
        """
        odometry = self.odometry(measurements)
        name = self.needed()[0]
        columns, good = self._columns(measurements, odometry)
        felt = {name: lambda rows: self._path(measurements, odometry, rows)[0]}
        integrate = self._integrations
        columns |= stated("vertical", columns, self._chain(measurements), felt, measurements, odometry, good, integrate)
        return self.result(odometry, columns, good)

    @property
    def _integrations(self) -> int:
        """Over distance, from what `_path` gives to the height."""
        return 0 if self.domain == "time" else 2

    def _columns(self, measurements: Measurements, odometry: Odometry) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """Columns of the height, and where they are measured."""
        path, good = self._path(measurements, odometry, without_mean(measurements[self.needed()[0]]))
        if self.domain == "time":
            return geometry("vertical", path, good, odometry, self.cut), good
        felt = curvature = np.where(good, path, np.nan)
        if self._compensates(measurements):
            curvature = by_speed(
                [felt], odometry, lambda speed: [lambda k: self._inverse(measurements, speed, k)], MEMORY
            )
        columns = geometry("vertical", curvature, good, odometry, self.cut, self._integrations)
        return columns | {"vertical_curvature [1/m]": felt}, good

    def _path(
        self, measurements: Measurements, odometry: Odometry, samples: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Height in time, m, or curvature in space, 1/m, from samples of acceleration (m/s2), and where measured."""
        name = self.needed()[0]
        ahead = data_sheet(measurements.about, name).position[0]
        if self.domain == "time":
            height = filter_time(samples, measurements.rate(name), self._integral(odometry))
            return odometry.channel(measurements, name, ahead, height)
        acceleration, good = odometry.channel(measurements, name, ahead, samples)
        return acceleration / odometry.speed**2, good

    def _compensates(self, measurements: Measurements) -> bool:
        return self.compensate and self.domain == "space" and given(measurements.vehicle, NEEDED)

    def _output(self, measurements: Measurements) -> Output:
        return Output("acceleration", data_sheet(measurements.about, self.needed()[0]).position)

    def _inverse(self, measurements: Measurements, speed: float, k: np.ndarray) -> np.ndarray:
        """The track's curvature over the sensor's, at wave numbers, rad/m, shape (k,)."""
        position, arm = self._output(measurements).position, measurements.vehicle["semi_wheelbase"]
        height = vertical(measurements.vehicle, [Output("height", position)])
        shown = over_centre([height], arm, speed, k)[0, :, 0, 0] * np.exp(-1j * k * position[0])
        return np.conj(shown) / (np.abs(shown) ** 2 + self.regularisation)

    def _height(self, output: Output, speed: float, k: np.ndarray) -> np.ndarray:
        """Height under the sensor over its acceleration, put where the sensor stood."""
        return -np.exp(-1j * k * output.position[0]) / (speed * k) ** 2

    def _chain(self, measurements: Measurements) -> Chain | None:
        output = self._output(measurements)

        def gain(speed: float, k: np.ndarray) -> list[np.ndarray]:
            height = self._height(output, speed, k)
            return [height * self._inverse(measurements, speed, k) if self._compensates(measurements) else height]

        return vertical_chain(measurements, [Reading(self.needed(), output)], gain)

    def _integral(self, odometry: Odometry):
        """-1 / w^2 above the corner."""
        speed = float(np.median(odometry.speed[odometry.valid])) if odometry.valid.any() else odometry.slowest
        corner = 2.0 * np.pi * speed / max(self.cut, 150.0)

        def gain(omega: np.ndarray) -> np.ndarray:
            safe = np.maximum(omega, 1e-9)
            power = (safe / corner) ** ORDER
            return -power / (1.0 + power) / safe**2

        return gain
