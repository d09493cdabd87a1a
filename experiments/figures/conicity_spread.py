"""Part of figure 12: what the spread of the table comes from, one thing at a time.

The article's case has a constant gauge and ideal sensors. The steps go on from there until the filter's own model is
nearly true: the vehicle's parameters are known, wheels and gauge are those that about.json states, the irregularity is
half as large. The spread is the mean square of the relative error of the table, weighted by the time at each shift, of
the median run: single tables run away by a factor of 100, and a mean over the runs would be theirs. They are counted.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from estimators.wheel_rail.conicity_ekf_table import ConicityEkfTable
from experiments.reporting import intervals
from experiments.reporting.claims import Claim, Target, above, at_least, at_most, below
from experiments.reporting.plots import BLACK, GREY, RED
from experiments.runs.contact import Case, run
from experiments.scoring.conicity import function_errors
from experiments.scoring.wheel_rail_truth import contact_truth
from railsim.plots.style import OPAQUE

STEP = "step"
AWAY = 1.0
"""Rms relative error from which a table has run away."""
FIELD, CONSTANT, IDEAL = "as in the field", "gauge constant", "sensors ideal"
PAPER = "gauge constant, sensors ideal"
KNOWN, NEW = "and vehicle known", "and wheels new"
CONE, SMALL, ROLL = "cones for wheels", "wheels new, half the irregularity", "wheels new, by y - d"
SHORT = "gauge, sensors; half the time"
CONICITY = 0.18  # of the cones: near that of new S1002 wheels
_PAPER: Mapping[str, Any] = {"gauge_variation": 0.0, "ideal": True}
_NEW: Mapping[str, Any] = {**_PAPER, "spread": 0.0, "wear": 0.0, "gauge": 1.435}
STEPS: Mapping[str, Mapping[str, Any]] = {
    FIELD: {},
    CONSTANT: {"gauge_variation": 0.0},
    IDEAL: {"ideal": True},
    PAPER: _PAPER,
    KNOWN: {**_PAPER, "spread": 0.0},
    NEW: _NEW,
    CONE: {**_NEW, "cone": CONICITY},
    SMALL: {**_NEW, "lateral_variation": 0.5},
    SHORT: _PAPER,
}
"""Changes of `Case`; SHORT takes half the time, ROLL is NEW judged without the roll of the wheelset. New wheels and
cones are what the filter begins from, so that less excitation alone makes its error smaller there: SMALL tells how the
error grows with the shift and CONE, with the shift as it was, whether the profiles' nonlinearity makes it.
"""


def sweep(cases: Sequence[Case]) -> pd.DataFrame:
    """One row for each step, seed and bin, compiled engine: what `function_errors` gives, and the step and seed."""
    tables = []
    for case in cases:
        for step, changes in STEPS.items():
            half = {"duration": case.duration / 2.0} if step == SHORT else {}
            truth, measured = run(replace(case, **changes, **half), "compiled")
            function = ConicityEkfTable().estimate(measured).about["conicity_function"]
            true = contact_truth(truth)
            shifts = {step: true}
            if step == NEW:
                shifts[ROLL] = replace(true, shift=truth["wheelset1.y [m]"] - true.track)
            tables += [
                function_errors(function, one).dropna().assign(seed=case.seed, step=name)
                for name, one in shifts.items()
            ]
    return pd.concat(tables, ignore_index=True)


def draw(axes: Axes, table: pd.DataFrame) -> None:
    """Rms relative error of every run by step, and their median."""
    names = list(dict.fromkeys(table[STEP]))
    for place, name in enumerate(names):
        each = np.sqrt(_squares(table, name))
        known = each[np.isfinite(each)]
        axes.plot(known, np.full(len(known), place), ".", color=GREY, ms=5, label="runs" if place == 0 else None)
        axes.plot([np.median(each)], [place], "o", color=RED, ms=7, label="median run" if place == 0 else None)
        if len(known) < len(each):
            text, where = f"{len(each) - len(known)} without a number", ("axes fraction", "data")
            axes.annotate(text, (0.99, place), xycoords=where, ha="right", va="bottom", fontsize=9)
    axes.axvline(AWAY, color=BLACK, lw=0.8, ls="--")
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set(xscale="log", xlabel="relative error, rms by time [-]", title="what makes the spread")
    axes.legend(loc="upper right", **OPAQUE)


def claims(table: pd.DataFrame) -> Iterator[Claim]:
    """Whether gauge and sensors make the spread, and which of the other things does."""
    found = {name: _squares(table, name) for name in dict.fromkeys(table[STEP])}
    for name, of, target, why in (
        (CONSTANT, FIELD, below(1.0), "the gauge makes the spread"),
        (IDEAL, FIELD, below(1.0), "the sensors make it"),
        (PAPER, FIELD, below(1.0), "gauge and sensors make it"),
        (NEW, PAPER, at_most(0.5), "most of it is what about.json does not know, parameters, wear and gauge"),
        (KNOWN, PAPER, at_most(0.5), "most of it is parameters of the vehicle"),
        (NEW, KNOWN, at_most(0.5), "most of the rest is wear and nominal gauge"),
        (CONE, NEW, at_most(0.5), "most of the rest is nonlinearity of the profiles"),
        (SMALL, NEW, at_most(0.5), "the rest goes with the size of the shift"),
        (SHORT, PAPER, above(1.0), "the rest is lack of data: half the time is worse"),
        (ROLL, NEW, at_most(0.5), "most of the rest is the wheelset's roll"),
    ):
        yield _ratio(found[name], found[of], f"'{name}', mean square over that of '{of}'", target, why)
    for name in (FIELD, PAPER, KNOWN, NEW):
        away = found[name] > AWAY**2
        what = f"'{name}': share of runs whose table ran away or ended without a number"
        yield Claim.sampled(what, float(np.mean(away)), at_most(0.05), intervals.of_share(away))
    rare = _rare(table, PAPER)
    what = f"'{PAPER}': share of the squared error of all bins in the quarter of each run's bins with the least data"
    yield Claim.sampled(what, float(np.mean(rare)), at_least(0.5), intervals.of_mean_share(rare))
    common = _level(table, NEW)

    def share(chosen: np.ndarray) -> float:
        return float(np.mean(common[chosen]) ** 2 / np.mean(found[NEW][chosen]))

    what = f"'{NEW}': an error that is the same in all runs ({np.mean(common):.3g} of the conicity), share of it"
    every = np.arange(len(common))
    yield Claim.sampled(what, share(every), at_least(0.5), intervals.of_statistic(share, len(common)))


def _ratio(values: np.ndarray, others: np.ndarray, what: str, target: Target, why: str) -> Claim:
    """Of the median runs, by the same runs."""

    def ratio(chosen: np.ndarray) -> float:
        return float(np.median(values[chosen]) / np.median(others[chosen]))

    rms = f"rms {np.sqrt(np.median(values)):.3g} and {np.sqrt(np.median(others)):.3g}"
    interval = intervals.of_statistic(ratio, len(values))
    return Claim.sampled(f"{why}: {what} ({rms})", ratio(np.arange(len(values))), target, interval)


def _runs(table: pd.DataFrame, step: str) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Relative errors and shares of time of the bins, by the runs of a step."""
    rows: Any = table.loc[(table[STEP] == step).to_numpy()]
    for _, one in rows.groupby("seed", sort=True):
        yield (one["estimate [-]"] / one["true [-]"] - 1.0).to_numpy(float), one["share [-]"].to_numpy(float)


def _squares(table: pd.DataFrame, step: str) -> np.ndarray:
    """Mean square of the relative error by time, of each seed; infinite where the table has no number."""
    seeds = sorted(set(table["seed"]))
    present = sorted(set(table.loc[(table[STEP] == step).to_numpy(), "seed"]))
    values = np.full(len(seeds), np.inf)
    squares = [np.average(error**2, weights=share) for error, share in _runs(table, step)]
    values[np.searchsorted(seeds, present)] = squares
    return values


def _level(table: pd.DataFrame, step: str) -> np.ndarray:
    """Mean relative error by time, of each run."""
    return np.array([np.average(error, weights=share) for error, share in _runs(table, step)])


def _rare(table: pd.DataFrame, step: str) -> np.ndarray:
    """Share of the squared errors, every bin alike, that the quarter of bins with the least time has, of each run."""
    return np.array(
        [
            np.sum(error[share <= np.quantile(share, 0.25)] ** 2) / np.sum(error**2)
            for error, share in _runs(table, step)
        ]
    )
