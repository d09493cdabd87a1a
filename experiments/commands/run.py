"""`railsim run`: simulate, measure, estimate with every estimator that fits, score, draw."""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import estimators
from estimators.interface import Estimate, Estimator
from experiments.commands.interface import Outcome, table
from experiments.commands.score import score_table
from experiments.commands.simulate import scenario_of
from experiments.reporting.plots import PLOTS, Results, sensor_label
from experiments.scoring.score import KMH, SPEED, score, score_rows, speed_errors
from railsim.errors import InputError
from railsim.files import write_folder_atomically, write_json
from railsim.measurements import Measurements
from railsim.recording import software_versions
from railsim.registry import discover
from railsim.simulation import measure, simulate
from railsim.truth import Truth

INSTANTS = 12  # rows of the table of speeds


@dataclass(frozen=True)
class Estimates:
    """Estimates by estimator, and why an estimator that fits the sensors gave none."""

    found: dict[str, Estimate]
    refused: dict[str, str]


def execute(given: argparse.Namespace) -> Outcome:
    """Write the folder of results; it appears whole, and an older one stays until then."""
    scenario = scenario_of(given)
    out = Path(given.out or Path("results") / scenario.name)
    with write_folder_atomically(out) as aside:
        truth = simulate(scenario, given.engine, progress=True)
        measured = measure(truth, scenario, folder=aside / "recording").measurements
        estimates = estimate_all(measured)
        for name, estimate in estimates.found.items():
            estimate.save(aside / "estimates" / name)
        rows = [row for name, one in estimates.found.items() for row in score_rows(name, score(one, truth))]
        pd.DataFrame(rows, columns=["estimator", "score", "value", "unit"]).to_csv(aside / "scores.csv", index=False)
        results = Results(scenario.name, scenario.description, truth, measured, estimates.found)
        files = draw_all(results, aside / "plots")
        summary: dict[str, Any] = {"scenario": scenario.name, "engine": given.engine, "seed": scenario.seed}
        summary |= {"duration [s]": truth.duration, "distance [m]": float(truth["s [m]"][-1] - truth["s [m]"][0])}
        summary |= {"scores": rows, "refused": estimates.refused, "plots": files, "software": software_versions()}
        write_json(aside / "summary.json", summary)
    return Outcome({"scores": rows, "folder": str(out), **summary}, _text(results, rows, estimates, summary, out))


def estimate_all(measured: Measurements) -> Estimates:
    """Every estimator whose channels the recording has."""
    found, refused = {}, {}
    for name, kind in discover(estimators, Estimator).items():
        estimator = kind.build({})
        if estimator.fits(measured):
            try:
                found[name] = estimator.estimate(measured)
            except InputError as error:
                refused[name] = str(error)
    return Estimates(found, refused)


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


def _text(
    results: Results, rows: list[dict[str, Any]], estimates: Estimates, summary: Mapping[str, Any], out: Path
) -> str:
    sensors = sensor_estimates(results.measured)
    compared = [row for name, one in sensors.items() for row in score_rows(name, score(one, results.truth))]
    parts = [
        f"{results.name}: {results.description}",
        f"{summary['duration [s]']:g} s, {summary['distance [m]']:.0f} m, engine {summary['engine']}, "
        f"seed {summary['seed']}",
    ]
    by_name = sensors | {name: one for name, one in estimates.found.items() if SPEED in one.series.columns}
    if by_name:
        parts += ["", "Speed in km/h", speed_table(results.truth, by_name)]
    if rows or compared:
        parts += ["", "Errors, where valid; sensors to compare with", score_table(rows + compared)]
    parts += [f"{name} gave no estimate: {reason}" for name, reason in estimates.refused.items()]
    if not rows:
        parts.append("No estimator fits the sensors of this scenario.")
    return "\n".join([*parts, "", f"Pictures, recording and estimates: {out}"])


def speed_table(truth: Truth, speeds: Mapping[str, Estimate]) -> str:
    """True and estimated speeds in km/h at some instants."""
    instants = np.linspace(0.0, truth.duration, INSTANTS + 1)[1:]
    true = np.interp(instants, truth.time, truth[SPEED])
    columns = [instants, KMH * true]
    for estimate in speeds.values():
        time, error = speed_errors(estimate, truth)
        nearest = np.searchsorted(time, instants - 1e-9).clip(0, len(time) - 1)
        columns.append(KMH * (error[nearest] + np.interp(time[nearest], truth.time, truth[SPEED])))
    rows = [[None if np.isnan(value) else float(value) for value in row] for row in zip(*columns, strict=True)]
    return table(["time [s]", "true", *speeds], rows, decimals=2)
