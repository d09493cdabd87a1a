"""Section 3: accuracy of every track estimator by band and speed beside the information bound, and honesty of the
fused estimate's standard deviations on vehicles that are not quite as their papers say.
"""

import itertools
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

import estimators
from estimators.interface import Estimate, Estimator
from estimators.track_smoother import TrackSmoother
from experiments.figures._unseen import write_unseen
from experiments.figures.interface import Claim, Figure
from experiments.plots import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY
from experiments.track_score import MM, band_errors, true_track
from railsim import measure, simulate
from railsim.registry import discover
from railsim.scenario import Scenario
from railsim.truth import Truth

START = 25.0  # m
LENGTHS = {4.0: 500.0, 8.0: 1000.0, 15.0: 1500.0, 30.0: 1880.0, 45.0: 1880.0}  # m by speed, m/s
GRADES = ("mems", "industrial")
LIMIT = 0.2  # mm rms, vertical D1 and D2 by the fused estimate above 8 m/s
FUSED = "track_smoother"
RUNS = {  # track on which nothing was tuned: length in m, vehicle, speeds in m/s
    "unseen_erri_low": (600.0, "manchester", (10.0, 20.0, 40.0)),
    "unseen_erri_high": (600.0, "manchester", (10.0, 20.0, 40.0)),
    "unseen_curve_r700": (800.0, "class175", (10.0, 16.0, 25.0)),
}
SPREAD = {  # relative standard deviation of the true parameters about the nominal ones: what TrackSmoother assumes
    "primary_vertical_stiffness": 0.03,
    "secondary_vertical_stiffness": 0.03,
    "bogie_mass": 0.03,
    "body_mass": 0.03,
    "bogie_pitch_inertia": 0.03,
    "primary_vertical_damping": 0.06,
    "secondary_vertical_damping": 0.06,
}
FAST_LENGTH = 400.0  # m
DRAWS = 4  # vehicles and specimens of their sensors for each track and speed
HONEST = (0.90, 0.97)
JUDGED = ("vertical", "cross_level")
QUANTITIES = ("vertical", "cross_level", "left_vertical", "right_vertical", "lateral")
COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, GREY)


class TrackAccuracy(Figure):
    """Errors by band, estimator, speed and grade of sensors; share of points within two standard deviations."""

    def compute(self, fast: bool) -> pd.DataFrame:
        return pd.DataFrame([*_accuracy(fast), *_coverage(fast)])

    def draw(self, table: pd.DataFrame) -> Picture:
        picture = Picture(figsize=(11.0, 8.5), layout="constrained")
        panels = picture.subplots(2, 3)
        names = sorted(set(table["estimator"]), key=lambda name: (name != FUSED, name))
        colours = dict(zip(names, (*COLOURS, *COLOURS), strict=False))
        for axes, band in zip(panels[0], ("d1", "d2", "d3"), strict=True):
            _errors(axes, _pick(table, part="accuracy", quantity="vertical", band=band, grade="mems"), colours)
            axes.set_title(f"vertical {band.upper()}, consumer MEMS", loc="left")
        for axes, band in zip(panels[1][:2], ("d1", "d2"), strict=True):
            _errors(axes, _pick(table, part="accuracy", quantity="cross_level", band=band, grade="mems"), colours)
            axes.set_title(f"cross level {band.upper()}, consumer MEMS", loc="left")
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


def _accuracy(fast: bool) -> Iterator[dict[str, Any]]:
    """Rows of the table of errors."""
    kinds = {name: kind for name, kind in discover(estimators, Estimator).items() if not name.startswith("speed")}
    for speed, length in LENGTHS.items():
        truth = _truth("straight_erri_low", "manchester", speed, min(length, FAST_LENGTH) if fast else length, fast)
        for grade in GRADES:
            bogie, every = (measure(truth, _scenario("manchester", speed, grade, more)) for more in (False, True))
            for name, kind in kinds.items():
                estimator = kind.build({})
                recording = bogie if estimator.fits(bogie.measurements) else every
                if estimator.fits(recording.measurements):
                    estimate = estimator.estimate(recording.measurements)
                    head = {"part": "accuracy", "estimator": name, "speed [m/s]": speed, "grade": grade}
                    yield from (head | row for row in _bands(estimate, truth))


def _coverage(fast: bool) -> Iterator[dict[str, Any]]:
    """Rows of the share within two standard deviations; the vehicle's true parameters are drawn anew for every run."""
    rng = np.random.default_rng(95)
    with TemporaryDirectory() as folder:
        files = write_unseen(Path(folder))
        for track, (length, vehicle, speeds) in RUNS.items():
            for speed, seed in itertools.product(speeds, range(DRAWS)):
                changes = {name: float(np.exp(spread * rng.standard_normal())) for name, spread in SPREAD.items()}
                truth = _truth(str(files[track]), vehicle, speed, length, fast, changes)
                scenario = _scenario(vehicle, speed, "mems", False)
                estimate = TrackSmoother().estimate(measure(truth, scenario, seed=seed).measurements)
                head = {"part": "coverage", "estimator": FUSED, "speed [m/s]": speed, "grade": "mems", "track": track}
                yield from (head | {"seed": seed} | row for row in _bands(estimate, truth))


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
    track: str, vehicle: str, speed: float, length: float, fast: bool, changes: dict[str, float] | None = None
) -> Truth:
    """One run; `changes` : factors of the vehicle's parameters."""
    scenario = _scenario(vehicle, speed, "mems", False, track=track, duration=float(np.floor(length / speed)))
    if changes:
        nominal = scenario.vehicle.nominal()
        changed = {"name": vehicle} | {name: nominal[name] * factor for name, factor in changes.items()}
        scenario = _scenario(changed, speed, "mems", False, track=track, duration=scenario.duration)
    return simulate(scenario, engine="compiled" if fast else "exudyn")


def _scenario(vehicle: Any, speed: float, grade: str, every: bool, **values: Any) -> Scenario:
    """Bogie sensors of that grade, a tachometer; `every` adds axlebox accelerometers and displacement transducers."""
    common = {"name": "bogie", "body": "bogie", "rate": 256, "errors": grade}
    sensors: list[dict[str, Any]] = [
        {"kind": "accelerometer", **common},
        {"kind": "gyro", **common},
        {"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 64, "radius_error": 0.01},
    ]
    for side, y in (("left", 1.0), ("right", -1.0)) if every else ():
        place = {"name": f"axlebox1_{side}", "body": "wheelset1", "position": [0, y, 0], "axes": ["y", "z"]}
        sensors.append({"kind": "accelerometer", **place, "rate": 1024, "errors": "axlebox"})
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


def _honesty_claims(table: pd.DataFrame) -> Iterator[Claim]:
    low, high = HONEST
    for quantity in JUDGED:
        rows = _pick(table, part="coverage", quantity=quantity)
        rows = _where(rows, rows["band"].isin(["d1", "d2"]))
        name = f"{quantity.replace('_', ' ')} D1 and D2 within two standard deviations"
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
    rows = _where(rows, rows["band"].isin(["d1", "d2"]) & rows["quantity"].isin(["vertical", "cross_level"]))
    labels, place = [], 0
    for track, speed, case in _cases(rows):
        for quantity, colour, marker in (("vertical", BLUE, "o"), ("cross_level", ORANGE, "s")):
            shares = _pick(case, quantity=quantity)["within 2 std [-]"].to_numpy()
            axes.plot(
                np.full(len(shares), place),
                shares,
                marker,
                color=colour,
                ms=4,
                alpha=0.7,
                label=quantity if not place else None,
            )
        labels.append(f"{str(track).removeprefix('unseen_')}, {speed:g}")
        place += 1
    axes.axhspan(*HONEST, color=GREY, alpha=0.25, lw=0)
    axes.set_xticks(range(place), labels, rotation=60, ha="right", fontsize=7)
    axes.set_ylim(0.4, 1.02)
    axes.set_ylabel("within two standard deviations [-]")
    axes.set_title("D1 and D2, vehicles off nominal", loc="left")
    axes.legend(loc="lower left")
