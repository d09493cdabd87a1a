"""Section 3: accuracy of every track estimator by band and speed beside the information bound, and honesty of the
fused estimate's standard deviations on vehicles that are not quite as their papers say.
"""

import itertools
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

import estimators
from estimators import _across
from estimators._bands import BANDS
from estimators._geometry import TrackEstimator
from estimators._space import find_way
from estimators.alignment_lateral import AlignmentLateral
from estimators.interface import Estimate, Estimator
from estimators.track_smoother import LATERAL_DAMPED, LATERAL_STIFF_AND_HEAVY, STIFF_AND_HEAVY, TrackSmoother
from experiments.figures._unseen import write_unseen
from experiments.figures.interface import Claim, Figure
from experiments.plots import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, RED, SKY
from experiments.track_score import MM, band_errors, true_track
from railsim import measure, simulate
from railsim.contact.pairs import WheelRailPair
from railsim.measurements import Measurements
from railsim.registry import discover
from railsim.scenario import Scenario
from railsim.truth import Truth

START = 25.0  # m
LENGTHS = {4.0: 500.0, 8.0: 1000.0, 15.0: 1500.0, 30.0: 1880.0, 45.0: 1880.0}  # m by speed, m/s
GRADES = ("mems", "industrial")
SUITES = ("", "axleboxes", "all")
LIMIT = 0.2  # mm rms, vertical D1 and D2 by the fused estimate above 8 m/s
FUSED = "track_smoother"
RUNS = {  # track on which nothing was tuned: length in m, vehicle, speeds in m/s
    "unseen_erri_low": (600.0, "manchester", (10.0, 20.0, 40.0)),
    "unseen_erri_high": (600.0, "manchester", (10.0, 20.0, 40.0)),
    "unseen_curve_r700": (800.0, "class175", (10.0, 16.0, 25.0)),
}
SPREAD = (  # relative standard deviation of the true parameters about the nominal ones: what TrackSmoother assumes
    dict.fromkeys((*STIFF_AND_HEAVY, *LATERAL_STIFF_AND_HEAVY), 0.03) | dict.fromkeys(LATERAL_DAMPED, 0.06)
)
CONICITY = 0.05  # the same of the conicity
K_SLIP = 0.112  # standard deviation of Polach's kS about 0.4: 8 % of the creep coefficients
FAST_LENGTH = 400.0  # m
DRAWS = {"compiled": 8, "exudyn": 1}  # vehicles and specimens of their sensors for each track and speed
FAST_DRAWS = {"compiled": 2}
PROCESSES = 2
APART = 0.3  # mm rms, left and right rail with axleboxes
WITH_AXLEBOXES, PLAIN = "track_smoother, axleboxes", "alignment_lateral, uncompensated"
HONEST = (0.90, 0.97)
JUDGED = ("vertical", "cross_level", "lateral")
QUANTITIES = ("vertical", "cross_level", "left_vertical", "right_vertical", "lateral")
COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, GREY, RED)


class TrackAccuracy(Figure):
    """Errors by band, estimator, speed and grade of sensors; share of points within two standard deviations."""

    def compute(self, fast: bool) -> pd.DataFrame:
        with TemporaryDirectory() as folder:
            files = {name: str(path) for name, path in write_unseen(Path(folder)).items()}
            tasks = [*_accuracy_tasks(fast), *_coverage_tasks(fast, files)]
            if fast:
                return pd.DataFrame([row for task in tasks for row in task()])
            tasks.sort(key=lambda task: -task.keywords["cost"])
            with ProcessPoolExecutor(PROCESSES) as pool:
                return pd.DataFrame([row for rows in pool.map(_call, tasks) for row in rows])

    def draw(self, table: pd.DataFrame) -> Picture:
        picture = Picture(figsize=(11.0, 8.5), layout="constrained")
        panels = picture.subplots(2, 3)
        names = sorted(set(table["estimator"]), key=lambda name: (name != FUSED, name))
        colours = dict(zip(names, (*COLOURS, *COLOURS), strict=False))
        shown = (
            ("vertical", "d1"),
            ("vertical", "d2"),
            ("lateral", "d1"),
            ("cross_level", "d1"),
            ("cross_level", "d2"),
        )
        for axes, (quantity, band) in zip(panels.flat, shown, strict=False):
            _errors(axes, _pick(table, part="accuracy", quantity=quantity, band=band, grade="mems"), colours)
            axes.set_title(f"{quantity.replace('_', ' ')} {band.upper()}, consumer MEMS", loc="left")
        _honesty(panels[1][2], _pick(table, part="coverage"))
        handles: dict[str, Any] = {}
        for axes in panels.flat[:5]:
            handles |= dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
        picture.legend(list(handles.values()), list(handles), loc="outside lower center", ncols=4)
        picture.suptitle(
            "Track geometry from bogie sensors on straight_erri_low, Manchester vehicle: error against truth"
        )
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        return [*_accuracy_claims(table), *_honesty_claims(table)]


def _call(task: Callable[[], list[dict[str, Any]]]) -> list[dict[str, Any]]:
    return task()


def _accuracy_tasks(fast: bool) -> list[partial[list[dict[str, Any]]]]:
    """One for each speed; `cost` is the longest first of what runs side by side."""
    lengths = {speed: min(length, FAST_LENGTH) if fast else length for speed, length in LENGTHS.items()}
    return [partial(_accuracy, speed, length, fast, cost=length / speed) for speed, length in lengths.items()]


def _accuracy(speed: float, length: float, fast: bool, cost: float) -> list[dict[str, Any]]:
    """Rows of the table of errors."""
    del cost
    kinds = [kind for kind in discover(estimators, Estimator).values() if issubclass(kind, TrackEstimator)]
    built = [kind.build({}) for kind in (*kinds, TrackSmoother)]
    tried: list[tuple[str, Estimator, str]] = [(one.name, one, "") for one in built]
    tried.append((PLAIN, AlignmentLateral(compensation=False), ""))
    tried.append((WITH_AXLEBOXES, TrackSmoother(), "axleboxes"))
    truth = _truth("straight_erri_low", "manchester", speed, length, "compiled" if fast else "exudyn")
    rows: list[dict[str, Any]] = []
    for grade in GRADES:
        recordings = {more: measure(truth, _scenario("manchester", speed, grade, more)).measurements for more in SUITES}
        for name, estimator, suite in tried:
            if not suite and not estimator.fits(recordings[""]):
                suite = "all"
            if not estimator.fits(recordings[suite]):
                continue
            head = {"part": "accuracy", "estimator": name, "speed [m/s]": speed, "grade": grade}
            rows += [head | row for row in _bands(estimator.estimate(recordings[suite]), truth)]
        bounds = _roll_gyro_alone(recordings[""])
        for row in rows:
            if row["estimator"] == "cross_level" and row["grade"] == grade and row["quantity"] == "cross_level":
                row["bound [mm]"] = MM * bounds[row["band"]]
    return rows


def _roll_gyro_alone(measurements: Measurements) -> dict[str, float]:
    """Cramer-Rao bound of cross level where the roll gyro is all there is, m."""
    way = find_way(measurements, spacing=measurements.vehicle["semi_wheelbase"] / 5.0)
    nothing = np.zeros(len(way.s))
    plane = _across.across(measurements, way, {}, nothing.astype(bool), lambda _: (nothing, 0.0))
    alone = plane.only([_across.ROLL])
    return alone.bounds(float(np.median(way.speed)), alone.priors, [BANDS, BANDS])[1]


def _coverage_tasks(fast: bool, files: Mapping[str, str]) -> list[partial[list[dict[str, Any]]]]:
    """One for each track, speed, engine and vehicle."""
    tasks = []
    for track, (length, vehicle, speeds) in RUNS.items():
        for speed, (engine, draws) in itertools.product(speeds, (FAST_DRAWS if fast else DRAWS).items()):
            cost = length / speed / (14.0 if engine == "exudyn" else 60.0)
            for seed in range(draws):
                tasks.append(partial(_coverage, track, files[track], vehicle, speed, length, engine, seed, cost=cost))
    return tasks


def _coverage(
    track: str, file: str, vehicle: str, speed: float, length: float, engine: str, seed: int, cost: float
) -> list[dict[str, Any]]:
    """Rows of the share within two standard deviations of a vehicle whose true parameters are drawn."""
    del cost
    rng = np.random.default_rng([95, list(RUNS).index(track), round(speed), seed])
    factors = {name: float(np.exp(spread * rng.standard_normal())) for name, spread in SPREAD.items()}
    conicity = float(np.exp(CONICITY * rng.standard_normal()))
    k_slip = float(np.clip(0.4 + K_SLIP * rng.standard_normal(), 0.05, 1.0))
    truth = _truth(file, vehicle, speed, length, engine, (factors, conicity, k_slip))
    estimate = TrackSmoother().estimate(measure(truth, _scenario(vehicle, speed, "mems"), seed=seed).measurements)
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
                "rms error [mm]": MM * float(np.sqrt(np.mean(error**2))),
                "true rms [mm]": MM * float(np.sqrt(np.mean(rows["true [m]"] ** 2))),
                "std [mm]": MM * float(np.sqrt(np.mean(spread**2))),
                "bound [mm]": MM * float(estimate.about.get(f"{quantity}_{band}_bound [m]", np.nan)),
                "within 2 std [-]": float(np.mean(np.abs(error) <= 2.0 * spread)) if stated else np.nan,
            }


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
    scenario = _scenario(vehicle, speed, "mems", track=track, duration=duration)
    if changes:
        nominal, (factors, conicity, k_slip) = scenario.vehicle.nominal(), changes
        changed: dict[str, Any] = {"name": vehicle} | {name: nominal[name] * one for name, one in factors.items()}
        changed["pair"] = {"conicity": conicity * WheelRailPair().conicity}
        changed["adhesion"] = {"k_slip": k_slip}
        scenario = _scenario(changed, speed, "mems", track=track, duration=duration)
    return simulate(scenario, engine=engine)


def _scenario(vehicle: Any, speed: float, grade: str, more: str = "", **values: Any) -> Scenario:
    """Bogie sensors of that grade, a tachometer; `more` : "axleboxes" (leading wheelset), "all": transducers too."""
    common = {"name": "bogie", "body": "bogie", "rate": 256, "errors": grade}
    sensors: list[dict[str, Any]] = [
        {"kind": "accelerometer", **common},
        {"kind": "gyro", **common},
        {"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 64, "radius_error": 0.01},
    ]
    for side, y in (("left", 1.0), ("right", -1.0)) if more else ():
        place = {"name": f"axlebox1_{side}", "body": "wheelset1", "position": [0, y, 0], "axes": ["y", "z"]}
        sensors.append({"kind": "accelerometer", **place, "rate": 1024, "errors": "axlebox"})
        if more == "all":
            sensors.append({"kind": "displacement", "name": f"primary1_{side}", "rate": 256, "errors": "transducer"})
    head = {"vehicle": vehicle, "speed": {"kind": "constant", "speed": speed}, "start": START, "seed": 3}
    track = {"track": "straight_erri_low", "duration": 10.0, "output_rate": 1024}
    return Scenario.build(head | track | {"sensors": sensors} | values)


def _pick(table: pd.DataFrame, **where: Any) -> pd.DataFrame:
    chosen = np.ones(len(table), dtype=bool)
    for name, value in where.items():
        chosen &= table[name].eq(value).to_numpy()
    return _where(table, chosen)


def _where(table: pd.DataFrame, chosen: Any) -> pd.DataFrame:
    return table.loc[np.asarray(chosen)]


def _cases(rows: pd.DataFrame) -> Iterator[tuple[str, float, pd.DataFrame]]:
    """Track, speed and rows of each run of the coverage."""
    for track in dict.fromkeys(rows["track"]):
        of_track = _pick(rows, track=track)
        for speed in dict.fromkeys(of_track["speed [m/s]"]):
            yield str(track), float(speed), _pick(of_track, **{"speed [m/s]": speed})


def _accuracy_claims(table: pd.DataFrame) -> Iterator[Claim]:
    for grade in GRADES:
        for band in ("d1", "d2"):
            fused = _pick(table, part="accuracy", estimator=FUSED, quantity="vertical", band=band, grade=grade)
            worst = float(np.max(_where(fused, fused["speed [m/s]"] >= 8.0)["rms error [mm]"].to_numpy()))
            yield Claim(
                f"fused vertical {band.upper()}, {grade}, 8 m/s and above: largest rms error",
                worst,
                f"<= {LIMIT} mm",
                worst <= LIMIT,
            )
    fused = _pick(table, part="accuracy", estimator=FUSED, quantity="vertical", grade="mems")
    fused = _where(fused, fused["band"].isin(["d1", "d2"]) & fused["speed [m/s]"].le(15.0))
    ratio = float(np.max(fused["rms error [mm]"].to_numpy() / fused["bound [mm]"].to_numpy()))
    yield Claim(
        "fused vertical D1 and D2, mems, up to 15 m/s: rms error over the Cramer-Rao bound, largest",
        ratio,
        "<= 1.3",
        ratio <= 1.3,
    )
    for speed in sorted(set(_pick(table, part="accuracy")["speed [m/s]"])):
        rows = _pick(table, part="accuracy", grade="mems", band="d1", **{"speed [m/s]": speed})
        plain, found, bound = (
            float(_pick(rows, estimator=name, quantity="lateral")[column].to_numpy(float)[0])
            for name, column in ((PLAIN, "rms error [mm]"), (FUSED, "rms error [mm]"), (FUSED, "bound [mm]"))
        )
        what = (
            f"fused lateral D1, {speed:g} m/s: error over that of the bogie's path ({found:.2f} mm, bound {bound:.2f})"
        )
        yield Claim(what, found / plain, "<= 0.5", found / plain <= 0.5)
        rails = _pick(rows, estimator=WITH_AXLEBOXES)
        sides = _where(rails, rails["quantity"].isin(["left_vertical", "right_vertical"]))
        worst = float(np.max(sides["rms error [mm]"].to_numpy(float)))
        yield Claim(
            f"fused with axleboxes, {speed:g} m/s: D1 of the worse rail", worst, f"<= {APART} mm", worst <= APART
        )


def _honesty_claims(table: pd.DataFrame) -> Iterator[Claim]:
    low, high = HONEST
    every = _where(table, table["part"].eq("coverage") & table["engine"].ne("exudyn"))
    for quantity, band in itertools.product(JUDGED, ("d1", "d2")):
        rows = _pick(every, quantity=quantity, band=band)
        name = f"{quantity.replace('_', ' ')} {band.upper()} within two standard deviations"
        for track, speed, case in _cases(rows):
            share = _share(case)
            yield Claim(f"{name}, {track}, {speed:g} m/s", share, f"{low} to {high}", low <= share <= high)
        share = _share(rows)
        yield Claim(f"{name}, all tracks and speeds", share, f"{low} to {high}", low <= share <= high)


def _share(rows: pd.DataFrame) -> float:
    """Share of points within two standard deviations."""
    return float(np.average(rows["within 2 std [-]"], weights=rows["points"]))


def _errors(axes: Axes, rows: pd.DataFrame, colours: Mapping[str, str]) -> None:
    for name, colour in colours.items():
        one = _pick(rows, estimator=name)
        if one.empty:
            continue
        axes.loglog(
            one["speed [m/s]"],
            one["rms error [mm]"],
            "o-",
            color=colour,
            ms=4,
            lw=2.0 if name == FUSED else 1.0,
            label=name,
        )
    fused = _pick(rows, estimator=FUSED)
    axes.loglog(fused["speed [m/s]"], fused["bound [mm]"], ":", color=BLACK, label="Cramér–Rao bound, bogie sensors")
    axes.loglog(rows["speed [m/s]"], rows["true rms [mm]"], "--", color=GREY, lw=1.0, label="true irregularity")
    speeds = sorted(set(rows["speed [m/s]"]))
    axes.set_xticks(speeds, [f"{speed:g}" for speed in speeds])
    axes.minorticks_off()
    axes.set_xlabel("speed [m/s]")
    axes.set_ylabel("rms [mm]")


def _honesty(axes: Axes, rows: pd.DataFrame) -> None:
    rows = _where(rows, rows["band"].isin(["d1", "d2"]) & rows["quantity"].isin(JUDGED) & rows["engine"].ne("exudyn"))
    labels = []
    for place, (track, speed, case) in enumerate(_cases(rows)):
        for number, (quantity, colour) in enumerate(zip(JUDGED, (BLUE, ORANGE, GREEN), strict=True)):
            for band, marker in (("d1", "o"), ("d2", "s")):
                one = _pick(case, quantity=quantity, band=band)
                if not one.empty:
                    label = f"{quantity.replace('_', ' ')} {band.upper()}" if not place else None
                    at = place + 0.2 * (number - 1)
                    axes.plot(at, _share(one), marker, color=colour, ms=4, alpha=0.8, label=label)
        labels.append(f"{str(track).removeprefix('unseen_')}, {speed:g}")
    axes.axhspan(*HONEST, color=GREY, alpha=0.25, lw=0)
    axes.set_xticks(range(len(labels)), labels, rotation=60, ha="right", fontsize=7)
    axes.set_ylim(0.7, 1.01)
    axes.set_ylabel("within two standard deviations [-]")
    axes.set_title("mean of vehicles off nominal", loc="left")
    axes.legend(loc="lower left", fontsize=7, ncols=2)
