"""Lateral alignment and curvature from the bogie's yaw rate: y'' = yaw rate / speed, less the bogie's own motion."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from estimators.interface import Estimate
from estimators.speed.odometry import Odometry
from estimators.track.chain_error import Chain, Reading, sideways_chain
from estimators.track.geometry import Gain, TrackEstimator, by_speed, geometry, turning
from estimators.track.slow_motions import stated
from estimators.vehicle.creep import CREEP_FACTOR
from estimators.vehicle.lateral_roll import NEEDED, followed
from estimators.vehicle.state_space import Output
from railsim.measurements import Measurements
from railsim.spec import quantity

RATE = "bogie.rate_yaw [rad/s]"
ROLL_RATE = "bogie.rate_roll [rad/s]"
NODES = 801  # 0.008 rad/m apart: finer than the memory asks for
SHORTEST = 2.0 * np.pi / 1.0  # rad/m; shorter waves than 1 m carry nothing of the bands
MEMORY = 150.0  # m; the bogie's kinematic oscillation has decayed


class AlignmentLateral(TrackEstimator, frozen=True):
    """Lateral alignment from the yaw rate of the bogie and the speed.

    Yaw rate over speed is curvature. It is integrated twice on a grid of 0.125 m; long waves are cut with zero phase.
    The bogie does not follow the rails sideways as it does upwards: its wheelsets run on creep, and cross level turns
    it too. `compensation` inverts the transfer function from the rails' position to the bogie's yaw at the speed of
    each place (Ward et al. 2011, section 3.1, reference [11] there), from a linear model on the vehicle's nominal
    parameters (`vehicle.lateral_roll`). The share of cross level is taken from the roll rate where that is measured.
    Both are the linear estimate of least mean square error for irregularities of stated relative sizes (Wiener filter).
    """

    requires: ClassVar[tuple[str, ...]] = (RATE,)
    nearby: ClassVar[bool] = True
    adds: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            ROLL_RATE: "less of the cross level in the lateral alignment",
        }
    )

    compensation: bool = quantity(True, unit="-", source="Ward et al. 2011, reference [11]")
    creep: float = quantity(1.0, unit="-", source="factor of the slopes of Polach's law (2005), dry", gt=0.0, le=2.0)
    cross_level: float = quantity(
        0.5, unit="-", source="power of the height r phi over that of the lateral irregularity; illustrative", ge=0.0
    )
    yaw_error: float = quantity(
        1e-3, unit="-", source="power of what the model leaves over that of the irregularity; straight_erri_low", gt=0.0
    )
    roll_error: float = quantity(1e-2, unit="-", source="the same for the roll; straight_erri_low", gt=0.0)

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """What the vehicle's model needs."""
        return NEEDED if self.compensation else ()

    def estimate(self, measurements: Measurements) -> Estimate:
        """Alignment over the whole record.

        Raises
        ------
        InputError : no yaw rate, no speed, no movement, or a vehicle parameter is missing.
        """
        odometry = self.odometry(measurements)
        curvature, good = turning(measurements, RATE, odometry)
        rolling = np.zeros(len(curvature))
        if self._rolled(measurements):
            rolling, rolled = turning(measurements, ROLL_RATE, odometry)
            good = good & rolled
        seen = np.where(good, curvature, np.nan)
        track = seen
        if self.compensation:
            track = self._compensated(seen, np.where(good, rolling, np.nan), odometry, measurements)
        columns = geometry("lateral", track, good, odometry, self.cut, integrate=2)
        felt = {RATE: lambda rows: turning(measurements, RATE, odometry, samples=rows)[0]}
        columns |= stated("lateral", columns, self._chain(measurements), felt, measurements, odometry, good, 2)
        columns["lateral_curvature [1/m]"] = seen
        return self.result(odometry, columns, good)

    def _rolled(self, measurements: Measurements) -> bool:
        """Whether the roll rate goes in."""
        return self.compensation and ROLL_RATE in measurements

    def _chain(self, measurements: Measurements) -> Chain | None:
        rolled = self._rolled(measurements)
        readings = [Reading((RATE,), Output("rate", axis="yaw"))]
        readings += [Reading((ROLL_RATE,), Output("rate", axis="roll"))] if rolled else []

        def gain(speed: float, k: np.ndarray) -> list[np.ndarray]:
            path = -1.0 / (speed * k**2)
            if not self.compensation:
                return [path]
            return [path * one(k) for one in self._filters(measurements.vehicle, speed, rolled)]

        return sideways_chain(measurements, readings, gain, "lateral")

    def _compensated(
        self, yawing: np.ndarray, rolling: np.ndarray, odometry: Odometry, measurements: Measurements
    ) -> np.ndarray:
        """Curvature of the rails from yaw rate and roll rate over speed (NaN where not measured)."""
        rolled = self._rolled(measurements)
        inputs = [yawing, rolling] if rolled else [yawing]
        return by_speed(inputs, odometry, lambda speed: self._filters(measurements.vehicle, speed, rolled), MEMORY)

    def _filters(self, vehicle: Mapping[str, Any], speed: float, rolled: bool) -> list[Gain]:
        """Filters by wave number that make the rails' curvature of yaw rate over speed and of roll rate over speed."""
        k = np.linspace(0.0, SHORTEST, NODES)
        position, height, roll = followed({**vehicle, CREEP_FACTOR: self.creep}, speed, k)
        seen = np.abs(position) ** 2 + np.abs(height) ** 2 * self.cross_level + self.yaw_error
        if not rolled:
            return [_between(k, np.conj(position) / seen)]
        power = np.abs(roll) ** 2 * self.cross_level + self.roll_error
        cross = height * np.conj(roll) * self.cross_level
        determinant = seen * power - np.abs(cross) ** 2
        scale = 1j * k * vehicle["wheel_radius"]  # slope of the height r phi, from the rate of phi itself
        by_yaw, by_roll = np.conj(position) * power / determinant, -np.conj(position) * cross / determinant * scale
        return [_between(k, by_yaw), _between(k, by_roll)]


def _between(nodes: np.ndarray, values: np.ndarray) -> Gain:
    """Response by interpolation; zero beyond the last node."""

    def gain(k: np.ndarray) -> np.ndarray:
        inside = np.searchsorted(k, nodes[-1], side="right")
        response = np.zeros(len(k), dtype=complex)
        response[:inside] = np.interp(k[:inside], nodes, values)
        return response

    return gain
