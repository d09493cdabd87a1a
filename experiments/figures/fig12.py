"""Figure 12: conicity over the lateral shift by a Kalman filter with a look-up table, and where it can be trusted.

What its spread comes from, with the article's own case of constant gauge and ideal sensors, is in `conicity_spread`.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture
from scipy.stats import rankdata

from estimators.wheel_rail.conicity_ekf_table import ConicityEkfTable
from experiments.figures import conicity_spread
from experiments.figures.interface import Figure
from experiments.reporting import intervals
from experiments.reporting.claims import HONEST, Claim, Target, above, at_most, below
from experiments.reporting.plots import BLACK, GREY, RED
from experiments.reporting.size import Size
from experiments.runs.contact import Case, ensemble, run
from experiments.scoring.conicity import function_errors
from experiments.scoring.wheel_rail_truth import contact_truth
from railsim.analysis.statistics import root_mean_square

SEEDS, FAST_SEEDS = 20, 2
STEP_SEEDS = 60  # for what the spread comes from; none of them was seen when its steps were chosen
WEARS = (0.0, 0.1)
SMALL = 1.0e-3
"""Shifts that are small, m."""
SMALL_REASON = "a sample tells with its shift squared, since 2 mm of gauge move the radii as much as 1 mm of shift"
"""Why most data, which are at small shifts, do not fit best there."""
BANDS = 8
Bins = dict[str, np.ndarray]
"""Columns of the table, of one run or of several."""


class Fig12(Figure):
    """Twenty runs: new to worn wheels, 20 to 45 m/s, other tracks and vehicles."""

    def compute(self, size: Size) -> pd.DataFrame:
        """One row for each seed and bin of y - d."""
        cases, others = (
            ensemble(size.of(count, FAST_SEEDS), WEARS, (1.434, 1.436), first)
            for count, first in ((SEEDS, 101), (STEP_SEEDS, 301))
        )
        if size.reduced:
            cases, others = ([replace(case, duration=30.0) for case in ones] for ones in (cases, others))
        shown = [_seed(case, "compiled" if size.reduced else "exudyn") for case in cases]
        return pd.concat([*shown, conicity_spread.sweep(others)], ignore_index=True)

    def draw(self, table: pd.DataFrame) -> Picture:
        """One wheelset's function with its data density, errors of all over the density, and the spread by cause."""
        table, steps = _parts(table)
        figure = Picture(figsize=(10.0, 9.0), layout="constrained")
        grid = figure.add_gridspec(3, 2, height_ratios=(2.0, 1.0, 3.0))
        left, below, right = (
            figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[:2, 1]),
        )  # fmt: skip
        wheelset = table[table["seed"] == table["seed"].iloc[0]]
        shift = 1e3 * wheelset["shift [m]"]
        left.plot(shift, wheelset["true [-]"], color=BLACK, lw=1.4, label="true (mean over the gauge)")
        left.plot(shift, wheelset["estimate [-]"], color=RED, lw=1.2, label="look-up table at the end")
        low, high = (wheelset["estimate [-]"] + sign * 2.0 * wheelset["std [-]"] for sign in (-1.0, 1.0))
        left.fill_between(shift, low, high, color=RED, alpha=0.2, lw=0)
        left.set(ylabel="secant conicity [-]", ylim=(0.0, 0.5), title="one wheelset; band: 2 std")
        left.legend(loc="upper right")
        below.bar(shift, 100 * wheelset["share [-]"], width=0.22, color=GREY)
        below.set(xlabel="y - d [mm]", ylabel="time [%]", xlim=left.get_xlim())
        bins = _columns(table)
        right.loglog(
            100 * bins["share [-]"], np.abs(bins["relative [-]"]), ".", ms=3, color=GREY, label="bins of all runs"
        )
        share, error = _bands(bins)
        right.loglog(100 * share, error, "o-", color=RED, label="rms")
        right.set(
            xlabel="share of time in the bin [%]",
            ylabel="relative error of the conicity [-]",
            ylim=(1e-3, 10.0),
            title="all runs",
        )
        right.legend()
        conicity_spread.draw(figure.add_subplot(grid[2, :]), steps)
        return figure

    def check(self, table: pd.DataFrame) -> list[Claim]:
        """Best at small shifts, worst where data are rare; honest; what the spread comes from."""
        table, steps = _parts(table)
        runs = [_columns(rows) for _, rows in table.groupby("seed", sort=False)]
        every = _joined(runs)
        outer = root_mean_square(every["error [-]"][~_small(every)])
        low, high, cases = _resampled(_small_over_large, runs)
        interval = intervals.Interval(low * outer, high * outer, cases)  # of the ratio, times what it is compared with
        text = "all runs: rms error at shifts up to 1 mm below that beyond"
        claims = [Claim.sampled(text, root_mean_square(every["error [-]"][_small(every)]), at_most(outer), interval)]
        for text, number, target in (
            ("all runs: relative rms error, rarest over commonest quarter of bins", _rare_over_common, above(1.3)),
            ("rank correlation of density and relative error", _trend, at_most(-0.5)),
        ):
            claims.append(Claim.sampled(text, number(every), target, _resampled(number, runs)))
        for text, (number, target) in OF_A_RUN.items():
            values = np.array([number(run) for run in runs])
            claims.append(Claim.sampled(text, float(np.median(values)), target, intervals.of_median(values)))
        return [*claims, _honest(runs), *conicity_spread.claims(steps)]


def _parts(table: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Rows of the runs that are shown, and of the steps that tell what the spread comes from."""
    steps = table[conicity_spread.STEP].notna().to_numpy()
    return table.loc[~steps].drop(columns=conicity_spread.STEP), table.loc[steps]


def _seed(case: Case, engine: str) -> pd.DataFrame:
    truth, measured = run(case, engine)
    estimate = ConicityEkfTable().estimate(measured)
    found = function_errors(estimate.about["conicity_function"], contact_truth(truth))
    return found.dropna().assign(seed=case.seed, speed=case.speed, wear=case.wear)


def _columns(table: pd.DataFrame) -> Bins:
    """Columns of numbers, and "error [-]" and "relative [-]"."""
    bins = {str(name): table[name].to_numpy(dtype=float) for name in table.columns}
    error = bins["estimate [-]"] - bins["true [-]"]
    return bins | {"error [-]": error, "relative [-]": error / bins["true [-]"]}


def _joined(runs: Sequence[Bins]) -> Bins:
    return {name: np.concatenate([run[name] for run in runs]) for name in runs[0]}


def _resampled(number: Callable[[Bins], float], runs: Sequence[Bins]) -> intervals.Interval:
    """A case is a run."""
    return intervals.of_statistic(lambda chosen: number(_joined([runs[place] for place in chosen])), len(runs))


def _small(bins: Bins) -> np.ndarray:
    return np.abs(bins["shift [m]"]) <= SMALL


def _small_over_large(bins: Bins) -> float:
    """Rms error at small shifts over that beyond."""
    return root_mean_square(bins["error [-]"][_small(bins)]) / root_mean_square(bins["error [-]"][~_small(bins)])


def _relative_small_over_large(bins: Bins) -> float:
    return root_mean_square(bins["relative [-]"][_small(bins)]) / root_mean_square(bins["relative [-]"][~_small(bins)])


def _rare_over_common(bins: Bins) -> float:
    return _least_over_most(bins["relative [-]"], bins["share [-]"])


def _telling_little_over_much(bins: Bins) -> float:
    return _least_over_most(bins["relative [-]"], bins["share [-]"] * bins["shift [m]"] ** 2)


def _least_over_most(relative: np.ndarray, measure: np.ndarray) -> float:
    """Relative rms error in the quarter of bins with the least of a measure over that with the most."""
    least, most = measure <= np.quantile(measure, 0.25), measure >= np.quantile(measure, 0.75)
    return root_mean_square(relative[least]) / root_mean_square(relative[most])


def _bands(bins: Bins) -> tuple[np.ndarray, np.ndarray]:
    """Mean share of time and relative rms error in bands of the density, equally many bins in each."""
    bands = np.array_split(np.argsort(bins["share [-]"]), BANDS)
    share = np.array([bins["share [-]"][band].mean() for band in bands])
    return share, np.array([root_mean_square(bins["relative [-]"][band]) for band in bands])


def _trend(bins: Bins) -> float:
    """Rank correlation of density and relative error over the bands."""
    share, error = _bands(bins)
    return float(np.corrcoef(rankdata(share), rankdata(error))[0, 1])


def _honest(runs: Sequence[Bins]) -> Claim:
    """Share of the time in bins whose error is within two standard deviations."""
    inside = [np.average(np.abs(run["error [-]"]) <= 2.0 * run["std [-]"], weights=run["share [-]"]) for run in runs]
    weights = np.array([run["share [-]"].sum() for run in runs])
    value = float(np.average(inside, weights=weights))
    return Claim.sampled(
        "within two standard deviations", value, HONEST, intervals.of_mean_share(np.array(inside), weights)
    )


OF_A_RUN: dict[str, tuple[Callable[[Bins], float], Target]] = {
    f"median run: relative error up to 1 mm over that beyond ({SMALL_REASON})": (
        _relative_small_over_large,
        below(1.0),
    ),
    f"median run: relative error, rarest over commonest quarter of bins ({SMALL_REASON})": (
        _rare_over_common,
        above(1.0),
    ),
    "median run: relative error, quarter of bins with the least information (share of time times shift squared) over "
    "that with the most": (_telling_little_over_much, above(1.3)),
}
"""Numbers that every run has for itself: what it is, how it is found, where it should lie."""
