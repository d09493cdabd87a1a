"""Track geometry from all bogie sensors at once: Gaussian smoother over distance with the vehicle's model, and what
every value is uncertain by.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from estimators.filters.track_spectrum import ERRI_VERTICAL
from estimators.interface import Estimate, Estimator, Missing
from estimators.signals.bands import BANDS, band_pass, bands_of, settled
from estimators.speed.odometry import Odometry, SpeedSource, integrate_speed, missing_speed
from estimators.track import lateral_fusion
from estimators.track.alignment_displacement import AlignmentDisplacement
from estimators.track.disturbances import FORCE, HEIGHT, Disturbance
from estimators.track.fusion import Fused, fuse
from estimators.track.geometry import by_speed
from estimators.track.observations import CURVE_REACH, LOAD, Attitude, attitude, beyond_straight, curved, observation
from estimators.track.plane import Plane
from estimators.track.plane_fit import PlaneFit
from estimators.track.self_check import Opinion, checked, sinking
from estimators.track.sensor_pairs import axleboxes, channels_of, displacements, without_roll
from estimators.track.slow_motions import nod
from estimators.vehicle.creep import CREEP_FACTOR, SPIN_FACTOR
from estimators.vehicle.parameters import given, numbers
from estimators.vehicle.state_space import CANT_BASE, Output
from estimators.vehicle.vertical import COORDINATES, coordinates_of, vertical
from railsim.constants import GRAVITY
from railsim.data_sheet import channels_on, data_sheet
from railsim.measurements import Measurements
from railsim.spec import quantity

ACCELERATION, PITCH = "bogie.acceleration_z [m/s2]", "bogie.rate_pitch [rad/s]"
CURVE_SHARES = {"d1": 0.1, "d2": 0.7, "d3": 1.0}  # illustrative: what of the error in curves falls into each band
LIFT_MEMORY = 50.0  # m; the primary suspension has forgotten
NEEDED = (
    "body_mass", "bogie_mass", "bogie_pitch_inertia", "wheel_radius", "secondary_height", "wheelset_mass",
    "semi_wheelbase", "primary_vertical_stiffness", "primary_vertical_damping", "secondary_vertical_stiffness",
    "secondary_vertical_damping",
)  # fmt: skip
"""Nominal parameters without which nothing is estimated, SI units."""
NEEDED_BY_PLAIN = ("semi_wheelbase", "primary_half_spacing")
STIFF_AND_HEAVY: tuple[str, ...] = (
    "primary_vertical_stiffness",
    "secondary_vertical_stiffness",
    "bogie_mass",
    "body_mass",
    "bogie_pitch_inertia",
    "traction_rod_stiffness",
)
DAMPED: tuple[str, ...] = ("primary_vertical_damping", "secondary_vertical_damping")
LATERAL_STIFF_AND_HEAVY: tuple[str, ...] = (
    "body_mass", "body_roll_inertia", "secondary_lateral_stiffness", "roll_bar_stiffness", "primary_lateral_stiffness",
)  # fmt: skip
LATERAL_DAMPED: tuple[str, ...] = ("secondary_lateral_damping", "yaw_damper_damping")
LITTLE_SEEN: tuple[str, ...] = (
    *STIFF_AND_HEAVY[:3], "primary_longitudinal_stiffness", "wheelset_mass", "bogie_roll_inertia", "bogie_yaw_inertia",
)  # fmt: skip
"""Of these the lateral readings say too little; they are not fitted."""
BODY, BOUNCE, PITCHING = (COORDINATES.index(name) for name in ("body.z", "bogie.z", "bogie.pitch"))
DISTURBANCES = (
    Disturbance("force on the body", (BODY,), size=0.1, spread=3.0, begins=(0.02, 0.7)),
    Disturbance("force on the bogie", (BOUNCE,), FORCE, size=0.03),
    Disturbance("moment on the bogie", (PITCHING,), FORCE, size=0.1),
    Disturbance("wheelsets over the rails", (0, 1), HEIGHT, of_rails=True, size=0.01, spread=0.6),
)
"""What is not in the vertical model: the other bogie and the body's pitch, rods, and wheels that climb in the gauge.
The spread of the last was narrowed from 1.5 after a stop on jointed track, where it took the track's slope.
"""


class TrackSmoother(Estimator, frozen=True):
    """Vertical and lateral alignment, cross level and both rails, from all sensors of a vehicle together.

    A Kalman filter and smoother with the vehicle's model.
    """

    speed_source: SpeedSource = quantity("tachometer", unit="-", source="tachometer or refined")
    slowest: float = quantity(1.0, unit="m/s", source="illustrative", gt=0.0)
    parameter_error: float = quantity(
        0.03,
        unit="- (of stiffness, mass, inertia as a data sheet gives them; dampers twice that)",
        source="illustrative",
        gt=0.0,
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
        0.08, unit="- (of the creep coefficients on dry rails)", source="illustrative: dry rail", gt=0.0
    )
    spin_error: float = quantity(
        0.2, unit="- (of that by spin beyond it)", source="illustrative: Polach, Kalker", gt=0.0
    )
    profile_error: float = quantity(
        0.05, unit="- (of conicity, contact angle's rate as the profiles give them)", source="illustrative", gt=0.0
    )

    requires: ClassVar[tuple[str, ...]] = (ACCELERATION, PITCH)
    adds: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            **dict.fromkeys(channels_of("displacement [m]"), "smaller deviations of all quantities"),
            **dict.fromkeys(
                (lateral_fusion.YAW, lateral_fusion.ROLL, lateral_fusion.SIDE),
                "lateral alignment, cross level, each rail (with the others of the three)",
            ),
            **dict.fromkeys(channels_of("acceleration_z [m/s2]"), "smaller deviations of all quantities"),
        }
    )

    def missing(self, measurements: Measurements) -> Missing:
        """What is needed and not there, a speed among it."""
        return super().missing(measurements) + missing_speed(measurements, self.speed_source)

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """What the vehicle's model needs."""
        return NEEDED

    def estimate(self, measurements: Measurements) -> Estimate:
        """Smooth the whole record.

        Raises
        ------
        InputError : a channel, the speed or a parameter of the vehicle is missing.
        """
        self.need(measurements)
        vehicle = measurements.vehicle
        numbers(vehicle, NEEDED)
        wheelbase = 2.0 * vehicle["semi_wheelbase"]
        out = integrate_speed(measurements, self.speed_source, self.slowest)
        odometry = integrate_speed(
            measurements, self.speed_source, self.slowest, wheelbase / round(wheelbase / out.spacing)
        )
        moved = attitude(measurements, odometry)
        plane = self.vertical_plane(measurements, odometry, moved)
        tracks = {"vertical": fuse([plane], odometry, [bands_of("vertical")], self.distance_error)[0]}
        tracks["vertical"] = tracks["vertical"].raised(*self._settling(vehicle, odometry, moved), CURVE_SHARES)
        tracks["vertical"] = tracks["vertical"].widened(
            sinking(vehicle, ERRI_VERTICAL.scaled(tracks["vertical"].level))
        )
        tracks["vertical"] = tracks["vertical"].widened(nodding(vehicle, odometry))
        if lateral_fusion.fits(measurements):
            tracks |= self._sideways(measurements, Lift(plane, tracks["vertical"], self.distance_error))
            canted = self._canted(odometry, moved)
            level = tracks["cross_level"].on(odometry.s)
            for name, share in (("left_vertical", -0.5), ("right_vertical", 0.5)):
                tracks[name] = tracks["vertical"].with_share(level, share).without(canted | level.hidden)
        series = pd.DataFrame({"s [m]": out.s, "time [s]": out.time})
        for name, fused in tracks.items():
            add(series, name, fused, out, wheelbase / 2)
        seen = np.interp(out.s, odometry.s, tracks["vertical"].seen.astype(float)) > 0.5
        series["valid [-]"] = (out.valid & seen).astype(float)
        warnings = list[str]()
        fitted = [name for name in ("vertical", "lateral", "cross_level") if name in tracks]
        for name in fitted:
            opinion = self._opinion(measurements) if name == "vertical" else None
            columns, words = checked(series, name, tracks[name].fit.misfit, opinion)
            series = series.assign(**columns)
            warnings += words
        about: dict[str, Any] = self.model_dump() | {"warnings": sorted(warnings)} | out.stated()
        for name in fitted:
            about[f"{name}_level [m rad]"] = tracks[name].level
            about |= {f"{name}_{band}_bound [m]": bound for band, bound in tracks[name].bounds.items()}
            about[f"{name}_fit"] = _told(tracks[name].fit)
        return Estimate(self.name, series, about)

    def vertical_plane(self, measurements: Measurements, odometry: Odometry, moved: Attitude | None) -> Plane:
        """The vertical plane with all that is read of it; `moved` : what `attitude` gives for the grid."""
        rate, force, across, side, roll_std = None, None, None, None, 0.0
        if moved is not None:
            rate = moved.roll * moved.curving_rate
            force = centripetal(moved, odometry)
            across, side = (moved.yaw_rate, moved.roll_rate), (moved.side, np.zeros(len(odometry.s)))
            roll_std = moved.roll_std
        observations = [
            observation(measurements, odometry, name, Output("rate"), rate, across, roll_std=roll_std)
            for name in channels_on(measurements, "bogie", "rate_pitch")
        ]
        for name in channels_on(measurements, "bogie", "acceleration_z"):
            output = Output("acceleration", data_sheet(measurements.about, name).position)
            one = observation(measurements, odometry, name, output, force, side, GRAVITY, roll_std)
            observations += without_roll(measurements, odometry, one, moved)
        observations += displacements(measurements, odometry, half_difference=False)
        observations += axleboxes(measurements, odometry, half_difference=False)
        outputs = [one.output for one in observations]
        return Plane(
            lambda p, _speed: vertical(p, outputs),
            dict(measurements.vehicle),
            {},
            self._spreads(measurements.vehicle, STIFF_AND_HEAVY, DAMPED),
            observations,
            (ERRI_VERTICAL,),
            DISTURBANCES,
            lambda height, slope, speed: _start(measurements.vehicle, height[0], slope[0], speed),
        )

    def _sideways(self, measurements: Measurements, lift: "Lift") -> dict[str, Fused]:
        """Lateral alignment and cross level, on a coarser grid."""
        wheelbase = lift.plane.wheelbase
        odometry = integrate_speed(
            measurements, self.speed_source, self.slowest, wheelbase / round(wheelbase / lateral_fusion.SPACING)
        )
        moved = attitude(measurements, odometry)
        curve = np.zeros(len(odometry.s), dtype=bool) if moved is None else curved(moved, odometry)
        curve = maximum_filter1d(curve, max(1, round(CURVE_REACH / odometry.spacing)))
        unbalanced = np.zeros(len(odometry.s)) if moved is None else self._unbalanced(odometry, moved)
        regimes, kind = lateral_fusion.track_regimes(measurements.vehicle, curve, unbalanced)
        fitted = self._spreads(measurements.vehicle, LATERAL_STIFF_AND_HEAVY, LATERAL_DAMPED)
        fitted |= dict.fromkeys(("design_conicity", "design_contact_angle_rate"), self.profile_error)
        fitted |= {CREEP_FACTOR: self.creep_error}
        unknown = self._spreads(measurements.vehicle, LITTLE_SEEN, DAMPED) | {SPIN_FACTOR: self.spin_error}
        planes = lateral_fusion.across(
            measurements, odometry, fitted, unknown, regimes, kind, lambda output: lift(output, odometry)
        )
        names = ("lateral", "cross_level")
        fused = fuse(planes, odometry, [bands_of(name) for name in names], self.distance_error)
        own = lateral_fusion.long_waves(measurements.vehicle, odometry, moved)
        lateral, level = (one._replace(values=one.values + more) for one, more in zip(fused, own, strict=True))
        if curve.any():  # the path's long waves reach far into the bands where the record ends
            ends = np.minimum(odometry.s, odometry.s[-1] - odometry.s) < lateral_fusion.LONGEST / 2.0
            lateral = lateral.without(np.logical_or(curve, ends))
        if not any(one.output.kind == "displacement" for one in planes[0].observations):
            leaning = LOAD * lean(measurements.vehicle, unbalanced * curve) * CANT_BASE
            level = level.raised(np.zeros(len(odometry.s)), leaning, CURVE_SHARES)
        if moved is not None:  # the attitude through a gap is a guess, which stands in both
            lateral, level = lateral.without(moved.bridged), level.without(moved.bridged)
        return {"lateral": lateral, "cross_level": level}

    def _opinion(self, measurements: Measurements) -> Opinion | None:
        """The plain estimate from transducers, where there is one."""
        plain = AlignmentDisplacement.build({"speed_source": self.speed_source, "slowest": self.slowest})
        if not (plain.fits(measurements) and given(measurements.vehicle, NEEDED_BY_PLAIN)):
            return None
        return Opinion(plain.estimate(measurements))

    def _unbalanced(self, odometry: Odometry, moved: Attitude) -> np.ndarray:
        """Lateral acceleration that cant does not balance, m/s2."""
        side = beyond_straight(moved.side, curved(moved, odometry))
        return uniform_filter1d(side, max(1, round(CURVE_REACH / odometry.spacing)))

    def _settling(
        self, p: Mapping[str, Any], odometry: Odometry, moved: Attitude | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """How far the primary springs give under the larger force in a canted curve, m; what is unsure in curves, m."""
        if moved is None:
            return np.zeros(len(odometry.s)), np.zeros(len(odometry.s))
        settled = (
            (p["bogie_mass"] + p["body_mass"]) * centripetal(moved, odometry) / (4 * p["primary_vertical_stiffness"])
        )
        curve = curved(moved, odometry)
        canted = uniform_filter1d(
            np.abs(beyond_straight(moved.roll, curve)), max(1, round(CURVE_REACH / odometry.spacing))
        )
        return settled, self.curve_error * canted * curve

    def _canted(self, odometry: Odometry, moved: Attitude | None) -> np.ndarray:
        """Where a curve's cant stands in the cross level and cannot be told from a rail's own irregularity."""
        if moved is None:
            return np.zeros(len(odometry.s), dtype=bool)
        return maximum_filter1d(curved(moved, odometry), max(1, round(2 * CURVE_REACH / odometry.spacing)))

    def _spreads(self, vehicle: Mapping[str, Any], stiff: Sequence[str], damped: Sequence[str]) -> dict[str, float]:
        """Scales of the logarithms of those parameters that the vehicle has."""
        spreads = dict.fromkeys(stiff, self.parameter_error) | dict.fromkeys(damped, 2.0 * self.parameter_error)
        return {name: spread for name, spread in spreads.items() if vehicle.get(name, 0.0) > 0.0}


@dataclass(frozen=True)
class Lift:
    """What the vertical estimate says of sensors at the wheelsets.

    Attributes
    ----------
    plane, fused : the vertical plane and what came of it.
    distance_error : as in `TrackSmoother`.
    """

    plane: Plane
    fused: Fused
    distance_error: float

    def __call__(self, output: Output, odometry: Odometry) -> tuple[np.ndarray, float]:
        """Course of the output over a grid, shape (n,), and the density of its error, the largest of D1."""
        steps = 2 if output.kind == "axlebox" else 1  # over which its reading is a mean

        def response(k: np.ndarray, speed: float) -> np.ndarray:
            lead, trail = vertical(self.fused.fit.plane.vehicle, [output]).response(k * speed)[:, 0].T
            return lead + trail * np.exp(-1j * k * self.plane.wheelbase)

        def gains(speed: float) -> list[Callable[[np.ndarray], np.ndarray]]:
            def gain(k: np.ndarray) -> np.ndarray:
                mean = np.sinc(k * odometry.spacing / (2.0 * np.pi)) * np.exp(-0.5j * k * odometry.spacing)
                return response(k, speed) * mean**steps

            return [gain]

        course = by_speed([self.fused.on(odometry.s).values], odometry, gains, LIFT_MEMORY)
        speed = float(np.median(odometry.speed))
        priors = [self.plane.priors[0].scaled(self.fused.level)]
        plane, sizes = self.fused.fit.plane, self.fused.fit.sizes[0]
        known = plane.information(speed, odometry.spacing, self.distance_error, priors, sizes)
        inside = (known.wavenumber > 2 * np.pi / BANDS["d1"].longest) & (
            known.wavenumber < 2 * np.pi / BANDS["d1"].shortest
        )
        error = known.with_model_error[inside, 0] * np.abs(response(known.wavenumber[inside], speed)) ** 2
        return course, float(np.sqrt(2.0 * np.pi / speed * error.max()))


def _start(vehicle: Mapping[str, Any], height: float, slope: float, speed: float) -> np.ndarray:
    """Standard deviations of the vertical plane's states at the start: the track's, twice that above springs."""
    along = len(coordinates_of(vehicle)) - len(COORDINATES)
    positions = [2 * height, 2 * height, 2 * slope, *[height] * along]
    rates = [2 * speed * slope, 2 * speed * slope, speed * slope, *[speed * slope] * along]
    return np.array([*positions, *rates])


def _told(found: PlaneFit) -> dict[str, Any]:
    """What a fit found of the unknowns, as numbers with names."""
    nominal = found.plane.usual_of or found.plane.vehicle
    return {
        "factors": {name: found.plane.vehicle.get(name, 1.0) / nominal.get(name, 1.0) for name in found.plane.fitted},
        "disturbances": {
            one.name: float(size) for one, size in zip(found.plane.disturbances, found.sizes[0], strict=True)
        },
        "trust": found.plane.trust,
        "misfit": {band: one._asdict() for band, one in found.misfit.items()},
    }


def centripetal(moved: Attitude, odometry: Odometry) -> np.ndarray:
    """Vertical specific force less gravity that a canted curve makes, m/s2: -V r roll - g roll^2 / 2."""
    return -odometry.speed * moved.curving_rate * moved.roll - GRAVITY * moved.roll**2 / 2


def nodding(vehicle: Mapping[str, Any], odometry: Odometry) -> dict[str, np.ndarray]:
    """What the bogie's pitch by braking may look like in each band, m, shapes (n,).

    Brakes act somewhere between rail and bogie, which nobody states. Read as slope of the track, the pitch is error.
    """
    slope = nod(vehicle, odometry, odometry.time)
    bands = bands_of("vertical").items()
    return {name: np.abs(band_pass(slope, odometry.spacing, band, integrate=1)) for name, band in bands}


def lean(p: Mapping[str, float], unbalanced: np.ndarray) -> np.ndarray:
    """Roll of the body on its springs by lateral acceleration (m/s2) that cant does not balance, at rest, rad."""
    stiffness = 2.0 * p["secondary_vertical_stiffness"] * p["secondary_half_spacing"] ** 2 + p["roll_bar_stiffness"]
    return np.abs(unbalanced) * p["body_mass"] * (p["body_height"] - p["secondary_height"]) / stiffness


def add(series: pd.DataFrame, name: str, fused: Fused, odometry: Odometry, lead: float) -> None:
    """Columns of one quantity on the grid of the estimate."""
    ahead = fused.s + lead

    def put(column: str, values: np.ndarray, known: np.ndarray) -> None:
        shown = np.interp(odometry.s, ahead, known.astype(float)) > 1.0 - 1e-9
        series[column] = np.where(shown, CubicSpline(ahead, values)(np.clip(odometry.s, ahead[0], ahead[-1])), np.nan)

    put(f"{name} [m]", fused.values, ~fused.hidden)
    series[f"{name}_std [m]"] = np.interp(odometry.s, ahead, fused.std)
    spacing = float(fused.s[1] - fused.s[0])
    for band, edges in bands_of(name).items():
        inside = settled(~fused.hidden, spacing, edges.longest)
        put(f"{name}_{band} [m]", band_pass(fused.values, spacing, edges), inside)
        series[f"{name}_{band}_std [m]"] = np.interp(odometry.s, ahead, fused.band_std[band])
