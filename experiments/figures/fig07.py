"""Figure 7: dampers and conicity over time with and without wheelset sensors, and with an uncertain track.

The paper's figure is of real tests; here the data come from the nonlinear half vehicle (Exudyn), with other noise for
every seed and, in the uncertain cases, another error of the track. These two differ in what the filter assumes of it.
How the conicity's end changes with the size of that error is in `track_error`.
"""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

from estimators.suspension.suspension_rbpf import SuspensionRbpf
from estimators.suspension.verdicts import std_name
from estimators.vehicle.affine import PARAMETERS
from experiments.figures import track_error
from experiments.figures.parted import PartedFigure, Parts
from experiments.reporting import intervals
from experiments.reporting.claims import Claim, at_least, at_most
from experiments.reporting.plots import BLACK, BLUE, GREEN, PURPLE, RED
from experiments.reporting.size import Size
from experiments.runs.suspension import CASE, JUDGED, SEED, TIME, over_time
from railsim.analysis.statistics import root_mean_square

FULL, REDUCED = "wheelsets, bogie, body", "bogie, body"
UNCERTAIN, OTHER = "bogie, body; track uncertain", "the same, other assumption"
SHARE = 0.05  # of the track's power is error: 0.22 of its size
COLOURS = {FULL: BLUE, REDUCED: GREEN, UNCERTAIN: RED, OTHER: PURPLE}
SEEDS, FAST_SEEDS, SMOKE_SEEDS = 20, 2, 1
DURATION, FAST_DURATION, SMOKE_DURATION = 65.0, 20.0, 2.0  # s
TRACK = JUDGED + 3  # of its own: every sample is taken since the figure was seen on JUDGED with every second one
LABELS = ("$C_{sy}$ [kN s/m]", "$C_{s\\psi}$ [kN m s/rad]", "conicity $\\lambda$ [-]")
TITLES = ("(a) secondary lateral dampers", "(b) yaw dampers", "(c) conicity")
END = 0.1  # s
SCALES = (1e-3, 1e-3, 1.0)
NOMINAL = "true {}"


def cases() -> dict[str, tuple[SuspensionRbpf, float]]:
    """Estimator and track error of each case."""
    full = SuspensionRbpf(track="exact")
    reduced = full.but(wheelset_sensors=False)
    uncertain = reduced.but(track="uncertain", track_error=SHARE)
    return {
        FULL: (full, 0.0),
        REDUCED: (reduced, 0.0),
        UNCERTAIN: (uncertain, SHARE),
        OTHER: (uncertain.but(track_error=SHARE / 4), SHARE),
    }


class Fig07(PartedFigure):
    """Estimates over time and their spread over the seeds."""

    def parts(self, size: Size) -> Parts:
        """Estimates of every case over time, by seeds; and the ends over the track's error, by seeds."""
        engine = "compiled" if size.reduced else "exudyn"
        seeds = size.of(SEEDS, FAST_SEEDS, SMOKE_SEEDS)
        duration = size.of(DURATION, FAST_DURATION, SMOKE_DURATION)
        runs = {
            f"seed_{seed}": partial(over_time, cases(), TRACK, seed, duration, engine) for seed in range(1, seeds + 1)
        }
        return {**runs, **track_error.parts(size, duration, engine)}

    def draw(self, table: pd.DataFrame) -> Picture:
        """The three parameters over time with the spread over the seeds, their relative deviations, and the ends of
        conicity and dampers over the track's error.
        """
        table, ends = _parts(table)
        picture = Picture(figsize=(10.0, 11.5), layout="constrained")
        panels = picture.subplots(3, 2)
        for axes, name, scale, label, title in zip(panels.flat, PARAMETERS, SCALES, LABELS, TITLES, strict=False):
            for case, colour in COLOURS.items():
                _band(axes, table[table[CASE] == case], name, scale, colour, case)
            true = float(table[NOMINAL.format(name)].iloc[0]) * scale
            axes.axhline(true, color=BLACK, lw=1.0, ls="--", label="true")
            axes.set(xlabel="time [s]", ylabel=label, title=title, ylim=(0.0, 2.0 * true))
        _deviations(panels[1, 1], table)
        track_error.draw_conicity(panels[2, 0], ends)
        panels[2, 0].set(ylabel=LABELS[2], title="(e) conicity at the end over the error of the track")
        track_error.draw_dampers(panels[2, 1], ends)
        panels[2, 1].set(title="(f) dampers at the end over the error of the track")
        picture.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        """The paper's three claims over the seeds: largest errors, means and spreads at the end; the third one over
        the track's error too.
        """
        table, ends = _parts(table)
        claims = [_within(table, FULL, i, limit) for i, limit in enumerate((5.0, 5.0, 0.02))]
        claims += [_more(table, i) for i in range(2)]
        claims += [_within(table, REDUCED, i, limit) for i, limit in enumerate((10.0, 10.0, 0.03))]
        claims += [_within(table, UNCERTAIN, i, 10.0) for i in range(2)]
        return [*claims, *_offsets(table), *track_error.claims(ends)]


def _parts(table: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Rows over time, and those of the track's error."""
    ends = table[track_error.ERROR].notna().to_numpy()
    return table.loc[~ends], table.loc[ends]


def _deviations(axes: Axes, table: pd.DataFrame) -> None:
    """Relative deviations over time, mean of the seeds; without the end, whose stretch is shorter than the others."""
    for case in (FULL, REDUCED):
        rows: Any = table[(table[CASE] == case) & (table[TIME] < table[TIME].max() - END)]
        for name, line, label in zip(PARAMETERS, ("-", "--", ":"), LABELS, strict=True):
            ratio = (rows[std_name(name)] / rows[name]).groupby(rows[TIME]).mean()
            text = label.partition(" [")[0] if case == FULL else None
            axes.plot(ratio.index, 100.0 * ratio, line, color=COLOURS[case], lw=1.2, label=text)
    axes.set(
        xlabel="time [s]", ylabel="standard deviation [% of the estimate]", yscale="log", title="(d) stated deviations"
    )
    axes.yaxis.set_major_formatter("{x:g}")
    axes.legend()


def _band(axes: Axes, rows: Any, name: str, scale: float, colour: str, label: str) -> None:
    seeds = rows.pivot_table(index=TIME, columns=SEED, values=name) * scale
    axes.plot(seeds.index, seeds.mean(axis=1), color=colour, lw=1.2, label=label)
    axes.fill_between(seeds.index, seeds.min(axis=1), seeds.max(axis=1), color=colour, alpha=0.2, lw=0)


def _errors(table: pd.DataFrame, case: str, index: int) -> np.ndarray:
    """Errors at the end, one a seed: per cent for dampers."""
    rows: Any = table[(table[CASE] == case) & (table[TIME] >= table[TIME].max() - 1e-6)]
    name = PARAMETERS[index]
    error = (rows[name] - rows[NOMINAL.format(name)]).to_numpy(dtype=float)
    return error if index == 2 else 100.0 * error / rows[NOMINAL.format(name)].to_numpy(dtype=float)


def _within(table: pd.DataFrame, case: str, index: int, limit: float) -> Claim:
    errors = _errors(table, case, index)
    unit = "" if index == 2 else "%"
    spread = f"{errors.std():.2g} {unit}".strip()
    text = f"{_short(index)}, {case}: largest error (mean {errors.mean():.3g}, spread {spread})"
    largest = float(np.abs(errors).max())
    return Claim.definite(text, largest, at_most(limit, unit), len(errors), enough=_enough(table))


def _more(table: pd.DataFrame, index: int) -> Claim:
    """Rms error without wheelset sensors over that with them, by the same seeds."""
    without, full = _errors(table, REDUCED, index), _errors(table, FULL, index)

    def ratio(chosen: np.ndarray) -> float:
        return root_mean_square(without[chosen]) / max(root_mean_square(full[chosen]), 1e-12)

    text = f"{_short(index)} without wheelset sensors: error over that with them"
    interval = intervals.of_statistic(ratio, len(full))
    return Claim.sampled(text, ratio(np.arange(len(full))), at_most(3.0), interval, _enough(table))


def _offsets(table: pd.DataFrame) -> list[Claim]:
    """Mean errors of the conicity under both assumptions, and their difference."""
    errors = [_errors(table, case, 2) for case in (UNCERTAIN, OTHER)]
    worst = max(abs(float(np.mean(error))) for error in errors)
    each = intervals.largest([intervals.of_size(intervals.of_mean(error)) for error in errors])
    apart = errors[0] - errors[1]
    between = intervals.of_size(intervals.of_mean(apart))
    text = "conicity does not converge with an uncertain track: mean offset of the worse assumption"
    other = "that offset depends on the assumption: difference of the two"
    return [
        Claim.sampled(text, worst, at_least(0.01), each, _enough(table)),
        Claim.sampled(other, abs(float(np.mean(apart))), at_least(0.005), between, _enough(table)),
    ]


def _enough(table: pd.DataFrame) -> bool:
    """Whether the runs were as long as the claims are about."""
    return float(table[TIME].to_numpy(dtype=float).max()) > (DURATION + FAST_DURATION) / 2.0


def _short(index: int) -> str:
    return ("C_sy", "C_spsi", "conicity")[index]
