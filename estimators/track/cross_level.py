"""Cross level, absolute cant and twist from the bogie's roll."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
from scipy.ndimage import uniform_filter1d

from estimators.interface import Estimate
from estimators.signals.bands import settled, transform
from estimators.speed.odometry import Odometry
from estimators.track.chain_error import Chain, Reading, deviations, filtered_deviation, sideways_chain, sum_of_squares
from estimators.track.geometry import CANT_BASE, TrackEstimator, by_speed, geometry, in_bands, turning
from estimators.track.observations import CROSSOVER, CURVE, LOAD, Attitude, attitude, beyond_straight, curved
from estimators.track.slow_motions import additions
from estimators.vehicle import roll_plane
from estimators.vehicle.parameters import given
from estimators.vehicle.roll_plane import over_track
from estimators.vehicle.state_space import Output
from railsim.constants import GRAVITY
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements
from railsim.spec import quantity

ROLL, YAW = "bogie.rate_roll [rad/s]", "bogie.rate_yaw [rad/s]"
LATERAL = "bogie.acceleration_y [m/s2]"
MEMORY = 60.0  # m; the body's roll has decayed
NOWHERE_STRAIGHT = (
    "cant: the record has no straight track, so biases of gyro, accelerometer and mounting are still in it; "
    "give a longer record, or one with a standstill"
)
LONG = 2.0 * np.pi / 150.0  # rad/m; longer waves than D3 are design
LEANING = (
    "body_mass", "body_height", "bogie_mass", "bogie_height", "wheel_radius", "primary_vertical_stiffness",
    "primary_half_spacing",
)  # fmt: skip


class CrossLevel(TrackEstimator, frozen=True):
    """Cross level, cant and twist from the roll rate of the bogie and the speed.

    Roll rate over speed, integrated, is the roll of the track; cross level is -1.5 m times that. The bogie rolls by the
    mean of its wheelsets, which does not show waves of four semi wheelbases, through the primary suspension;
    `compensate` takes that out as far as can be, with the vehicle's nominal parameters.

    Absolute roll: a lateral accelerometer feels V yaw rate + g roll, which holds over long waves; the roll rate holds
    over short ones (`observations.attitude`). Straight track is taken to
    have no cant, which tells biases and the mounting; where a record has no straight track these stay in. The bogie
    leans on its primary springs where cant does not balance a curve; the nominal lean is taken out. Twist over `base`
    is the mean slope of cant, straight from the roll rate, so that it holds the ramps of transitions too.
    """

    requires: ClassVar[tuple[str, ...]] = (ROLL,)
    nearby: ClassVar[bool] = True
    adds: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            LATERAL: "cant (with the yaw gyro)",
            YAW: "cant (with the lateral accelerometer)",
        }
    )

    compensate: bool = quantity(
        True, unit="- (where the vehicle's parameters are given)", source="the paper's chain does without"
    )
    regularisation: float = quantity(
        0.01, unit="-", source="power of what the model leaves over that of cross level; straight_erri_low", gt=0.0
    )
    base: float = quantity(3.0, unit="m", source="EN 13848-1: twist base, commonly 3 m", ge=0.5, le=20.0)

    def estimate(self, measurements: Measurements) -> Estimate:
        """Cross level and twist over the whole record, and cant where lateral acceleration and yaw rate are there.

        Raises
        ------
        InputError : no roll rate, no speed, or no movement.
        """
        odometry = self.odometry(measurements)
        raw, good = turning(measurements, ROLL, odometry)
        rolling = self._inverted(np.where(good, raw, np.nan), measurements, odometry)
        columns = geometry("cross_level", -CANT_BASE * rolling, good, odometry, self.cut, integrate=1)
        columns["twist [m/m]"] = self._twist(np.where(good, -CANT_BASE * rolling, np.nan), odometry)
        chain = self._chain(measurements, self._compensates(measurements))
        if chain:
            columns |= self._deviations(chain, columns, measurements, good, odometry)
        moved, warnings = attitude(measurements, odometry), list[str]()
        if moved is not None:
            curve = curved(moved, odometry)
            columns |= self._cant(measurements, odometry, moved, curve, good, chain)
            warnings += [NOWHERE_STRAIGHT] if curve.all() else []
        about = {"compensated": self._compensates(measurements), "warnings": warnings}
        return self.result(odometry, columns, good, **{"twist_base [m]": self.base}, **about)

    def _inverted(self, rolling: np.ndarray, measurements: Measurements, odometry: Odometry) -> np.ndarray:
        """Slope of the rails' roll from that of the bogie's, rad/m, where it is compensated."""
        if not self._compensates(measurements):
            return rolling
        return by_speed([rolling], odometry, lambda speed: [self._inverse(measurements, speed)], MEMORY)

    def _twist(self, slope: np.ndarray, odometry: Odometry) -> np.ndarray:
        return transform(slope, odometry.spacing, self._over_base, self.base, detrend=False)

    def _over_base(self, k: np.ndarray) -> np.ndarray:
        return np.sinc(k * self.base / (2.0 * np.pi))

    def _compensates(self, measurements: Measurements) -> bool:
        return self.compensate and given(measurements.vehicle, roll_plane.NEEDED)

    def _chain(self, measurements: Measurements, compensated: bool) -> Chain | None:
        def gain(speed: float, k: np.ndarray) -> list[np.ndarray]:
            return [one * self._inverse(measurements, speed)(k) if compensated else one for one in _level(speed, k)]

        return sideways_chain(measurements, [Reading((ROLL,), Output("rate"))], gain, "cross_level")

    def _deviations(
        self,
        chain: Chain,
        columns: Mapping[str, np.ndarray],
        measurements: Measurements,
        good: np.ndarray,
        odometry: Odometry,
    ) -> dict[str, np.ndarray]:
        slow = additions(measurements, ROLL, odometry)
        slopes = np.where(good, -CANT_BASE * turning(measurements, ROLL, odometry, samples=slow)[0], np.nan)
        levels = in_bands("cross_level", slopes, good, odometry, integrate=1)
        more = sum_of_squares(self._twist(slopes, odometry))
        twist, table = columns["twist [m/m]"], chain.table(odometry)
        spread = filtered_deviation(twist, lambda k: k * self._over_base(k), table, odometry, more)
        return deviations("cross_level", columns, table, odometry, levels) | {"twist_std [m/m]": spread}

    def _cant(
        self,
        measurements: Measurements,
        odometry: Odometry,
        moved: Attitude,
        curve: np.ndarray,
        good: np.ndarray,
        chain: Chain | None,
    ) -> dict[str, np.ndarray]:
        """Absolute cant and its standard deviation. `chain` : of cross level; cant is not compensated."""
        good = settled(good & ~moved.bridged, odometry.spacing, CROSSOVER)
        leaning = lean(measurements.vehicle, moved.side, odometry)
        values = beyond_straight(moved.roll - leaning, curve)
        cant = np.where(good, -CANT_BASE * np.sin(values), np.nan)
        if chain is None:
            return {"cant [m]": cant}
        side, yaw = data_sheet(measurements.about, LATERAL), data_sheet(measurements.about, YAW)
        off = yaw.error("bias_std") / GRAVITY * np.abs(odometry.speed - _usual(odometry.speed, curve))
        if curve.all():
            tilt = np.hypot(side.error("bias_std") / GRAVITY, side.error("misalignment_std"))
            off = np.hypot(tilt, yaw.error("bias_std") / GRAVITY * odometry.speed)
        count = max(1, round(2.0 * np.pi / LONG / odometry.spacing))
        waves = np.where(good, CANT_BASE * (values - uniform_filter1d(values, count)), np.nan)
        more = CANT_BASE**2 * (off**2 + (LOAD * leaning) ** 2)
        table = replace(chain, gain=_level).table(odometry)
        spread = filtered_deviation(waves, lambda k: (k > LONG).astype(float), table, odometry, more)
        return {"cant [m]": cant, "cant_std [m]": spread}

    def _inverse(self, measurements: Measurements, speed: float) -> Callable[[np.ndarray], np.ndarray]:
        def gain(k: np.ndarray) -> np.ndarray:
            follows = over_track(measurements.vehicle, speed, k)
            return np.conj(follows) / (np.abs(follows) ** 2 + self.regularisation)

        return gain


def _level(speed: float, k: np.ndarray) -> list[np.ndarray]:
    """Cross level over the roll rate."""
    return [-CANT_BASE / (1j * k * speed)]


def _usual(speed: np.ndarray, curve: np.ndarray) -> float:
    """Median speed on straight track."""
    return float(np.median(speed if curve.all() else speed[~curve]))


def lean(vehicle: Mapping[str, Any], side: np.ndarray, odometry: Odometry) -> np.ndarray:
    """Roll of the bogie on its primary springs by lateral acceleration that cant does not balance (m/s2), rad.

    At rest, body and bogie upright: sum of masses times heights above the axles over the primary springs' stiffness in
    roll. Zero where a parameter is not given.
    """
    if not given(vehicle, LEANING):
        return np.zeros(len(side))
    above = vehicle["body_mass"] * (vehicle["body_height"] - vehicle["wheel_radius"])
    above += vehicle["bogie_mass"] * (vehicle["bogie_height"] - vehicle["wheel_radius"])
    stiffness = 4.0 * vehicle["primary_vertical_stiffness"] * vehicle["primary_half_spacing"] ** 2
    return above / stiffness * uniform_filter1d(side, max(1, round(CURVE / odometry.spacing)))
