"""Track geometry from all bogie sensors at once: Gaussian smoother over distance with the vehicle's model, and what
every value is uncertain by.
"""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from estimators._bands import band_pass, bands_of, settled
from estimators._fused import Fused, Plane, fuse
from estimators._planes import GRAVITY, Output, check_vehicle, roll, vertical
from estimators._readings import Attitude, Reading, attitude, channels_of, combined, reading, stated
from estimators._shaping import Prior
from estimators._space import SpeedSource, Way, find_way, has_speed
from estimators.interface import Estimate, Estimator
from railsim.measurements import Measurements
from railsim.spec import quantity

ACCELERATION, PITCH = "bogie.acceleration_z [m/s2]", "bogie.rate_pitch [rad/s]"
ROLL, SIDE = "bogie.rate_roll [rad/s]", "bogie.acceleration_y [m/s2]"
LEVEL = 4.032e-7 * 0.8246**2  # m rad; vertical irregularity of ERRI B176 (1989) "low", where none can be fitted
CANT_CORNERS = (0.001, 0.8246)  # rad/m; ERRI's upper corner, and freedom for the design cant below
CURVE_SHARES = {"d1": 0.1, "d2": 0.7, "d3": 1.0}  # illustrative: what of the error in curves falls into each band
SHIFT_SHARES = {"d1": 0.65, "d2": 0.7, "d3": 0.3}  # the same of what a wheelset's lateral shift makes; tuned likewise
SHIFT_GROWTH = 0.75  # power of the spectrum's level; between linear (0.5) and products of two motions (1)
CURVE_REACH = 60.0  # m; the error in a transition is felt this far
CANTED = 2e-4  # 1/m; sharper curves are taken to have cant
STIFF_AND_HEAVY: tuple[str, ...] = (
    "primary_vertical_stiffness",
    "secondary_vertical_stiffness",
    "bogie_mass",
    "body_mass",
    "bogie_pitch_inertia",
)
DAMPED: tuple[str, ...] = ("primary_vertical_damping", "secondary_vertical_damping")
NOD_REACH = 20.0  # m; the speed's own noise is averaged over this length
CENTRED = 0.05  # m; a vertical accelerometer farther to the side feels roll and is not used


class TrackSmoother(Estimator, frozen=True):
    """Vertical alignment by Kalman filter and smoother: bogie gyros, accelerometers and displacement transducers."""

    speed_source: SpeedSource = quantity("tachometer", unit="-", source="tachometer or refined")
    slowest: float = quantity(1.0, unit="m/s", source="illustrative", gt=0.0)
    parameter_error: float = quantity(
        0.03,
        unit="- (standard deviation of stiffness, mass, inertia; dampers twice that)",
        source="illustrative",
        ge=0.0,
    )
    distance_error: float = quantity(
        0.01, unit="- (standard deviation of the odometer's scale)", source="illustrative: wheel worn by 5 mm", ge=0.0
    )

    curve_error: float = quantity(
        0.0022,
        unit="m/rad (standard deviation of the height by the roll on canted track)",
        source="tuned on curve_r400: wheelset lifted by its lateral shift, products of angles not modelled",
        ge=0.0,
    )

    shift_error: float = quantity(
        2.0e-4,
        unit="m (standard deviation of cross level on track like ERRI low)",
        source="tuned on straight_erri_low and straight_erri_high: roll of wheelsets that shift between the rails",
        ge=0.0,
    )
    flange_error: float = quantity(
        2.5e-3,
        unit="m per m/s2 of unbalanced lateral acceleration (standard deviation of cross level)",
        source="tuned on curve_r400: wheelset lifted by its flange",
        ge=0.0,
    )

    requires: ClassVar[tuple[str, ...]] = (ACCELERATION, PITCH)

    def fits(self, measurements: Measurements) -> bool:
        """Whether there are the bogie's two vertical channels and a speed."""
        return super().fits(measurements) and has_speed(measurements, self.speed_source)

    def estimate(self, measurements: Measurements) -> Estimate:
        """Smooth the whole record.

        Raises
        ------
        InputError : a channel, the speed or a parameter of the vehicle is missing.
        """
        self.need(measurements)
        vehicle = measurements.vehicle
        check_vehicle(vehicle)
        wheelbase = 2.0 * vehicle["semi_wheelbase"]
        out = find_way(measurements, self.speed_source, self.slowest)
        way = find_way(measurements, self.speed_source, self.slowest, wheelbase / round(wheelbase / out.spacing))
        plane = self._vertical(measurements, way)
        found = {"vertical": fuse(plane, way, bands_of("vertical"), self.distance_error)}
        series = pd.DataFrame({"s [m]": out.s, "time [s]": out.time})
        found["vertical"] = found["vertical"].raised(*self._settling(measurements, way), CURVE_SHARES)
        across = self._roll(measurements, way)
        if across is not None:
            level = fuse(across, way, bands_of("cross_level"), self.distance_error)
            found["cross_level"] = level.raised(
                np.zeros(len(way.s)), self._shifting(measurements, way, level), SHIFT_SHARES
            )
            canted = self._canted(measurements, way)
            for name, share in (("left_vertical", -0.5), ("right_vertical", 0.5)):
                found[name] = found["vertical"].with_share(found["cross_level"], share).without(canted)
        for name, fused in found.items():
            add(series, name, fused, out, wheelbase / 2)
        seen = np.interp(out.s, way.s, found["vertical"].seen.astype(float)) > 0.5
        series["valid [-]"] = (out.valid & seen).astype(float)
        about: dict[str, Any] = self.model_dump()
        for name in {"vertical", "cross_level"} & set(found):
            about[f"{name}_level [m rad]"] = found[name].level
            about |= {f"{name}_{band}_bound [m]": bound for band, bound in found[name].bounds.items()}
        return Estimate(self.name, series, about)

    def _vertical(self, measurements: Measurements, way: Way) -> Plane:
        moved = attitude(measurements, way)
        rate, force, across, side, roll_std = None, None, None, None, 0.0
        if moved is not None:
            rate = moved.roll * moved.turn
            force = centripetal(moved, way)
            across, side = (moved.yaw_rate, moved.roll_rate), (moved.side, np.zeros(len(way.s)))
            roll_std = moved.roll_std
        readings = [
            reading(measurements, way, name, Output("rate"), rate, across, roll_std=roll_std)
            for name in channels_of(measurements, "bogie", "rate_pitch")
        ]
        for name in channels_of(measurements, "bogie", "acceleration_z"):
            x, y, z = stated(measurements, name).get("position", (0.0, 0.0, 0.0))
            if abs(y) <= CENTRED:
                output = Output("acceleration", (x, y, z))
                readings.append(reading(measurements, way, name, output, force, side, GRAVITY, roll_std))
        readings += displacements(measurements, way, half_difference=False)
        outputs = [one.output for one in readings]
        return Plane(
            lambda p, _speed: vertical(p, outputs),
            dict(measurements.vehicle),
            self._unknown(),
            readings,
            Prior(LEVEL),
            np.zeros(6),
            lambda height, slope, speed: np.array(
                [2 * height, 2 * height, 2 * slope, 2 * slope * speed, 2 * slope * speed, slope * speed]
            ),
        )

    def _roll(self, measurements: Measurements, way: Way) -> Plane | None:
        """The roll plane; None without a roll gyro and a lateral accelerometer on the bogie."""
        if ROLL not in measurements or SIDE not in measurements:
            return None
        moved = attitude(measurements, way)
        turning = None if moved is None else (moved.yaw_rate, np.zeros(len(way.s)))
        side = reading(measurements, way, SIDE, Output("acceleration"))
        readings = [reading(measurements, way, ROLL, Output("rate"), turning=turning), side]
        readings += displacements(measurements, way, half_difference=True)
        outputs = [one.output for one in readings]
        jumps = np.diff(side.values) ** 2 * way.speed[1:] / way.spacing
        drive = np.zeros(7)
        drive[6] = np.nanmean(jumps) if np.isfinite(jumps).any() else 1.0
        return Plane(
            lambda p, _speed: roll(p, outputs),
            dict(measurements.vehicle),
            self._unknown(),
            readings,
            Prior(4 * LEVEL, CANT_CORNERS),
            drive,
            lambda height, slope, speed: np.array(
                [height, height, height, slope * speed, slope * speed, 0.1 + slope * speed, 1.0]
            ),
        )

    def _settling(self, measurements: Measurements, way: Way) -> tuple[np.ndarray, np.ndarray]:
        """How far the primary springs give under the larger force in a canted curve, m; what is unsure in curves, m."""
        p = measurements.vehicle
        moved = attitude(measurements, way)
        if moved is None:
            return np.zeros(len(way.s)), np.zeros(len(way.s))
        given = (p["bogie_mass"] + p["body_mass"]) * centripetal(moved, way) / (4 * p["primary_vertical_stiffness"])
        curve = curved(moved, way)
        canted = uniform_filter1d(np.abs(beyond_straight(moved.roll, curve)), max(1, round(CURVE_REACH / way.spacing)))
        return given, self.curve_error * canted * curve

    def _canted(self, measurements: Measurements, way: Way) -> np.ndarray:
        """Where a curve's cant stands in the cross level and cannot be told from a rail's own irregularity."""
        moved = attitude(measurements, way)
        if moved is None:
            return np.zeros(len(way.s), dtype=bool)
        return maximum_filter1d(curved(moved, way), max(1, round(2 * CURVE_REACH / way.spacing)))

    def _shifting(self, measurements: Measurements, way: Way, level: Fused) -> np.ndarray:
        """What the wheelsets' lateral shift adds to the roll, m of cross level (standard deviation): it grows with the
        track's roughness, and with the flange's contact where a curve's cant does not balance the speed.
        """
        moved = attitude(measurements, way)
        rough = self.shift_error * (level.level / (4 * LEVEL)) ** SHIFT_GROWTH
        if moved is None:
            return np.full(len(way.s), rough)
        count = max(1, round(CURVE_REACH / way.spacing))
        curve = curved(moved, way)
        unbalanced = np.abs(uniform_filter1d(beyond_straight(moved.side, curve), count)) * curve
        return np.hypot(rough, self.flange_error * unbalanced)

    def _unknown(self) -> dict[str, float]:
        """Relative standard deviations of the vehicle's parameters."""
        one = self.parameter_error
        return dict.fromkeys(STIFF_AND_HEAVY, one) | dict.fromkeys(DAMPED, 2 * one)


def centripetal(moved: Attitude, way: Way) -> np.ndarray:
    """Vertical specific force less gravity that a canted curve makes, m/s2: -V r roll - g roll^2 / 2."""
    return -way.speed * moved.turn * moved.roll - GRAVITY * moved.roll**2 / 2


def curved(moved: Attitude, way: Way) -> np.ndarray:
    """Where the track is curved, and not only the yaw gyro biased."""
    count = max(1, round(CURVE_REACH / way.spacing))
    curvature = np.abs(uniform_filter1d(moved.turn / way.speed, count))
    return curvature > CANTED + 2.0 * moved.turn_std / way.speed


def beyond_straight(values: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """Values less their median outside curves, which is the sensor's bias; as they are where all is curve."""
    return values if curve.all() else values - np.median(values[~curve])


def displacements(measurements: Measurements, way: Way, half_difference: bool) -> list[Reading]:
    """Primary displacement transducers, left and right of a wheelset together.

    Their mean also shows how the bogie pitches as the vehicle is braked or driven: a length per acceleration that
    depends on where the force comes from, and so is estimated.
    """
    turning = None if half_difference else (forward(way), np.zeros(len(way.s)))
    found = []
    for number, x in ((1, 1.0), (2, -1.0)):
        names = [f"primary{number}_{side}.displacement [m]" for side in ("left", "right")]
        if all(name in measurements for name in names):
            output = Output("displacement", (x, 0.0, 0.0))
            pair = [
                reading(measurements, way, name, output, turning=turning, mounting=nod(measurements.vehicle))
                for name in names
            ]
            found.append(combined(pair[0], pair[1], half_difference))
    return found


def forward(way: Way) -> np.ndarray:
    """Acceleration along the track from the speed, m/s2, shape (n,): mean over `NOD_REACH`."""
    speed = uniform_filter1d(way.speed, max(1, round(NOD_REACH / way.spacing)))
    return speed * np.gradient(speed, way.spacing)


def nod(vehicle: Mapping[str, float]) -> float:
    """Movement over a wheelset as all of the vehicle's inertia pitches the bogie, m per m/s2: the most there can be."""
    mass = vehicle["body_mass"] + vehicle["bogie_mass"] + 2.0 * vehicle["wheelset_mass"]
    lever = vehicle["secondary_height"] - vehicle["wheel_radius"]
    return mass * abs(lever) / (4.0 * vehicle["primary_vertical_stiffness"] * vehicle["semi_wheelbase"])


def add(series: pd.DataFrame, name: str, fused: Fused, way: Way, lead: float) -> None:
    """Columns of one quantity on the grid of the estimate."""
    ahead = fused.s + lead
    series[f"{name} [m]"] = np.interp(way.s, ahead, fused.values)
    series[f"{name}_std [m]"] = np.interp(way.s, ahead, fused.std)
    spacing = float(fused.s[1] - fused.s[0])
    for band, edges in bands_of(name).items():
        inside = settled(np.isfinite(fused.values), spacing, edges.longest)
        part = np.where(inside, band_pass(fused.values, spacing, edges), np.nan)
        series[f"{name}_{band} [m]"] = np.interp(way.s, ahead, part)
        series[f"{name}_{band}_std [m]"] = np.interp(way.s, ahead, fused.band_std[band])
