"""Vertical alignment of both rails from a bogie accelerometer, gyros and primary displacement transducers."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from estimators.interface import Estimate
from estimators.speed.odometry import Odometry
from estimators.track.chain_error import Chain, Reading, sideways_chain, vertical_chain
from estimators.track.geometry import CANT_BASE, TrackEstimator, geometry, rails, turning
from estimators.track.slow_motions import balancing_cant, stated, without_mean
from estimators.vehicle.parameters import numbers
from estimators.vehicle.state_space import Output
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements

ACCELERATION = "bogie.acceleration_z [m/s2]"
PITCH, ROLL = "bogie.rate_pitch [rad/s]", "bogie.rate_roll [rad/s]"
LENGTH = Output("displacement", (1.0, 0.0, 0.0))
LEFT, RIGHT = "primary1_left.displacement [m]", "primary1_right.displacement [m]"


class AlignmentDisplacement(TrackEstimator, frozen=True):
    """Vertical alignment from an accelerometer on the bogie and displacement of the primary suspension.

    It is the path of the bogie frame above the leading wheelset, less the length of the primary suspension there. Ward
    et al. 2011, section 3.1, name these sensors for what axlebox accelerometers lose: a sensitive accelerometer on the
    bogie, displacement down to both axleboxes. The pitch rate carries the acceleration from the sensor's place to that
    above the wheelset. With the roll rate, left and right rail come apart.
    """

    requires: ClassVar[tuple[str, ...]] = (ACCELERATION, PITCH, LEFT, RIGHT)
    nearby: ClassVar[bool] = True
    adds: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            ROLL: "cross level and each rail",
        }
    )

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """Where the transducers are."""
        return ("semi_wheelbase", "primary_half_spacing")

    def estimate(self, measurements: Measurements) -> Estimate:
        """Alignment over the whole record.

        Raises
        ------
        InputError : a channel is missing, no speed, no movement, or a vehicle parameter is not given.
        """
        odometry = self.odometry(measurements)
        given = numbers(measurements.vehicle, ("semi_wheelbase", "primary_half_spacing"))
        arm, half = given["semi_wheelbase"], given["primary_half_spacing"]
        lever = arm - data_sheet(measurements.about, ACCELERATION).position[0]
        speed = odometry.speed_behind(arm)  # there is the bogie's centre

        def path(samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            acceleration, measured = odometry.channel(measurements, ACCELERATION, arm, samples)
            return acceleration / speed**2, measured

        curvature, good = path(without_mean(measurements[ACCELERATION]))
        pitching, measured_pitch = turning(measurements, PITCH, odometry, ahead=arm)
        left, measured_left = odometry.channel(measurements, LEFT, arm)
        right, measured_right = odometry.channel(measurements, RIGHT, arm)
        good = good & measured_pitch & measured_left & measured_right
        columns = _sum(
            geometry("vertical", curvature, good, odometry, self.cut, integrate=2),
            geometry("vertical", -lever * pitching, good, odometry, self.cut, integrate=1),
            geometry("vertical", -(left + right) / 2.0, good, odometry, self.cut),
        )
        chain, felt = self._chain(measurements, arm, lever), {ACCELERATION: lambda rows: path(rows)[0]}
        columns |= stated("vertical", columns, chain, felt, measurements, odometry, good, 2)
        if ROLL in measurements:
            columns |= self._apart(measurements, odometry, columns, (left - right) / (2.0 * half), good)
        return self.result(odometry, columns, good)

    def _chain(self, measurements: Measurements, arm: float, lever: float) -> Chain | None:
        readings = [
            Reading((ACCELERATION,), Output("acceleration", data_sheet(measurements.about, ACCELERATION).position)),
            Reading((PITCH,), Output("rate")),
            Reading((LEFT, RIGHT), LENGTH),
        ]

        def gain(speed: float, k: np.ndarray) -> list[np.ndarray]:
            place = np.exp(-1j * k * arm)
            return [-place / (speed * k) ** 2, -lever * place / (1j * k * speed), -place]

        return vertical_chain(measurements, readings, gain)

    def _level_chain(self, measurements: Measurements, arm: float, half: float) -> Chain | None:
        def gain(speed: float, k: np.ndarray) -> list[np.ndarray]:
            place = CANT_BASE * np.exp(-1j * k * arm)
            return [-place / (1j * k * speed), place / half]

        readings = [Reading((ROLL,), Output("rate")), Reading((LEFT, RIGHT), LENGTH)]
        return sideways_chain(measurements, readings, gain, "cross_level")

    def _apart(
        self,
        measurements: Measurements,
        odometry: Odometry,
        columns: dict[str, np.ndarray],
        suspension: np.ndarray,
        good: np.ndarray,
    ) -> dict[str, np.ndarray]:
        """Cross level and each rail, from the bogie's roll less that across the suspension (rad)."""
        given = numbers(measurements.vehicle, ("semi_wheelbase", "primary_half_spacing"))
        arm, half = given["semi_wheelbase"], given["primary_half_spacing"]
        rolling, rolled = turning(measurements, ROLL, odometry, ahead=arm)
        both = good & rolled
        level = _sum(
            geometry("cross_level", -CANT_BASE * rolling, both, odometry, self.cut, integrate=1),
            geometry("cross_level", CANT_BASE * suspension, both, odometry, self.cut),
        )
        chain = self._level_chain(measurements, arm, half)
        level |= stated("cross_level", level, chain, {}, measurements, odometry, both)
        cant = geometry("cross_level", balancing_cant(measurements, odometry), good, odometry, self.cut)
        return level | rails(columns, level, cant)


def _sum(*parts: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: np.sum([part[name] for part in parts], axis=0) for name in parts[0]}
