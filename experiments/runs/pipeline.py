"""All that is made of a scenario: recording, estimates, scores, pictures, a summary."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from experiments.reporting.failures import PluginError, plugin_code
from experiments.reporting.outcome import Outcome
from experiments.reporting.plots import PLOTS, Results, sensor_label
from experiments.reporting.style import save_picture
from experiments.reporting.text import score_table, table
from experiments.reporting.units import KMH
from experiments.runs.estimation import Estimates, estimate_all
from experiments.scoring.score import score_rows, scores_and_problems, unscored
from experiments.scoring.speed import all_speed_errors
from railsim.files import write_folder_atomically, write_json
from railsim.measurements import Measurements
from railsim.plots.estimate import PICTURE, writer
from railsim.plots.style import styled
from railsim.recording import software_versions
from railsim.scenario import Scenario
from railsim.simulation import check_measured, measure, simulate
from railsim.truth import SPEED, Truth

INSTANTS = 12  # rows of the table of speeds


def run_pipeline(scenario: Scenario, engine: str, out: Path) -> Outcome:
    """Simulate, measure, estimate with every estimator that fits the sensors, score and draw.

    An estimator or a scorer that fails is named, its traceback written to `failures`, and the outcome not held.

    out : folder of the results; it appears whole, and an older one stays until then.

    Raises
    ------
    InputError : the scenario cannot be run, or the folder not be written.
    """
    check_measured(scenario)
    with write_folder_atomically(out) as aside:
        truth = simulate(scenario, engine, progress=True)
        measured = measure(truth, scenario, folder=aside / "recording").measurements
        estimates = estimate_all(measured)
        save_all(estimates, aside / "estimates")
        scored = score_all(estimates.given, truth)
        pd.DataFrame(scored.rows, columns=["estimator", "score", "value", "unit"]).to_csv(
            aside / "scores.csv", index=False
        )
        errors = all_speed_errors(estimates.given, truth)
        results = Results(scenario.name, scenario.description, truth, measured, errors)
        files = draw_all(results, aside / "plots")
        failed = write_failures(estimates.failed | scored.failed, aside)
        summary: dict[str, Any] = {"scenario": scenario.name, "engine": engine, "seed": scenario.seed}
        summary |= {"duration [s]": truth.duration, "distance [m]": float(truth["s [m]"][-1] - truth["s [m]"][0])}
        summary |= {"scores": scored.rows, "notes": scored.notes, "refused": estimates.refused, "failed": failed}
        summary |= {"plots": files, "software": software_versions()}
        write_json(aside / "summary.json", summary)
    return Outcome({"folder": str(out), **summary}, _text(results, summary, out), held=not failed)


@dataclass(frozen=True)
class Scores:
    """Rows of scores, a note on each estimate that has none, and failures by ESTIMATE-SCORER."""

    rows: list[dict[str, Any]]
    notes: list[str]
    failed: dict[str, PluginError]


def score_all(estimates: Mapping[str, Estimate], truth: Truth) -> Scores:
    """Scores of all estimates."""
    scored = Scores([], [], {})
    for name, estimate in estimates.items():
        scores, problems = scores_and_problems(estimate, truth)
        scored.rows.extend(score_rows(name, scores))
        for scorer, problem in problems.items():
            if isinstance(problem, PluginError):
                scored.failed[f"{name}-{scorer}"] = problem
            else:
                scored.notes.append(f"{name} has no score: {problem}")
        if not scores and not problems:
            scored.notes.append(unscored(estimate))
    return scored


def save_all(estimates: Estimates, folder: Path) -> None:
    """Write each estimate; one that cannot be written, since it holds no numbers for example, becomes a failure."""
    for name, estimate in list(estimates.given.items()):
        try:
            with plugin_code(name, estimate):
                estimate.save(folder / name, files={PICTURE: writer(estimate)})
        except PluginError as failure:
            del estimates.given[name]
            estimates.failed[name] = failure


def write_failures(failed: Mapping[str, PluginError], folder: Path) -> list[dict[str, str]]:
    """Write the traceback of each failure; its name, line and file in the folder of results."""
    for name, failure in failed.items():
        (folder / "failures").mkdir(exist_ok=True)
        (folder / "failures" / f"{name}.txt").write_text(failure.details, encoding="utf-8")
    return [{"name": name, "message": str(one), "traceback": f"failures/{name}.txt"} for name, one in failed.items()]


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
    with styled():
        for name, draw in PLOTS.items():
            save_picture(draw(results), folder / f"{name}.png", "png")
    return [f"{folder.name}/{name}.png" for name in PLOTS]


def _text(results: Results, summary: Mapping[str, Any], out: Path) -> str:
    sensors = sensor_estimates(results.measured)
    compared = score_all(sensors, results.truth).rows
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
    parts += [f"FAILED: {one['message']}; traceback: {out / one['traceback']}" for one in summary["failed"]]
    if not any(summary[key] for key in ("scores", "notes", "refused", "failed")):
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
