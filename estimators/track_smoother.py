"""Track geometry from all bogie sensors at once: Gaussian smoother over distance with the vehicle's model, and what
every value is uncertain by.
"""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from estimators import _across, _lateral_plane
from estimators._bands import band_pass, bands_of, settled
from estimators._fused import Fused, Plane, fuse
from estimators._planes import GRAVITY, Output, check_vehicle, vertical
from estimators._readings import Attitude, Reading, attitude, channels_of, combined, reading, stated
from estimators._shaping import Prior
from estimators._space import SpeedSource, Way, find_way, has_speed
from estimators.interface import Estimate, Estimator
from railsim.measurements import Measurements
from railsim.spec import quantity

ACCELERATION, PITCH = "bogie.acceleration_z [m/s2]", "bogie.rate_pitch [rad/s]"
LEVEL = 4.032e-7 * 0.8246**2  # m rad; vertical irregularity of ERRI B176 (1989) "low", where none can be fitted
CURVE_SHARES = {"d1": 0.1, "d2": 0.7, "d3": 1.0}  # illustrative: what of the error in curves falls into each band
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
LATERAL_STIFF_AND_HEAVY: tuple[str, ...] = (
    *STIFF_AND_HEAVY[:4], "primary_lateral_stiffness", "primary_longitudinal_stiffness", "secondary_lateral_stiffness",
    "roll_bar_stiffness", "wheelset_mass", "body_roll_inertia", "bogie_roll_inertia", "bogie_yaw_inertia",
)  # fmt: skip
LATERAL_DAMPED: tuple[str, ...] = (*DAMPED, "secondary_lateral_damping")
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

    creep_error: float = quantity(
        0.08, unit="- (standard deviation of the creep coefficients)", source="illustrative: dry rail", ge=0.0
    )
    spin_error: float = quantity(
        0.2, unit="- (standard deviation of that by spin beyond it)", source="illustrative: Polach, Kalker", ge=0.0
    )
    profile_error: float = quantity(
        0.05, unit="- (standard deviation of conicity, contact angle's rate)", source="illustrative: worn", ge=0.0
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
        found = {
            "vertical": fuse(self._vertical(measurements, way), way, [bands_of("vertical")], self.distance_error)[0]
        }
        found["vertical"] = found["vertical"].raised(*self._settling(measurements, way), CURVE_SHARES)
        if _across.fits(measurements):
            found |= self._sideways(measurements, wheelbase)
            canted = self._canted(measurements, way)
            level = found["cross_level"].on(way.s)
            for name, share in (("left_vertical", -0.5), ("right_vertical", 0.5)):
                found[name] = found["vertical"].with_share(level, share).without(canted)
        series = pd.DataFrame({"s [m]": out.s, "time [s]": out.time})
        for name, fused in found.items():
            add(series, name, fused, out, wheelbase / 2)
        seen = np.interp(out.s, way.s, found["vertical"].seen.astype(float)) > 0.5
        series["valid [-]"] = (out.valid & seen).astype(float)
        about: dict[str, Any] = self.model_dump()
        for name in {"vertical", "cross_level", "lateral"} & set(found):
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
            (Prior(LEVEL),),
            6,
            (),
            lambda height, slope, speed: np.array(
                [2 * height[0], 2 * height[0], *(slope[0] * np.array([2, 2 * speed, 2 * speed, speed]))]
            ),
        )

    def _sideways(self, measurements: Measurements, wheelbase: float) -> dict[str, Fused]:
        """Lateral alignment and cross level, on a coarser grid."""
        way = find_way(measurements, self.speed_source, self.slowest, wheelbase / round(wheelbase / _across.SPACING))
        plane = _across.across(measurements, way, self._unknown_sideways())
        names = ("lateral", "cross_level")
        found = fuse(plane, way, [bands_of(name) for name in names], self.distance_error)
        own = _across.long_waves(measurements, way)
        return {name: one._replace(values=one.values + more) for name, one, more in zip(names, found, own, strict=True)}

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

    def _unknown(self) -> dict[str, float]:
        """Relative standard deviations of the vehicle's parameters."""
        one = self.parameter_error
        return dict.fromkeys(STIFF_AND_HEAVY, one) | dict.fromkeys(DAMPED, 2 * one)

    def _unknown_sideways(self) -> dict[str, float]:
        one = self.parameter_error
        known = dict.fromkeys(LATERAL_STIFF_AND_HEAVY, one) | dict.fromkeys(LATERAL_DAMPED, 2 * one)
        profile = dict.fromkeys(("design_conicity", "design_contact_angle_rate"), self.profile_error)
        return known | profile | {_lateral_plane.CREEP: self.creep_error, _lateral_plane.SPIN: self.spin_error}


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

    def put(column: str, values: np.ndarray) -> None:
        known = np.isfinite(values)
        smooth = CubicSpline(ahead[known], values[known])(way.s) if known.sum() > 3 else np.full(len(way.s), np.nan)
        series[column] = np.where(np.isfinite(np.interp(way.s, ahead, values)), smooth, np.nan)

    put(f"{name} [m]", fused.values)
    series[f"{name}_std [m]"] = np.interp(way.s, ahead, fused.std)
    spacing = float(fused.s[1] - fused.s[0])
    for band, edges in bands_of(name).items():
        inside = settled(np.isfinite(fused.values), spacing, edges.longest)
        put(f"{name}_{band} [m]", np.where(inside, band_pass(fused.values, spacing, edges), np.nan))
        series[f"{name}_{band}_std [m]"] = np.interp(way.s, ahead, fused.band_std[band])
