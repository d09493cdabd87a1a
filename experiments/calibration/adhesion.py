"""Calibration of the adhesion classifier: its scenarios, its fit, and the file that the estimator ships with.

`python -m experiments.calibration.adhesion [--vehicle class175] [--out FILE]` makes the file again (compiled engine).
"""

import argparse
import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from estimators.adhesion.adhesion_creep_forces import AdhesionCreepForces
from estimators.adhesion.classifier import FILE, LEVELS, softmax, terms
from estimators.adhesion.creep_force_estimator import SETTLE
from estimators.adhesion.creep_forces import RATE
from estimators.adhesion.features import SETS, features, windows
from estimators.vehicle.lateral_frequency import is_whole
from experiments.runs.adhesion import CLEAR, recording, sensors
from railsim import load_scenario
from railsim.analysis.statistics import root_mean_square
from railsim.contact.adhesion import CONDITIONS
from railsim.scratch import scratch_folder
from railsim.track import spectra, synthesis
from railsim.track.files import write_track
from railsim.track.track import Track

SPEEDS = (15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0)  # m/s; each run is a little beside one of these
AROUND = 0.08  # largest relative distance from them
DURATION = 30.0  # s
LENGTH = 1600.0  # m of a track
SPACING = 0.2
QUANTITIES = ("lateral", "vertical", "cross_level", "gauge_deviation")
BAND = spectra.Band(shortest=1.0, longest=100.0)
HOPS = {10.0: 5.0, 4.0: 4.0}  # s between windows
PENALTIES = {"level": 1e-3, "slope": 1e-2}
DIGITS = 4
SHIPPED = Path("estimators/adhesion") / FILE
SPREAD = {
    "body_mass": (0.95, 1.2),
    "secondary_lateral_damping": (0.5, 1.1),
    "yaw_damper_damping": (0.5, 1.1),
    "primary_longitudinal_stiffness": (0.85, 1.15),
    "primary_lateral_stiffness": (0.85, 1.15),
}
"""Range of the factors of parameters in the runs with vehicles off their nominal parameters (illustrative)."""
WHOLE_SPREAD = {
    "secondary_lateral_damping": (0.1, 1.1),
    "yaw_damper_damping": (0.1, 1.1),
    "primary_longitudinal_stiffness": (0.85, 1.15),
    "primary_lateral_stiffness": (0.85, 1.15),
}
"""The same of whole vehicles: dampers may be all but gone, and what changes the mass is the payload."""
PAYLOADS = (0.0, 0.4)  # over the body's mass
SEVERITIES = (0.05, 0.4)  # of worn profiles
NOMINAL, VARIED, FAULTY = KINDS = ("nominal", "off nominal", "faulty")
WORN = 0.5  # share of them with S1002 wheels on 60E1 rails, whose conicity changes with the shift
CONICITIES = (0.07, 0.22)  # of these vehicles' wheels; new to worn (illustrative)
LEFT = 2  # tracks that are left out at a time


class CalibrationTrack(NamedTuple):
    """A track of the calibration: spectrum, seed, factors of lateral, vertical, cross level and gauge irregularity."""

    spectrum: str
    seed: int
    factors: tuple[float, float, float, float]
    grade: str


class CalibrationRun(NamedTuple):
    """One run: places of the track in `TRACKS` and of the level in `LEVELS`, m/s, seed, the track's file, its kind."""

    track: int
    speed: float
    level: int
    seed: int
    path: Path
    kind: str


TRACKS = (
    CalibrationTrack("erri_low", 7001, (1.0, 1.0, 1.0, 1.0), "mems"),
    CalibrationTrack("erri_low", 7002, (0.7, 1.0, 1.0, 1.0), "industrial"),
    CalibrationTrack("erri_low", 7003, (1.4, 0.7, 0.5, 1.0), "mems"),
    CalibrationTrack("erri_low", 7004, (1.0, 0.3, 0.0, 1.0), "industrial"),
    CalibrationTrack("erri_low", 7005, (1.0, 1.0, 1.5, 0.5), "mems"),
    CalibrationTrack("erri_low", 7006, (1.8, 0.0, 0.0, 2.0), "mems"),
    CalibrationTrack("erri_high", 7007, (1.0, 1.0, 1.0, 1.0), "mems"),
    CalibrationTrack("erri_high", 7008, (0.8, 1.0, 0.3, 1.0), "industrial"),
    CalibrationTrack("erri_high", 7009, (1.0, 0.5, 0.0, 1.5), "mems"),
    CalibrationTrack("erri_high", 7010, (0.6, 1.0, 1.0, 1.0), "mems"),
    CalibrationTrack("fra_6", 7011, (0.7, 0.7, 0.7, 0.7), "industrial"),
    CalibrationTrack("fra_6", 7012, (1.0, 1.0, 0.6, 1.0), "mems"),
    CalibrationTrack("fra_6", 7013, (0.8, 0.0, 0.0, 1.0), "mems"),
    CalibrationTrack("fra_6", 7014, (0.6, 1.0, 1.4, 0.3), "mems"),
)


class Windows(NamedTuple):
    """Features of windows, (n, f), with speed m/s, level (place in `LEVELS`) and track (place in `TRACKS`)."""

    features: np.ndarray
    speed: np.ndarray
    level: np.ndarray
    track: np.ndarray


def main(arguments: list[str] | None = None) -> None:
    """Simulate, fit, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vehicle", default="class175")
    parser.add_argument("--out", default=str(SHIPPED))
    given = parser.parse_args(arguments)
    found = collect(given.vehicle)
    fitted = {f"{kind}, {window:g} s": fit(found[kind, window]) for kind, window in found}
    write(Path(given.out), given.vehicle, fitted, _apart(given.vehicle) is not None)


def write(path: Path, vehicle: str, classifiers: dict[str, Any], whole: bool = False) -> None:
    """Put a (`whole` or half) vehicle's calibration into the file, in place of an older one."""
    stored = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {"vehicles": {}}
    stored["vehicles"][vehicle] = {
        "scenarios": scenarios(whole),
        "classifiers": classifiers,
    }
    lines = json.dumps(stored, separators=(",", ":")).replace('"mean"', '\n"mean"')
    path.write_text(lines + "\n", encoding="utf-8")


def scenarios(whole: bool = False) -> dict[str, Any]:
    """What the calibration ran over, as it stands in the file."""
    vehicles = "nominal; on every second track also with factors and conicity at random"
    found: dict[str, Any] = {
        "tracks": [{**one._asdict(), "factors": list(one.factors)} for one in TRACKS],
        "factors": list(QUANTITIES),
        "speeds [m/s]": list(SPEEDS),
        "speeds vary by": AROUND,
        "duration [s]": DURATION,
        "levels": list(LEVELS),
        "vehicles": vehicles + ("; on those between also with worn wheels or a damper gone" if whole else ""),
        "factors of the vehicle": {name: list(bounds) for name, bounds in (WHOLE_SPREAD if whole else SPREAD).items()},
        "conicities": list(CONICITIES),
        "engine": "compiled",
    }
    if whole:
        found |= {"payloads": list(PAYLOADS), "share of S1002 wheels": WORN, "severities of wear": list(SEVERITIES)}
    return found


def collect(vehicle: str) -> dict[tuple[str, float], Windows]:
    """Features of every window of every run, by set of sensors and length of the window."""
    return gathered(vehicle, _runs(_apart(vehicle) is not None))


def gathered(vehicle: str, runs: Iterable[CalibrationRun]) -> dict[tuple[str, float], Windows]:
    """Features of every window of some runs."""
    rows: dict[tuple[str, float], list[tuple[np.ndarray, float, int, int]]] = {}
    apart = _apart(vehicle)
    for one in runs:
        settings = {"vehicle": {"name": vehicle, "adhesion": LEVELS[one.level]}, "track": str(one.path)}
        unknown = _unknown(vehicle, one.seed) if one.kind != NOMINAL else {}
        effects: list[dict[str, Any]] = []
        if one.kind == FAULTY:
            unknown, effects = _faulty(unknown, one.seed)
        settings |= {"start": CLEAR} if one.kind != NOMINAL else {}
        suite = sensors(TRACKS[one.track].grade, apart=apart)
        measurements = recording(settings, one.speed, DURATION, suite, one.seed, unknown, effects)
        for kind, signals in signal_sets(measurements):
            for window, hop in HOPS.items():
                rows.setdefault((kind, window), []).extend(
                    (features(signals[place], kind, window), one.speed, one.level, one.track)
                    for place in windows(len(signals), window, hop)
                )
    return {key: Windows(*(np.array(column) for column in zip(*found, strict=True))) for key, found in rows.items()}


def signal_sets(measurements: Any) -> list[tuple[str, np.ndarray]]:
    """Settled signals of the filter with each set of sensors, of every bogie."""
    estimator = AdhesionCreepForces()
    health = estimator.health(measurements)
    skipped = round(SETTLE * RATE)
    return [
        (kind, estimator.forces(measurements, health, bodies, place).signals[skipped:])
        for place in estimator.bogies(measurements, health)
        for kind, bodies in SETS.items()
    ]


def _apart(vehicle: str) -> float | None:
    """Distance of the bogies from the body's centre, m; None of half a vehicle."""
    nominal = load_scenario("smooth", {"vehicle": vehicle}).vehicle.nominal()
    return float(nominal["semi_bogie_spacing"]) if is_whole(nominal) else None


def _runs(whole: bool, kinds: Sequence[str] = KINDS) -> Iterator[CalibrationRun]:
    """Nominal vehicles on every track; others on every second one, faulty whole ones on those between."""
    with scratch_folder() as folder:
        for number, track in enumerate(TRACKS):
            path = _write(track, Path(folder))
            here = [NOMINAL, *([VARIED] if number % 2 == 0 else [FAULTY] if whole else [])]
            for kind in (one for one in here if one in kinds):
                rng = np.random.default_rng(track.seed + 1 + KINDS.index(kind))
                for speed in SPEEDS:
                    for level in range(len(LEVELS)):
                        faster = float(np.clip(speed * (1.0 + AROUND * rng.uniform(-1.0, 1.0)), SPEEDS[0], SPEEDS[-1]))
                        seed = int(rng.integers(1 << 30))
                        yield CalibrationRun(number, round(faster, 2), level, seed, path, kind)
            print(f"track {number + 1} of {len(TRACKS)}", flush=True)


def _unknown(vehicle: str, seed: int) -> dict[str, Any]:
    """Parameters of a vehicle as it really is, which the recording does not know."""
    rng = np.random.default_rng(seed)
    kind: Any = load_scenario("smooth", {"vehicle": vehicle}).vehicle
    whole = is_whole(kind.nominal())
    spread = WHOLE_SPREAD if whole else SPREAD
    found: dict[str, Any] = {name: getattr(kind, name) * rng.uniform(*bounds) for name, bounds in spread.items()}
    if whole:
        found["payload"] = {"mass": float(kind.body_mass * rng.uniform(*PAYLOADS))}
        if rng.uniform() < WORN:
            return found | {"pair": {"kind": "profiles", "wheel": "s1002", "rail": "uic60_40"}}
    return found | {"pair": {"kind": "smooth", "conicity": float(rng.uniform(*CONICITIES))}}


def _faulty(unknown: dict[str, Any], seed: int) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Of a vehicle off its nominal parameters: wheels worn, or dampers gone, by effects."""
    rng = np.random.default_rng([seed, 1])
    if rng.uniform() < WORN:
        worn = {"pair": {"kind": "profiles", "wheel": "s1002", "rail": "uic60_40"}}
        return unknown | worn, [{"kind": "worn_profile", "severity": float(rng.uniform(*SEVERITIES))}]
    gone, damper = (
        ("weak_yaw_damper", "yaw_damper_damping"),
        ("weak_lateral_damper", "secondary_lateral_damping"),
    )[int(rng.integers(2))]
    return {name: value for name, value in unknown.items() if name != damper}, [{"kind": gone, "factor": 0.0}]


def _write(track: CalibrationTrack, folder: Path) -> Path:
    s = synthesis.distances(LENGTH, SPACING)
    rng = np.random.default_rng(track.seed)
    irregularities = synthesis.irregularities(spectra.spectra(track.spectrum), s.size, SPACING, rng, BAND)
    shares: dict[str, float] = dict(zip(QUANTITIES, track.factors, strict=True))
    columns = {key: shares[key] * column * synthesis.fade_in(s, 25.0, 20.0) for key, column in irregularities.items()}
    path = folder / f"{track.spectrum}_{track.seed}.csv"
    write_track(Track(s, columns, path.stem, ["calibration of the adhesion classifier"]), path)
    return path


def fit(data: Windows) -> dict[str, Any]:
    """Weights on all tracks; temperature and error of the slope on tracks that were left out."""
    mean, scale = data.features.mean(axis=0), data.features.std(axis=0) + 1e-9
    table = terms((data.features - mean) / scale, data.speed)
    share = np.log([CONDITIONS[name].initial_share for name in LEVELS])[data.level]
    scores, slopes = np.empty((len(table), len(LEVELS))), np.empty(len(table))
    for first in range(0, len(TRACKS), LEFT):
        out = (data.track >= first) & (data.track < first + LEFT)
        scores[out] = table[out] @ logistic(table[~out], data.level[~out])
        slopes[out] = table[out] @ ridge(table[~out], share[~out])
    temperature = _temperature(scores, data.level)
    return {
        "mean": _rounded(mean),
        "scale": _rounded(scale),
        "weights": _rounded(logistic(table, data.level)),
        "temperature": round(temperature, 4),
        "slope": _rounded(ridge(table, share)),
        "slope_std": round(root_mean_square(slopes - share), 4),
        "speeds [m/s]": [SPEEDS[0], SPEEDS[-1]],
        "farthest": round(
            float(np.quantile(np.sqrt(np.mean(((data.features - mean) / scale) ** 2, axis=1)), 0.995)), 3
        ),
        "right on tracks left out": round(float(np.mean(scores.argmax(axis=1) == data.level)), 4),
        "windows": len(table),
    }


def logistic(table: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Weights (terms, levels) of largest likelihood with a quadratic penalty."""
    shape = (table.shape[1], len(LEVELS))
    one_hot = np.eye(len(LEVELS))[level]
    penalty = PENALTIES["level"]

    def loss(flat: np.ndarray) -> tuple[float, np.ndarray]:
        weights = flat.reshape(shape)
        p = softmax(table @ weights)
        right = np.log(np.maximum(p[np.arange(len(level)), level], 1e-300))
        slope = table.T @ (p - one_hot) / len(level) + 2.0 * penalty * weights
        return float(-right.mean() + penalty * np.sum(weights**2)), slope.ravel()

    found: Any = minimize(loss, np.zeros(shape).ravel(), jac=True, method="L-BFGS-B", options={"maxiter": 600})
    return found.x.reshape(shape)


def ridge(table: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Linear regression with a quadratic penalty, (terms,); the last term, the constant, is free."""
    penalty = PENALTIES["slope"] * len(table) * np.eye(table.shape[1])
    penalty[-1, -1] = 0.0
    return np.linalg.solve(table.T @ table + penalty, table.T @ target)


def _temperature(scores: np.ndarray, level: np.ndarray) -> float:
    def loss(log_temperature: float) -> float:
        p = softmax(scores / np.exp(log_temperature))
        return -float(np.mean(np.log(np.maximum(p[np.arange(len(level)), level], 1e-300))))

    found: Any = minimize_scalar(loss, bounds=(-2.0, 3.0), method="bounded")
    return float(np.exp(found.x))


def _rounded(values: np.ndarray) -> Any:
    return np.vectorize(lambda value: float(f"{value:.{DIGITS}g}"))(values).tolist()


if __name__ == "__main__":
    main()
