"""Runs that figures 3 to 5 share: 5 m/s through a crossover, MEMS sensors, a tachometer that is 1 % wrong."""

from typing import Any

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from estimators.signals.bands import Band, band_pass, high_pass
from estimators.track.alignment_lateral import AlignmentLateral
from estimators.track.switches import Switches
from experiments.scoring.track import true_track
from railsim import load_scenario, measure, simulate
from railsim.scenario import Scenario
from railsim.track.switches import Crossover
from railsim.truth import Truth

X = "from middle [m]"
SEED = "seed [-]"
LETTERS = "ABCDEF"
CUT = 35.0  # m
SHAPE = Crossover()
EACH_SIDE = SHAPE.length / 2
PLAIN = (EACH_SIDE + 10.0, EACH_SIDE + 90.0)  # m beyond the middle: plain track


def crossover_table(fast: bool) -> pd.DataFrame:
    """What sensors with different noise show of one run.

    Returns
    -------
    Rows over distance (column "label" empty): "seed [-]", "from middle [m]" (estimated), "s [m]" (true), "yaw [rad]",
    "lateral_curvature [1/m]", "vertical_curvature [1/m]", "alignment [m]" (as in the paper), "compensated [m]" (the
    bogie's own motion undone), "true alignment [m]", "speed [m/s]" of the tachometer. Rows of features ("label" A to
    F): "from middle [m]", its "from_middle_std [m]", "odometer [m]" (the tachometer's own distance from the middle),
    "true from middle [m]" (where the bogie's centre truly was at the moment at which the estimate says that it was at
    the feature) and "feature [m]" (where the feature is), both from the true middle.
    """
    scenario = load_scenario("crossover")
    truth = simulate(scenario, engine="compiled" if fast else "exudyn")
    return pd.concat([_events(truth, scenario, seed) for seed in range(1, 2 if fast else 11)], ignore_index=True)


def series(table: pd.DataFrame, seed: int = 1) -> dict[str, np.ndarray]:
    """Columns of the rows over distance of one seed."""
    rows = (np.asarray(table["label"].fillna("")) == "") & (np.asarray(table[SEED]) == seed)
    return {str(name): np.asarray(table[name])[rows] for name in table.columns}


def features(table: pd.DataFrame) -> dict[str, np.ndarray]:
    """Columns of the rows of features, all seeds."""
    rows = np.asarray(table["label"].fillna("")) != ""
    return {str(name): np.asarray(table[name])[rows] for name in table.columns}


def seeds(table: pd.DataFrame) -> list[int]:
    """The seeds."""
    return sorted({int(seed) for seed in np.asarray(table[SEED])})


def symmetry(x: np.ndarray, values: np.ndarray, sign: float, centre: float = 0.0) -> float:
    """Correlation of the values before the centre with `sign` times those after it, out to the toes."""
    each = np.arange(0.0, EACH_SIDE, 0.125)
    before, after = np.interp(centre - each, x, values), np.interp(centre + each, x, values)
    return float(np.corrcoef(before, sign * after)[0, 1])


def _events(truth: Truth, scenario: Scenario, seed: int) -> pd.DataFrame:
    measured = measure(truth, scenario, seed=seed).measurements
    estimate = Switches().estimate(measured)
    scale, middle = (estimate.about["crossovers"][0][key] for key in ("odometer_scale [-]", "middle [m]"))
    plain, sharp = (AlignmentLateral(compensation=x, cut=CUT).estimate(measured).series for x in (False, True))
    s, time = (np.asarray(estimate.series[name]) for name in ("s [m]", "time [s]"))
    rows: dict[str, Any] = {"label": "", SEED: seed, X: (s - middle) / (1 + scale)}
    rows["s [m]"] = np.interp(time, truth.time, truth["s [m]"])
    for name in ("yaw [rad]", "lateral_curvature [1/m]", "vertical_curvature [1/m]"):
        rows[name] = np.asarray(estimate.series[name])
    for name, alignment in (("alignment", plain), ("compensated", sharp)):
        rows[f"{name} [m]"] = np.interp(time, np.asarray(alignment["time [s]"]), np.asarray(alignment["lateral [m]"]))
    rows["true alignment [m]"] = _true_alignment(truth, time)
    wheel = "wheelset1.speed [m/s]"
    rows["speed [m/s]"] = np.interp(time, measured.time(wheel), measured[wheel])
    return pd.concat([pd.DataFrame(rows), _features(estimate, truth, seed, middle)], ignore_index=True)


def _features(estimate: Estimate, truth: Truth, seed: int, middle: float) -> pd.DataFrame:
    real = {one["label"]: one["s [m]"] for one in truth.about["features"]}
    rows = []
    for event in estimate.about["events"]:
        at = float(np.interp(event["time [s]"], truth.time, truth["s [m]"]))
        rows.append(
            {
                "label": event["label"],
                SEED: seed,
                X: event["from_middle [m]"],
                "from_middle_std [m]": event["from_middle_std [m]"],
                "odometer [m]": event["s [m]"] - middle,
                "true from middle [m]": at - SHAPE.middle,
                "feature [m]": real[event["label"]] - SHAPE.middle,
            }
        )
    return pd.DataFrame(rows)


def _true_alignment(truth: Truth, time: np.ndarray) -> np.ndarray:
    """The track's lateral path, design curve and irregularity, through the same filter, m."""
    true = true_track(truth, time, 0.125)
    irregular = high_pass(np.asarray(true["lateral [m]"]), 0.125, CUT)
    return irregular + band_pass(np.asarray(true["curvature [1/m]"]), 0.125, Band(0.0, CUT), 2)
