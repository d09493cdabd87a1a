"""Runs of the figure `track_accuracy`: every estimator at every speed, and vehicles that are off nominal."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from estimators.filters.information import wavenumbers
from estimators.interface import ESTIMATORS, Estimate, Estimator
from estimators.signals.bands import BANDS, response
from estimators.speed.odometry import integrate_speed
from estimators.track import lateral_fusion
from estimators.track.alignment_accelerometer import AlignmentAccelerometer
from estimators.track.alignment_lateral import AlignmentLateral
from estimators.track.alignment_vertical import AlignmentVertical
from estimators.track.cross_level import CrossLevel
from estimators.track.geometry import TrackEstimator
from estimators.track.observations import attitude
from estimators.track.plane import TrackRegime
from estimators.track.track_smoother import TrackSmoother
from experiments.reporting.size import Size
from experiments.reporting.units import MM
from experiments.runs.track import POSITIONS, SHARE, gyro_at, sensor_name, sensors
from experiments.runs.unseen_tracks import write_unseen
from experiments.scoring.track import band_errors, true_track
from railsim import measure, simulate
from railsim.analysis.statistics import root_mean_square
from railsim.contact.pairs import WheelRailPair
from railsim.measurements import Measurements
from railsim.scenario import Scenario
from railsim.scratch import scratch_folder
from railsim.sensors.accelerometer import AXLEBOX
from railsim.truth import Truth

START = 25.0  # m
LENGTHS = {4.0: 500.0, 8.0: 1000.0, 15.0: 1500.0, 30.0: 1880.0, 45.0: 1880.0}  # m by speed, m/s
GRADES = ("mems", "industrial")
SUITES = ("", "axleboxes", "all")
FUSED = "track_smoother"
WITH_AXLEBOXES, PLAIN = "track_smoother, axleboxes", "alignment_lateral, uncompensated"
GYRO, LEVEL = "alignment_vertical, compensated", "cross_level, compensated"
ACCELEROMETER, DISPLACEMENT, AXLEBOXES = "alignment_accelerometer", "alignment_displacement", "axlebox_profile"
PLACED = 15.0  # m/s: speed at which sensors stand at several places on the bogie
RUNS = {  # track on which nothing was tuned: length in m, vehicle, speeds in m/s
    "unseen_erri_low": (600.0, "manchester", (10.0, 20.0, 40.0)),
    "unseen_erri_high": (600.0, "manchester", (10.0, 20.0, 40.0)),
    "unseen_curve_r550": (800.0, "class175", (9.0, 15.0, 24.0)),
}
STIFF_AND_HEAVY: tuple[str, ...] = (
    "primary_vertical_stiffness", "secondary_vertical_stiffness", "bogie_mass", "body_mass", "bogie_pitch_inertia",
    "primary_lateral_stiffness", "primary_longitudinal_stiffness", "secondary_lateral_stiffness",
    "roll_bar_stiffness", "wheelset_mass", "body_roll_inertia", "bogie_roll_inertia", "bogie_yaw_inertia",
)  # fmt: skip
DAMPED: tuple[str, ...] = (
    "primary_vertical_damping", "secondary_vertical_damping", "secondary_lateral_damping",
)  # fmt: skip
SPREAD = dict.fromkeys(STIFF_AND_HEAVY, 0.03) | dict.fromkeys(DAMPED, 0.06)
"""Relative standard deviations of the true parameters about the nominal ones: what a data sheet may be wrong by."""
CONICITY = 0.05  # the same of the conicity
K_SLIP = 0.112  # standard deviation of Polach's kS about 0.4: 8 % of the creep coefficients
FAST_LENGTH, SMOKE_LENGTH = 400.0, 250.0  # m
DRAWS = {"compiled": 8, "exudyn": 1}  # vehicles and specimens of their sensors for each track and speed
FAST_DRAWS, SMOKE_DRAWS = {"compiled": 2}, {"compiled": 1}
SMOKE_SPEEDS = (PLACED,)  # m/s
QUANTITIES = ("vertical", "cross_level", "left_vertical", "right_vertical", "lateral")

Task = Callable[[], Iterable[dict[str, Any]]]
"""Rows to compute."""


def accuracy_tasks(size: Size) -> dict[str, Task]:
    """One for each speed, by name; one simulation serves all estimators and grades."""
    speeds = size.of(tuple(LENGTHS), tuple(LENGTHS), SMOKE_SPEEDS)
    lengths = {speed: size.of(length, min(length, FAST_LENGTH), SMOKE_LENGTH) for speed, length in LENGTHS.items()}
    return {f"accuracy_{speed:g}_m_s": partial(_accuracy, speed, lengths[speed], size.reduced) for speed in speeds}


def coverage_tasks(size: Size) -> dict[str, Task]:
    """One for each track, speed and engine, by name; each draws some vehicles."""
    tasks: dict[str, Task] = {}
    for track, (whole, vehicle, speeds) in RUNS.items():
        length = size.of(whole, whole, SMOKE_LENGTH)
        draws_of = size.of(DRAWS, FAST_DRAWS, SMOKE_DRAWS)
        for speed, (engine, draws) in itertools.product(size.of(speeds, speeds, speeds[-1:]), draws_of.items()):
            tasks[f"{track}_{speed:g}_m_s_{engine}"] = partial(_coverage, track, vehicle, speed, length, engine, draws)
    return tasks


AS_IN_THE_PAPER: dict[str, dict[str, Any]] = {
    ACCELEROMETER: {"compensate": False},
    "cross_level": {"compensate": False},
    AXLEBOXES: {"cut": 70.0},
}
"""Settings with which the paper's chains are compared: nothing compensated, and D2 of axleboxes too."""


def _tried() -> list[tuple[str, Estimator, str]]:
    """Label, estimator and suite of sensors."""
    regimes = {name: kind for name, kind in ESTIMATORS.classes().items() if issubclass(kind, TrackEstimator)}
    built: list[Estimator] = [kind.build(AS_IN_THE_PAPER.get(name, {})) for name, kind in regimes.items()]
    built.append(TrackSmoother())
    tried: list[tuple[str, Estimator, str]] = [(one.name, one, "") for one in built]
    tried.append((PLAIN, AlignmentLateral(compensation=False), ""))
    tried.append((GYRO, AlignmentVertical(compensate=True), ""))
    tried.append((LEVEL, CrossLevel(compensate=True), ""))
    tried.append((WITH_AXLEBOXES, TrackSmoother(), "axleboxes"))
    return tried


def _accuracy(speed: float, length: float, fast: bool) -> list[dict[str, Any]]:
    """Rows of the table of errors."""
    truth = _truth("straight_erri_low", "manchester", speed, length, "compiled" if fast else "exudyn")
    rows: list[dict[str, Any]] = []
    for grade in GRADES:
        recordings = {more: measure(truth, scenario("manchester", speed, grade, more)).measurements for more in SUITES}
        limits = alone(recordings["all"])
        for name, estimator, suite in _tried():
            if not suite and not estimator.fits(recordings[""]):
                suite = "all"
            if not estimator.fits(recordings[suite]):
                continue
            head = {"part": "accuracy", "estimator": name, "speed [m/s]": speed, "grade": grade}
            for row in _bands(estimator.estimate(recordings[suite]), truth):
                limit = limits.get((name.partition(",")[0], row["quantity"], row["band"]))
                rows.append(head | row | ({} if limit is None else {"bound [mm]": MM * limit}))
    return rows + (_by_position(truth, speed) if speed == PLACED else [])


def _by_position(truth: Truth, speed: float) -> list[dict[str, Any]]:
    """Vertical D1 by an accelerometer and by a gyro at several places on the bogie; three specimens each."""
    suite = scenario("manchester", speed, "mems", sensors=sensors("mems"))
    recordings = [measure(truth, suite, seed).measurements for seed in (1, 2, 3)]
    rows = []
    for x in POSITIONS:
        moved = [gyro_at(x, one) for one in recordings]
        for name, estimator, on in (
            (ACCELEROMETER, AlignmentAccelerometer(sensor=sensor_name(x), compensate=False), recordings),
            (GYRO, AlignmentVertical(compensate=True), moved),
        ):
            head = {"part": "place", "estimator": name, "speed [m/s]": speed, "grade": "mems", "place [m]": x}
            for seed, recording in enumerate(on):
                errors = _bands(estimator.estimate(recording), truth)
                rows += [head | {"seed": seed} | row for row in errors if row["quantity"] == "vertical"]
    return rows


def alone(measurements: Measurements) -> dict[tuple[str, str, str], float]:
    """Cramer-Rao bounds of what single kinds of sensors can tell, m, by estimator, quantity and band.

    The vehicle's model, the data sheets and the shape and level of ERRI's spectrum are taken to be known.
    """
    odometry = integrate_speed(measurements, spacing=measurements.vehicle["semi_wheelbase"] / 5.0)
    nothing, speed = np.zeros(len(odometry.s)), float(np.median(odometry.speed))
    up = TrackSmoother().vertical_plane(measurements, odometry, attitude(measurements, odometry))
    side = lateral_fusion.across(
        measurements, odometry, {}, {}, (TrackRegime(),), nothing.astype(int), lambda _: (nothing, 0.0)
    )[0]
    by = {
        "alignment_vertical": (("bogie.rate_pitch",), ()),
        ACCELEROMETER: (("bogie.acceleration_z",), ()),
        DISPLACEMENT: (("bogie.acceleration_z", "bogie.rate_pitch", "primary"), ("bogie.rate_roll", "primary")),
        AXLEBOXES: (("axlebox1_left.acceleration_z",), ()),
        "alignment_lateral": ((), ("bogie.rate_yaw", "bogie.rate_roll")),
        "cross_level": ((), ("bogie.rate_roll",)),
    }
    bounds_by_case: dict[tuple[str, str, str], float] = {}
    for estimator, regimes in by.items():
        for plane, starts, names in ((up, regimes[0], ("vertical",)), (side, regimes[1], ("lateral", "cross_level"))):
            own = [one.name for one in plane.observations if starts and one.name.startswith(starts)]
            if own:
                bounds = plane.only(own).bounds(speed, plane.priors, [BANDS] * len(names))
                bounds_by_case |= {
                    (estimator, name, band): value
                    for name, of in zip(names, bounds, strict=True)
                    for band, value in of.items()
                }
        for band in BANDS if all(regimes) else ():
            rail = float(
                np.hypot(
                    bounds_by_case[estimator, "vertical", band], bounds_by_case[estimator, "cross_level", band] / 2.0
                )
            )
            bounds_by_case |= {(estimator, f"{name}_vertical", band): rail for name in ("left", "right")}
    heights = up.priors[0].density(wavenumbers()) + side.priors[1].density(wavenumbers()) / 4.0
    for band, value in _rail(heights, AXLEBOX.noise_density, speed).items():
        bounds_by_case |= {(AXLEBOXES, f"{name}_vertical", band): value for name in ("left", "right")}
    return bounds_by_case


def _rail(heights: np.ndarray, density: float, speed: float) -> dict[str, float]:
    """The bound of one rail's height by both axleboxes of a wheelset that is rigid, m, by band.

    Parameters
    ----------
    heights : the rail's prior spectrum at `wavenumbers`, m^2/(rad/m). density : noise of one axlebox, m/s2/sqrt(Hz).
    """
    k = wavenumbers()
    noise = (SHARE * density) ** 2 * speed / (2.0 * np.pi) / (speed * k) ** 4
    left = 1.0 / (1.0 / heights + 1.0 / noise)
    return {
        name: float(np.sqrt(np.trapezoid(left * response(k, band) ** 2 * k, np.log(k)))) for name, band in BANDS.items()
    }


def _coverage(
    track: str, vehicle: str, speed: float, length: float, engine: str, draws: int
) -> Iterator[dict[str, Any]]:
    """Rows of the share within two standard deviations of vehicles whose true parameters are drawn."""
    with scratch_folder() as folder:
        file = str(write_unseen(Path(folder))[track])
        for seed in range(draws):
            yield from _covered(track, file, vehicle, speed, length, engine, seed)


def _covered(
    track: str, file: str, vehicle: str, speed: float, length: float, engine: str, seed: int
) -> list[dict[str, Any]]:
    rng = np.random.default_rng([96, list(RUNS).index(track), round(speed), seed])
    factors = {name: float(np.exp(spread * rng.standard_normal())) for name, spread in SPREAD.items()}
    conicity = float(np.exp(CONICITY * rng.standard_normal()))
    k_slip = float(np.clip(0.4 + K_SLIP * rng.standard_normal(), 0.05, 1.0))
    truth = _truth(file, vehicle, speed, length, engine, (factors, conicity, k_slip))
    estimate = TrackSmoother().estimate(measure(truth, scenario(vehicle, speed, "mems"), seed=seed).measurements)
    head = {"part": "coverage", "estimator": FUSED, "speed [m/s]": speed, "grade": "mems", "track": track}
    return [head | {"seed": seed, "engine": engine} | row for row in _bands(estimate, truth)]


def _bands(estimate: Estimate, truth: Truth) -> Iterator[dict[str, Any]]:
    """One row for each quantity and band of an estimate that can be scored."""
    series = estimate.series
    if series.columns[0] != "s [m]":
        return
    quantities = [name for name in QUANTITIES if f"{name} [m]" in series.columns]
    spacing = float(np.median(np.diff(series["s [m]"])))
    true = true_track(truth, series["time [s]"].to_numpy(), spacing) if quantities else None
    for quantity in quantities:
        for band in ("d1", "d2", "d3"):
            rows = band_errors(estimate, truth, quantity, band, true)
            if rows.empty:
                continue
            error = (rows["estimated [m]"] - rows["true [m]"]).to_numpy()
            spread = rows["std [m]"].to_numpy()
            stated = bool(np.isfinite(spread).all())
            yield {
                "quantity": quantity,
                "band": band,
                "points": len(rows),
                "rms error [mm]": MM * root_mean_square(error),
                "true rms [mm]": MM * root_mean_square(rows["true [m]"]),
                "std [mm]": MM * root_mean_square(spread),
                "bound [mm]": MM * _bound(estimate.about, quantity, band),
                "within 2 std [-]": float(np.mean(np.abs(error) <= 2.0 * spread)) if stated else np.nan,
            }


def _bound(about: Mapping[str, Any], quantity: str, band: str) -> float:
    """Cramer-Rao bound of a band that a fused estimate states, m; of a rail by vertical and cross level."""

    def of(name: str) -> float:
        return float(about.get(f"{name}_{band}_bound [m]", np.nan))

    rail = quantity in ("left_vertical", "right_vertical")
    return float(np.hypot(of("vertical"), of("cross_level") / 2.0)) if rail else of(quantity)


def _truth(
    track: str,
    vehicle: str,
    speed: float,
    length: float,
    engine: str,
    changes: tuple[dict[str, float], float, float] | None = None,
) -> Truth:
    """One run; `changes` : factors of the vehicle's parameters and of the conicity, Polach's kS."""
    duration = float(np.floor(length / speed))
    run = scenario(vehicle, speed, "mems", track=track, duration=duration)
    if changes:
        nominal, (factors, conicity, k_slip) = run.vehicle.nominal(), changes
        changed: dict[str, Any] = {"name": vehicle} | {name: nominal[name] * one for name, one in factors.items()}
        changed["pair"] = {"conicity": conicity * WheelRailPair().conicity}
        changed["adhesion"] = {"k_slip": k_slip}
        run = scenario(changed, speed, "mems", track=track, duration=duration)
    return simulate(run, engine=engine)


def scenario(vehicle: Any, speed: float, grade: str, more: str = "", **values: Any) -> Scenario:
    """Bogie sensors of that grade, a tachometer; `more` : "axleboxes" (leading wheelset), "all": transducers too."""
    common = {"name": "bogie", "body": "bogie", "rate": 256, "errors": grade}
    suite: list[dict[str, Any]] = [
        {"kind": "accelerometer", **common},
        {"kind": "gyro", **common},
        {"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 64, "radius_error": 0.01},
    ]
    for side, y in (("left", 1.0), ("right", -1.0)) if more else ():
        place = {"name": f"axlebox1_{side}", "body": "wheelset1", "position": [0, y, 0], "axes": ["y", "z"]}
        suite.append({"kind": "accelerometer", **place, "rate": 1024, "errors": "axlebox"})
        if more == "all":
            suite.append({"kind": "displacement", "name": f"primary1_{side}", "rate": 256, "errors": "transducer"})
    head = {"vehicle": vehicle, "speed": {"kind": "constant", "speed": speed}, "start": START, "seed": 3}
    track = {"track": "straight_erri_low", "duration": 10.0, "output_rate": 1024}
    return Scenario.build(head | track | {"sensors": suite} | values)
