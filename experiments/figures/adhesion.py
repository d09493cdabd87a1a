"""Adhesion level on tracks that its calibration never saw: how often right, how honest, how well changes are placed."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

from estimators.adhesion.adhesion_level import COLUMNS
from estimators.adhesion.classifier import LEVELS
from experiments.figures.interface import Claim, Figure
from experiments.reporting.plots import BLUE, GREY, RED
from experiments.runs.adhesion_unseen import NOMINAL, judged

SET_COLOURS = {"wheelsets": BLUE, "bogie": RED}
SET_NAMES = {"wheelsets": "wheelsets, bogie, body", "bogie": "bogie and body"}
TARGETS = {"wheelsets": 0.95, "bogie": 0.85}
LOCATED = 5.0  # s
BINS = np.array([0.25, 0.5, 0.7, 0.85, 0.95, 0.99, 1.0])


class Adhesion(Figure):
    """Adhesion level by window, its probability, the creep slope and changes of level on unseen tracks."""

    def compute(self, fast: bool) -> pd.DataFrame:
        return judged(fast)

    def draw(self, table: pd.DataFrame) -> Picture:
        picture = Picture(figsize=(11.5, 8.4), layout="constrained")
        speed, reliability, slope, change = picture.subplots(2, 2).ravel()
        _draw_speed(speed, table)
        _draw_reliability(reliability, table)
        _draw_slope(slope, table)
        _draw_changes(change, table)
        for axes in (speed, reliability, slope, change):
            axes.grid(True, color="#dddddd", lw=0.6)
            axes.set_axisbelow(True)
            axes.spines[["top", "right"]].set_visible(False)
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        claims = []
        for kind, target in TARGETS.items():
            rows = _levels(table, kind, 10.0)
            right = float(_right(rows).mean())
            worst = min(float(_right(part).mean()) for _, part in rows.groupby(["track", "speed [m/s]"]))
            name = f"{SET_NAMES[kind]}: level right in 10 s windows"
            claims.append(Claim(name, right, f">= {target}", right >= target))
            claims.append(Claim(f"{name}, worst track and speed", worst, f">= {target}", worst >= target))
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


def _reliability(table: pd.DataFrame, kind: str, window: float) -> np.ndarray:
    """By bin of the named level's probability that holds any: its mean, how often it was right, how many; (b, 3)."""
    rows = _levels(table, kind, window)
    stated, right = _named(rows).max(axis=1), _right(rows)
    bins = np.digitize(stated, BINS[1:-1])
    return np.array([(stated[bins == b].mean(), right[bins == b].mean(), np.sum(bins == b)) for b in np.unique(bins)])


def _honest(table: pd.DataFrame, kind: str, window: float) -> Claim:
    """Mean distance between stated probability and share of right ones, weighted by windows (calibration error)."""
    stated, right, count = _reliability(table, kind, window).T
    error = float(np.average(np.abs(stated - right), weights=count))
    return Claim(f"{SET_NAMES[kind]}: expected calibration error, {window:g} s", error, "<= 0.05", error <= 0.05)


def _other_claims(table: pd.DataFrame, kind: str) -> list[Claim]:
    """Vehicles that are off their nominal parameters, each."""
    rows, target = _windows(table, kind, 10.0, known=True, nominal=False), TARGETS[kind]
    vehicles, right = _texts(rows, "vehicle"), _right(rows)
    shares = {vehicle: float(right[vehicles == vehicle].mean()) for vehicle in np.unique(vehicles)}
    return [
        Claim(f"{SET_NAMES[kind]}: level right, {vehicle}", share, f">= {target}", share >= target)
        for vehicle, share in shares.items()
    ]


def _slope_claim(table: pd.DataFrame, kind: str, known: bool) -> Claim:
    rows = _windows(table, kind, 10.0, known)
    apart = np.log(_numbers(rows, "creep_slope [-]") / _numbers(rows, "true slope [-]"))
    factor = float(np.exp(np.sqrt(np.mean(apart**2))))
    where = "the four levels" if known else "adhesion between two levels, which no calibration saw"
    return Claim(f"{SET_NAMES[kind]}: factor of the creep slope's error, {where}", factor, "<= 1.5", factor <= 1.5)


def _errors(table: pd.DataFrame, kind: str, change: str = "change") -> tuple[np.ndarray, np.ndarray]:
    """Errors of the changes' places, s, NaN where none was named; how many were named in each run."""
    rows = _where(table, (_texts(table, "kind") == change) & (_texts(table, "sensors") == kind))
    return _numbers(rows, "time [s]") - _numbers(rows, "true time [s]"), _numbers(rows, "changes named")


def _friction_claim(table: pd.DataFrame, kind: str) -> Claim:
    """Friction alone changes, as a track's column does it: no level of the calibration comes of it."""
    size = np.abs(_errors(table, kind, "friction")[0])
    within = float(np.mean(size <= LOCATED))
    name = f"{SET_NAMES[kind]}: changes of friction alone placed within 5 s"
    return Claim(name, within, ">= 0.95", within >= 0.95)


def _change_claims(table: pd.DataFrame, kind: str) -> list[Claim]:
    error, named = _errors(table, kind)
    size = np.abs(error)
    within, more, largest = float(np.mean(size <= LOCATED)), float(np.mean(named > 1)), float(np.nanmax(size))
    who = SET_NAMES[kind]
    return [
        Claim(f"{who}: changes named and placed within 5 s", within, ">= 0.95", within >= 0.95),
        Claim(f"{who}: largest error of their place [s]", largest, "<= 5", largest <= LOCATED),
        Claim(f"{who}: runs with one change in which more were named", more, "<= 0.05", more <= 0.05),
    ]


def _draw_speed(axes: Axes, table: pd.DataFrame) -> None:
    for kind, colour in SET_COLOURS.items():
        for window, style, marker in ((10.0, "-", "o"), (4.0, ":", "s")):
            rows = _levels(table, kind, window)
            speeds, right = _numbers(rows, "speed [m/s]"), _right(rows)
            share = [100.0 * right[speeds == speed].mean() for speed in np.unique(speeds)]
            label = f"{SET_NAMES[kind]}, {window:g} s"
            axes.plot(np.unique(speeds), share, style, marker=marker, ms=4, color=colour, label=label)
        axes.axhline(100.0 * TARGETS[kind], color=colour, lw=0.8, ls="--")
    axes.set(ylim=(80.0, 101.0), xlabel="speed [m/s]", ylabel="windows with the right level [%]")
    axes.set_title("level right, by speed (dashed: targets for 10 s)", fontsize=10)
    axes.legend(frameon=False, fontsize=8, loc="lower right")


def _draw_reliability(axes: Axes, table: pd.DataFrame) -> None:
    axes.plot([25, 100], [25, 100], color=GREY, lw=0.8, ls="--")
    for kind, colour in SET_COLOURS.items():
        for window, marker, face in ((10.0, "o", colour), (4.0, "s", "none")):
            stated, right, count = _reliability(table, kind, window).T
            label = f"{SET_NAMES[kind]}, {window:g} s"
            size = 14.0 + 16.0 * np.log10(count)
            axes.scatter(
                100 * stated, 100 * right, s=size, marker=marker, facecolors=face, edgecolors=colour, label=label
            )
    axes.set(xlim=(25, 102), ylim=(20, 104), xlabel="stated probability of the level [%]", ylabel="right [%]")
    axes.set_title("reliability (larger: more windows)", fontsize=10)
    axes.legend(frameon=False, fontsize=8, loc="lower right")


def _draw_slope(axes: Axes, table: pd.DataFrame) -> None:
    axes.plot([0.03, 1.0], [0.03, 1.0], color=GREY, lw=0.8, ls="--")
    for (kind, colour), aside in zip(SET_COLOURS.items(), (0.96, 1.04), strict=True):
        for known, face in ((True, colour), (False, "none")):
            rows = _windows(table, kind, 10.0, known)
            true, found = _numbers(rows, "true slope [-]"), _numbers(rows, "creep_slope [-]")
            places = np.unique(true)
            low, middle, high = np.array([np.quantile(found[true == one], (0.05, 0.5, 0.95)) for one in places]).T
            label = f"{SET_NAMES[kind]}, " + ("the levels" if known else "in between")
            reach = [middle - low, high - middle]
            axes.errorbar(aside * places, middle, reach, fmt="o", ms=5, color=colour, mfc=face, capsize=2, label=label)
    axes.set(xscale="log", yscale="log", xlabel="true initial slope over Kalker's [-]", ylabel="estimated [-]")
    axes.set_title("creep slope in 10 s windows: median, 5 to 95 %", fontsize=10)
    axes.legend(frameon=False, fontsize=8, loc="lower right")


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
    axes.set_title("changes from any level to any other", fontsize=10)
    axes.legend(frameon=False, fontsize=8, loc="upper left")
