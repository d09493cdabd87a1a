"""All that is made of a scenario: recording, estimates, scores, pictures, a summary."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from experiments.reporting.outcome import Outcome
from experiments.reporting.plots import PLOTS, Results, sensor_label
from experiments.reporting.text import score_table, table
from experiments.reporting.units import KMH
from experiments.runs.estimation import estimate_all
from experiments.scoring.score import score, score_rows, unscored
from experiments.scoring.speed import all_speed_errors
from railsim.errors import InputError
from railsim.files import write_folder_atomically, write_json
from railsim.measurements import Measurements
from railsim.recording import software_versions
from railsim.scenario import Scenario
from railsim.simulation import measure, simulate
from railsim.truth import SPEED, Truth

INSTANTS = 12  # rows of the table of speeds


def run_pipeline(scenario: Scenario, engine: str, out: Path) -> Outcome:
    """Simulate, measure, estimate with every estimator that fits the sensors, score and draw.

    out : folder of the results; it appears whole, and an older one stays until then.

    Raises
    ------
    InputError : the scenario cannot be run, or the folder not be written.
    """
    with write_folder_atomically(out) as aside:
        truth = simulate(scenario, engine, progress=True)
        measured = measure(truth, scenario, folder=aside / "recording").measurements
        estimates = estimate_all(measured)
        for name, estimate in estimates.given.items():
            estimate.save(aside / "estimates" / name)
        rows, notes = score_all(estimates.given, truth)
        pd.DataFrame(rows, columns=["estimator", "score", "value", "unit"]).to_csv(aside / "scores.csv", index=False)
        results = Results(
            scenario.name, scenario.description, truth, measured, all_speed_errors(estimates.given, truth)
        )
        files = draw_all(results, aside / "plots")
        summary: dict[str, Any] = {"scenario": scenario.name, "engine": engine, "seed": scenario.seed}
        summary |= {"duration [s]": truth.duration, "distance [m]": float(truth["s [m]"][-1] - truth["s [m]"][0])}
        summary |= {"scores": rows, "notes": notes, "refused": estimates.refused}
        summary |= {"plots": files, "software": software_versions()}
        write_json(aside / "summary.json", summary)
    return Outcome({"folder": str(out), **summary}, _text(results, summary, out))


def score_all(estimates: Mapping[str, Estimate], truth: Truth) -> tuple[list[dict[str, Any]], list[str]]:
    """Rows of scores of all estimates, and a note on each that has none."""
    rows, notes = [], []
    for name, estimate in estimates.items():
        try:
            scores = score(estimate, truth)
        except InputError as error:
            notes.append(f"{name} has no score: {error}")
            continue
        rows += score_rows(name, scores)
        notes += [] if scores else [unscored(estimate)]
    return rows, notes


def sensor_estimates(measured: Measurements) -> dict[str, Estimate]:
    """What tachometers and GNSS say of the speed, in the form of estimates: to compare with."""
    names = [name for name in measured.channels if name.endswith(f".{SPEED}")]
    return {
        sensor_label(measured, name): Estimate(
            name, pd.DataFrame({"time [s]": measured.time(name), SPEED: measured[name]})
        )
        for name in names
    }


def draw_all(results: Results, folder: Path) -> list[str]:
    """Write every plot; returns their paths in the folder of results."""
    folder.mkdir()
    for name, draw in PLOTS.items():
        draw(results).savefig(folder / f"{name}.png", dpi=130)
    return [f"{folder.name}/{name}.png" for name in PLOTS]


def _text(results: Results, summary: Mapping[str, Any], out: Path) -> str:
    sensors = sensor_estimates(results.measured)
    compared, _ = score_all(sensors, results.truth)
    parts = [
        f"{results.name}: {results.description}",
        f"{summary['duration [s]']:g} s, {summary['distance [m]']:.0f} m, engine {summary['engine']}, "
        f"seed {summary['seed']}",
    ]
    errors = all_speed_errors(sensors, results.truth) | dict(results.speed_errors)
    if errors:
        parts += ["", "Speed in km/h", speed_table(results.truth, errors)]
    rows = summary["scores"] + compared
    if rows:
        parts += ["", "Errors, where valid; sensors to compare with", score_table(rows)]
    parts += [f"Note: {note}" for note in summary["notes"]]
    parts += [f"{name} gave no estimate: {reason}" for name, reason in summary["refused"].items()]
    if not summary["scores"] and not summary["notes"]:
        parts.append("No estimator fits the sensors of this scenario.")
    return "\n".join([*parts, "", f"Pictures, recording and estimates: {out}"])


def speed_table(truth: Truth, errors: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> str:
    """True and estimated speeds in km/h at some instants."""
    instants = np.linspace(0.0, truth.duration, INSTANTS + 1)[1:]
    true = np.interp(instants, truth.time, truth[SPEED])
    columns = [instants, KMH * true]
    for time, error in errors.values():
        nearest = np.searchsorted(time, instants - 1e-9).clip(0, len(time) - 1)
        columns.append(KMH * (error[nearest] + np.interp(time[nearest], truth.time, truth[SPEED])))
    rows = [[None if np.isnan(value) else float(value) for value in row] for row in zip(*columns, strict=True)]
    return table(["time [s]", "true", *errors], rows, decimals=2)
