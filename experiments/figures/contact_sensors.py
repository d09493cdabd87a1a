"""Which of the sensors each estimator of wheel-rail geometry can do without: one table of errors."""

from dataclasses import replace

import numpy as np
import pandas as pd
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure as Picture

from estimators.interface import ESTIMATORS, Estimator
from experiments.figures.interface import Figure
from experiments.reporting.claims import Claim, at_most
from experiments.reporting.plots import ORANGE
from experiments.reporting.size import Size
from experiments.reporting.style import as_table
from experiments.runs.contact import ensemble, run
from experiments.scoring.score import score
from railsim.errors import InputError
from railsim.measurements import TIME, Measurements
from railsim.truth import Truth

SIDE, YAW, ROLL = "wheelset1.acceleration_y [m/s2]", "wheelset1.rate_yaw [rad/s]", "wheelset1.rate_roll [rad/s]"
BODY, APART = "body.acceleration_y [m/s2]", "suspension.displacement [m]"
WHEEL = ("wheelset1.wheel_speed [rad/s]", "wheelset1.speed [m/s]")
TRACK = "measured track"
SETS: dict[str, tuple[str, ...]] = {
    "all": (),
    "no lateral accelerometer": (SIDE,),
    "no roll gyro": (ROLL,),
    "no mass accelerometer": (BODY,),
    "no displacement": (APART,),
    "neither of the two": (BODY, APART),
    "no yaw gyro": (YAW,),
    "no measured track": (TRACK,),
    "yaw gyro and track only": (SIDE, ROLL, BODY, APART),
    "yaw gyro only": (SIDE, ROLL, BODY, APART, TRACK),
}
"""What is taken away; wheel speed is always there."""
CASES, SHORT, SHORTEST = 3, 30.0, 10.0
SCORES = ("conicity rms error [-]", "difference_of_radii rms error [mm]")
"""First of these that an estimator has."""
PLAIN = "conicity_ekf"
"""Does not converge (figure 11)."""
MUCH = 1.5
"""An error that is so much larger shows that the sensor is needed (-)."""
MOST = 5.0
COLOURS = LinearSegmentedColormap.from_list("cost", ["#ffffff", ORANGE]).with_extremes(bad="#eeeeee")
CONICITY = 0.06
"""Rms error of the conicity below which an estimator counts as able (-)."""


class ContactSensors(Figure):
    """Runs with new to worn wheels, without one sensor after the other."""

    def compute(self, size: Size) -> pd.DataFrame:
        """Rows: estimator, set, score, rms error over the runs (NaN where the estimator cannot run)."""
        cases = ensemble(CASES, (0.0, 0.08), (1.4345, 1.4355), first=301)
        cases = [replace(cases[0], duration=size.of(SHORT, SHORT, SHORTEST))] if size.reduced else cases
        runs = [run(case, "compiled" if size.reduced else "exudyn") for case in cases]
        rows = [
            {"estimator": name, "set": label, "score": key, "error": error}
            for name, estimator in contact_estimators(runs[0][1]).items()
            for label, gone in SETS.items()
            for key, error in [_error(estimator, runs, gone)]
        ]
        return pd.DataFrame(rows)

    def draw(self, table: pd.DataFrame) -> Picture:
        """Errors by set of sensors, a column an estimator; cells coloured by what the missing sensors cost."""
        names = list(dict.fromkeys(table["estimator"]))
        picture = Picture(figsize=(10.0, 1.4 + 0.42 * len(SETS)), layout="constrained")
        axes = picture.subplots()
        error = np.array([[_cell(table, name, label) for name in names] for label in SETS])
        ratio = error / error[0]
        image = axes.imshow(ratio, norm=LogNorm(1.0, MOST), cmap=COLOURS, aspect="auto")
        for (row, column), value in np.ndenumerate(error):
            text = f"{value:.3f}" if np.isfinite(value) else "cannot"
            worse = ratio[row, column] > MUCH
            axes.text(
                column, row, f"\N{BLACK UP-POINTING TRIANGLE} {text}" if worse else text, ha="center", va="center",
                fontweight="bold" if worse else "normal", color="black" if np.isfinite(value) else "0.45",
            )  # fmt: skip
        units = {
            str(name): str(score).replace(" rms error", "").replace("_", " ")
            for name, score in zip(table["estimator"], table["score"], strict=True)
            if isinstance(score, str) and score
        }
        columns = [
            f"{name.replace('_', chr(10), 1)}\n{units.get(name, '').replace(' of ', chr(10) + 'of ')}" for name in names
        ]
        axes.set_xticks(range(len(names)), columns, fontsize=8.5)
        axes.xaxis.tick_top()
        axes.set_yticks(range(len(SETS)), list(SETS))
        as_table(axes)
        bar = picture.colorbar(image, ax=axes, location="bottom", shrink=0.5, aspect=40, extend="both")
        bar.set_ticks([1.0, 1.5, 2.0, 3.0, 5.0], labels=["1", "1.5", "2", "3", "5"])
        bar.minorticks_off()
        bar.set_label(f"rms error over that with all sensors [-]; triangle: above {MUCH:g}")
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        """For each estimator of conicity the smallest set that still serves it."""
        claims = []
        named = dict(zip(table["estimator"], table["score"], strict=True))
        for name, key in named.items():
            if "conicity" not in f"{name} {key}" or name == PLAIN:
                continue
            error = {label: _cell(table, str(name), label) for label in SETS}
            spare = [label for label in SETS if label != "all" and error[label] <= MUCH * error["all"]]
            text = f"{name}: rms error of the conicity, all sensors; does without: {', '.join(spare) or 'none'}"
            claims.append(Claim.definite(text, error["all"], at_most(CONICITY)))
        return claims


def contact_estimators(measurements: Measurements) -> dict[str, Estimator]:
    """Those that fit all sensors of the single wheelset and give something that `contact_score` knows."""
    found = {name: kind.build({}) for name, kind in ESTIMATORS.classes().items()}
    contact = {name: one for name, one in found.items() if name.startswith(("conicity", "rolling_radii"))}
    return {name: one for name, one in contact.items() if one.fits(measurements)}


def without(measurements: Measurements, gone: tuple[str, ...]) -> Measurements:
    """The recording less some channels, or less the measured track."""
    tables: dict[float, dict[str, np.ndarray]] = {}
    for name in measurements:
        if name not in gone:
            table = tables.setdefault(measurements.rate(name), {TIME: measurements.time(name)})
            table[name] = measurements[name]
    return Measurements(measurements.about, tables, None if TRACK in gone else measurements.track)


def _error(estimator: Estimator, runs: list[tuple[Truth, Measurements]], gone: tuple[str, ...]) -> tuple[str, float]:
    """Score's name and rms over the runs; ("", NaN) where the estimator cannot run."""
    named_scores = []
    for truth, measured in runs:
        left = without(measured, gone)
        if not estimator.fits(left):
            return "", np.nan
        try:
            scores = score(estimator.estimate(left), truth)
        except InputError:
            return "", np.nan
        named_scores.append(next(((key, scores[key]) for key in SCORES if key in scores), ("", np.nan)))
    return named_scores[0][0], float(np.sqrt(np.mean([value**2 for _, value in named_scores])))


def _cell(table: pd.DataFrame, name: str, label: str) -> float:
    inside = ((table["estimator"] == name) & (table["set"] == label)).to_numpy()
    return float(table["error"].to_numpy(dtype=float)[inside][0])
