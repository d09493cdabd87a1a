"""Adhesion level on tracks that its calibration never saw: how often right, how honest, how well changes are placed."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

from estimators.adhesion.adhesion_level import COLUMNS
from estimators.adhesion.classifier import LEVELS
from experiments.figures.interface import Figure
from experiments.reporting import intervals
from experiments.reporting.claims import Claim, Target, at_least, at_most
from experiments.reporting.plots import BLUE, GREY, RED
from experiments.reporting.size import Size
from experiments.runs.adhesion_unseen import NOMINAL, judged
from railsim.plots.style import OPAQUE

SET_COLOURS = {"wheelsets": BLUE, "bogie": RED}
SET_NAMES = {"wheelsets": "wheelsets, bogie, body", "bogie": "bogie and body"}
TARGETS = {"wheelsets": 0.95, "bogie": 0.85}
LOCATED = 5.0  # s
BINS = np.array([0.25, 0.5, 0.7, 0.85, 0.95, 0.99, 1.0])


class Adhesion(Figure):
    """Adhesion level by window, its probability, the creep slope and changes of level on unseen tracks."""

    def compute(self, size: Size) -> pd.DataFrame:
        return judged(size)

    def draw(self, table: pd.DataFrame) -> Picture:
        picture = Picture(figsize=(10.0, 8.4), layout="constrained")
        speed, reliability, slope, change = picture.subplots(2, 2).ravel()
        _draw_speed(speed, table)
        _draw_reliability(reliability, table)
        _draw_slope(slope, table)
        _draw_changes(change, table)
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        claims = []
        for kind, target in TARGETS.items():
            rows = _levels(table, kind, 10.0)
            name = f"{SET_NAMES[kind]}: level right in 10 s windows"
            claims += [_right_claim(name, rows, target), _worst_claim(f"{name}, worst track and speed", rows, target)]
        claims += [claim for kind in TARGETS for claim in _other_claims(table, kind)]
        claims += [_honest(table, kind, window) for kind in TARGETS for window in (10.0, 4.0)]
        claims += [_slope_claim(table, kind, known) for kind in TARGETS for known in (True, False)]
        claims += [claim for kind in TARGETS for claim in _change_claims(table, kind)]
        return claims + [_friction_claim(table, kind) for kind in TARGETS]


def _where(table: pd.DataFrame, chosen: np.ndarray) -> pd.DataFrame:
    return table.iloc[np.flatnonzero(chosen)]


def _windows(table: pd.DataFrame, kind: str, window: float, known: bool, nominal: bool = True) -> pd.DataFrame:
    """Windows by one set of sensors that count, on the four levels or in between, of nominal or of other vehicles."""
    chosen = (_texts(table, "kind") == "window") & (_texts(table, "sensors") == kind)
    chosen &= (_numbers(table, "window [s]") == window) & np.isfinite(_numbers(table, COLUMNS[0]))
    chosen &= (_texts(table, "vehicle") == NOMINAL) == nominal
    return _where(table, chosen & (np.isin(_texts(table, "condition"), LEVELS) == known))


def _levels(table: pd.DataFrame, kind: str, window: float) -> pd.DataFrame:
    return _windows(table, kind, window, known=True)


def _numbers(table: pd.DataFrame, column: str) -> np.ndarray:
    return np.asarray(table[column], dtype=float)


def _texts(table: pd.DataFrame, column: str) -> np.ndarray:
    return np.asarray(table[column], dtype=str)


def _named(rows: pd.DataFrame) -> np.ndarray:
    """Probabilities, (n, 4)."""
    return np.column_stack([_numbers(rows, column) for column in COLUMNS])


def _right(rows: pd.DataFrame) -> np.ndarray:
    """Whether the likeliest level is the true one, (n,)."""
    return np.array(LEVELS)[_named(rows).argmax(axis=1)] == _texts(rows, "condition")


def _by_run(rows: pd.DataFrame) -> list[pd.DataFrame]:
    """Windows of each run: those of one run are alike, so that a run is a case."""
    return [run for _, run in rows.groupby(["track", "speed [m/s]", "condition", "vehicle"], sort=False)]


def _right_interval(rows: pd.DataFrame) -> intervals.Interval:
    runs = _by_run(rows)
    return intervals.of_mean_share(np.array([_right(run).mean() for run in runs]), np.array([len(run) for run in runs]))


def _right_claim(text: str, rows: pd.DataFrame, target: float) -> Claim:
    return Claim.sampled(text, float(_right(rows).mean()), at_least(target), _right_interval(rows))


def _worst_claim(text: str, rows: pd.DataFrame, target: float) -> Claim:
    parts = [part for _, part in rows.groupby(["track", "speed [m/s]"])]
    worst = min(float(_right(part).mean()) for part in parts)
    return Claim.sampled(text, worst, at_least(target), intervals.least([_right_interval(part) for part in parts]))


def _reliability(rows: pd.DataFrame) -> np.ndarray:
    """By bin of the named level's probability that holds any: its mean, how often it was right, how many; (b, 3)."""
    stated, right = _named(rows).max(axis=1), _right(rows)
    bins = np.digitize(stated, BINS[1:-1])
    return np.array([(stated[bins == b].mean(), right[bins == b].mean(), np.sum(bins == b)) for b in np.unique(bins)])


def _calibration_error(rows: pd.DataFrame) -> float:
    """Mean distance between stated probability and share of right ones, weighted by windows."""
    stated, right, count = _reliability(rows).T
    return float(np.average(np.abs(stated - right), weights=count))


def _honest(table: pd.DataFrame, kind: str, window: float) -> Claim:
    rows = _levels(table, kind, window)
    runs = _by_run(rows)
    interval = intervals.of_statistic(
        lambda chosen: _calibration_error(pd.concat([runs[place] for place in chosen])), len(runs)
    )
    text = f"{SET_NAMES[kind]}: expected calibration error, {window:g} s"
    return Claim.sampled(text, _calibration_error(rows), at_most(0.05), interval)


def _other_claims(table: pd.DataFrame, kind: str) -> list[Claim]:
    """Vehicles that are off their nominal parameters, each."""
    rows = _windows(table, kind, 10.0, known=True, nominal=False)
    return [
        _right_claim(f"{SET_NAMES[kind]}: level right, {vehicle}", part, TARGETS[kind])
        for vehicle, part in rows.groupby("vehicle")
    ]


def _slope_claim(table: pd.DataFrame, kind: str, known: bool) -> Claim:
    rows = _windows(table, kind, 10.0, known)
    apart = _log_slope_error(rows)
    squares = np.array([np.mean(_log_slope_error(run) ** 2) for run in _by_run(rows)])
    low, high, cases = intervals.of_rms(np.sqrt(squares))
    where = "the four levels" if known else "adhesion between two levels, which no calibration saw"
    return Claim.sampled(
        f"{SET_NAMES[kind]}: factor of the creep slope's error, {where}",
        float(np.exp(np.sqrt(np.mean(apart**2)))),
        at_most(1.5),
        intervals.Interval(float(np.exp(low)), float(np.exp(high)), cases),
    )


def _log_slope_error(rows: pd.DataFrame) -> np.ndarray:
    return np.log(_numbers(rows, "creep_slope [-]") / _numbers(rows, "true slope [-]"))


def _errors(table: pd.DataFrame, kind: str, change: str = "change") -> tuple[np.ndarray, np.ndarray]:
    """Errors of the changes' places, s, NaN where none was named; how many were named in each run."""
    rows = _where(table, (_texts(table, "kind") == change) & (_texts(table, "sensors") == kind))
    return _numbers(rows, "time [s]") - _numbers(rows, "true time [s]"), _numbers(rows, "changes named")


def _friction_claim(table: pd.DataFrame, kind: str) -> Claim:
    """Friction alone changes, as a track's column does it: no level of the calibration comes of it."""
    size = np.abs(_errors(table, kind, "friction")[0])
    return _share(f"{SET_NAMES[kind]}: changes of friction alone placed within 5 s", size <= LOCATED, at_least(0.95))


def _change_claims(table: pd.DataFrame, kind: str) -> list[Claim]:
    error, named = _errors(table, kind)
    size, who = np.abs(error), SET_NAMES[kind]
    largest = float(np.nanmax(size))
    return [
        _share(f"{who}: changes named and placed within 5 s", size <= LOCATED, at_least(0.95)),
        Claim.definite(f"{who}: largest error of their place [s]", largest, at_most(LOCATED, "s"), len(size)),
        _share(f"{who}: runs with one change in which more were named", named > 1, at_most(0.05)),
    ]


def _share(text: str, hits: np.ndarray, target: Target) -> Claim:
    return Claim.sampled(text, float(np.mean(hits)), target, intervals.of_share(hits))


def _draw_speed(axes: Axes, table: pd.DataFrame) -> None:
    """Shares with their intervals, beside each other at each speed."""
    series = [(kind, window) for kind in SET_COLOURS for window in (10.0, 4.0)]
    speeds = sorted({float(speed) for speed in _numbers(_levels(table, "bogie", 10.0), "speed [m/s]")})
    for number, (kind, window) in enumerate(series):
        rows, colour = _levels(table, kind, window), SET_COLOURS[kind]
        of, right = _numbers(rows, "speed [m/s]"), _right(rows)
        found = [right[of == speed] for speed in speeds]
        share = np.array([100.0 * one.mean() for one in found])
        ends = np.array([100.0 * np.array(intervals.of_share(one)[:2]) for one in found])
        reach = np.clip([share - ends[:, 0], ends[:, 1] - share], 0.0, None)
        at = np.arange(len(speeds)) + 0.15 * (number - 1.5)
        face = colour if window == 10.0 else "white"
        label = f"{SET_NAMES[kind]}, {window:g} s"
        axes.errorbar(at, share, reach, fmt="o", ms=5, color=colour, mfc=face, capsize=2, label=label)
    for kind, colour in SET_COLOURS.items():
        axes.axhline(100.0 * TARGETS[kind], color=colour, lw=1.0, ls="--")
    axes.set_xticks(range(len(speeds)), [f"{speed:g}" for speed in speeds])
    low = min(80.0, axes.get_ylim()[0])
    axes.set(xlim=(-0.6, len(speeds) - 0.4), ylim=(low - 12.0, 102.0))
    axes.set(xlabel="speed [m/s]", ylabel="windows with the right level [%]")
    axes.set_title("level right, 95 % intervals (dashed: targets for 10 s)")
    axes.legend(loc="lower right", fontsize=8, ncols=2, columnspacing=1.0)


def _draw_reliability(axes: Axes, table: pd.DataFrame) -> None:
    axes.plot([25, 100], [25, 100], color=GREY, lw=0.8, ls="--")
    for kind, colour in SET_COLOURS.items():
        for window, marker, face in ((10.0, "o", colour), (4.0, "s", "none")):
            stated, right, count = _reliability(_levels(table, kind, window)).T
            label = f"{SET_NAMES[kind]}, {window:g} s"
            size = 14.0 + 16.0 * np.log10(count)
            axes.scatter(
                100 * stated, 100 * right, s=size, marker=marker, facecolors=face, edgecolors=colour, label=label
            )
    axes.set(xlim=(25, 102), ylim=(20, 104), xlabel="stated probability of the level [%]", ylabel="right [%]")
    axes.set_title("reliability (larger: more windows)")
    axes.legend(loc="lower right")


def _draw_slope(axes: Axes, table: pd.DataFrame) -> None:
    axes.plot([0.03, 1.0], [0.03, 1.0], color=GREY, lw=0.8, ls="--")
    for (kind, colour), aside in zip(SET_COLOURS.items(), (0.96, 1.04), strict=True):
        for known, face in ((True, colour), (False, "none")):
            rows = _windows(table, kind, 10.0, known)
            true, estimated = _numbers(rows, "true slope [-]"), _numbers(rows, "creep_slope [-]")
            true_slopes = np.unique(true)
            low, middle, high = np.array(
                [np.quantile(estimated[true == one], (0.05, 0.5, 0.95)) for one in true_slopes]
            ).T
            label = f"{SET_NAMES[kind]}, " + ("the levels" if known else "in between")
            reach = [middle - low, high - middle]
            axes.errorbar(
                aside * true_slopes, middle, reach, fmt="o", ms=5, color=colour, mfc=face, capsize=2, label=label
            )
    axes.set(xscale="log", yscale="log", xlabel="true initial slope over Kalker's [-]", ylabel="estimated [-]")
    axes.set_title("creep slope in 10 s windows: median, 5 to 95 %")
    axes.legend(loc="lower right")


def _draw_changes(axes: Axes, table: pd.DataFrame) -> None:
    edges = np.arange(-6.0, 6.01, 0.5)
    most = 1.0
    for kind, colour in SET_COLOURS.items():
        error, _ = _errors(table, kind)
        counts, _ = np.histogram(np.clip(error[np.isfinite(error)], -6.0, 6.0), edges)
        most = max(most, float(counts.max()))
        label = f"{SET_NAMES[kind]}: {len(error)} changes, {int(np.isnan(error).sum())} not named"
        axes.stairs(counts, edges, lw=1.6, color=colour, label=label)
    for edge in (-LOCATED, LOCATED):
        axes.axvline(edge, color=GREY, lw=0.8, ls="--")
    axes.set(ylim=(0.0, 1.25 * most), xlabel="error of the place of a change [s]", ylabel="changes")
    axes.set_title("changes from any level to any other")
    axes.legend(loc="upper left", **OPAQUE)
