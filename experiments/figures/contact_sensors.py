"""Which of the sensors each estimator of wheel-rail geometry can do without: one table of errors."""

from dataclasses import replace

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture

from estimators.interface import ESTIMATORS, Estimator
from experiments.figures.interface import Figure
from experiments.reporting.claims import Claim, at_most
from experiments.reporting.size import Size
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
        """The table itself."""
        names, sets = list(dict.fromkeys(table["estimator"])), list(SETS)
        figure = Picture(figsize=(2.6 + 1.25 * len(sets), 1.6 + 0.42 * len(names)), layout="constrained")
        axes = figure.subplots()
        axes.set(xlim=(-0.5, len(sets) - 0.5), ylim=(len(names) - 0.5, -0.5))
        axes.set_xticks(range(len(sets)), [one.replace(" ", "\n", 2) for one in sets], fontsize=8)
        axes.xaxis.tick_top()
        units = {name: str(score) for name, score in zip(table["estimator"], table["score"], strict=True) if score}
        axes.set_yticks(range(len(names)), [f"{name}\n{units.get(name, '')}" for name in names], fontsize=8)
        for number, name in enumerate(names):
            whole = _cell(table, name, "all")
            for column, label in enumerate(sets):
                value = _cell(table, name, label)
                text = f"{value:.3f}" if np.isfinite(value) else "cannot"
                worse = np.isfinite(value) and value > MUCH * whole
                axes.text(column, number, text, ha="center", va="center", fontsize=9, color="C3" if worse else "k")
        axes.tick_params(length=0)
        for side in axes.spines.values():
            side.set_visible(False)
        axes.set_xlabel("rms error over the runs; red: more than half as large again as with all sensors", fontsize=8)
        return figure

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
