"""Figure 7: dampers and conicity over time with and without wheelset sensors, and with an uncertain track.

The paper's figure is of real tests; here the data come from the nonlinear half vehicle (Exudyn), with other noise for
every seed and, in the uncertain cases, another error of the track. These two differ in what the filter assumes of it.
"""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

from estimators.suspension.suspension_rbpf import SuspensionRbpf
from estimators.suspension.verdicts import std_name
from estimators.vehicle.lateral import PARAMETERS
from experiments.figures.interface import Claim, Figure
from experiments.runs.suspension import CASE, JUDGED, SEED, TIME, over_seeds

FULL, REDUCED = "wheelsets, bogie, body", "bogie, body"
UNCERTAIN, OTHER = "bogie, body; track uncertain", "the same, other assumption"
SHARE = 0.05  # of the track's power is error: 0.22 of its size
COLOURS = {FULL: "#0072b2", REDUCED: "#009e73", UNCERTAIN: "#d55e00", OTHER: "#cc79a7"}
SEEDS, FAST_SEEDS = 20, 2
TRACK = JUDGED + 3  # of its own: every sample is taken since the figure was seen on JUDGED with every second one
LABELS = ("$C_{sy}$ in kN s/m", "$C_{s\\psi}$ in kN m s/rad", "conicity $\\lambda$", "standard deviation / estimate")
SCALES = (1e-3, 1e-3, 1.0)
NOMINAL = "true {}"


def cases() -> dict[str, tuple[SuspensionRbpf, float]]:
    """Estimator and track error of each case."""
    full = SuspensionRbpf()
    reduced = full.but(wheelset_sensors=False)
    uncertain = reduced.but(track="uncertain", track_error=SHARE)
    return {
        FULL: (full, 0.0),
        REDUCED: (reduced, 0.0),
        UNCERTAIN: (uncertain, SHARE),
        OTHER: (uncertain.but(track_error=SHARE / 4), SHARE),
    }


class Fig07(Figure):
    """Estimates over time and their spread over the seeds."""

    def compute(self, fast: bool) -> pd.DataFrame:
        """Estimates of every case and seed over time, beside the true values."""
        engine = "compiled" if fast else "exudyn"
        table, true = over_seeds(cases(), TRACK, FAST_SEEDS if fast else SEEDS, 20.0 if fast else 65.0, engine)
        return table.assign(**{NOMINAL.format(name): value for name, value in zip(PARAMETERS, true, strict=True)})

    def draw(self, table: pd.DataFrame) -> Picture:
        """Four panels: the three parameters, each with the spread over the seeds, and their relative deviations."""
        figure = Picture(figsize=(9.0, 6.4), layout="constrained")
        axes = figure.subplots(2, 2).ravel()
        for i, name in enumerate(PARAMETERS):
            for case, colour in COLOURS.items():
                _band(axes[i], table[table[CASE] == case], name, SCALES[i], colour, case)
            true = float(table[NOMINAL.format(name)].iloc[0]) * SCALES[i]
            axes[i].axhline(true, color="black", lw=0.8, ls="--")
            axes[i].set(xlabel="time in s", ylabel=LABELS[i], title=f"({'abc'[i]})", ylim=(0.0, 2.0 * true))
        axes[0].legend(fontsize=7, loc="lower right")
        for case in (FULL, REDUCED):
            rows: Any = table[table[CASE] == case]
            for name, style in zip(PARAMETERS, ("-", "--", ":"), strict=True):
                ratio = (rows[std_name(name)] / rows[name]).groupby(rows[TIME]).mean()
                label = LABELS[PARAMETERS.index(name)].partition(" in ")[0] if case == FULL else None
                axes[3].plot(ratio.index, ratio, style, color=COLOURS[case], lw=1.0, label=label)
        axes[3].set(xlabel="time in s", ylabel=LABELS[3], title="(d)", yscale="log")
        axes[3].legend(fontsize=7)
        return figure

    def check(self, table: pd.DataFrame) -> list[Claim]:
        """The paper's three claims over the seeds: largest errors, means and spreads at the end."""
        claims = [_within(table, FULL, i, limit) for i, limit in enumerate((5.0, 5.0, 0.02))]
        for i in range(2):
            more = _spread(table, REDUCED, i) / max(_spread(table, FULL, i), 1e-12)
            claims.append(_claim(f"{_short(i)} without wheelset sensors: error over that with them", more, 3.0, ""))
        claims += [_within(table, REDUCED, i, limit) for i, limit in enumerate((10.0, 10.0, 0.03))]
        claims += [_within(table, UNCERTAIN, i, 10.0) for i in range(2)]
        offsets = [float(np.mean(_errors(table, case, 2))) for case in (UNCERTAIN, OTHER)]
        worst = max(abs(offset) for offset in offsets)
        claims.append(
            Claim(
                "conicity does not converge with an uncertain track: mean offset of the worse assumption",
                worst,
                ">= 0.01",
                worst >= 0.01,
            )
        )
        apart = abs(offsets[0] - offsets[1])
        claims.append(
            Claim("that offset depends on the assumption: difference of the two", apart, ">= 0.005", apart >= 0.005)
        )
        return claims


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


def _spread(table: pd.DataFrame, case: str, index: int) -> float:
    return float(np.sqrt(np.mean(_errors(table, case, index) ** 2)))


def _within(table: pd.DataFrame, case: str, index: int, limit: float) -> Claim:
    errors = _errors(table, case, index)
    unit = "" if index == 2 else " %"
    text = f"{_short(index)}, {case}: largest error (mean {errors.mean():.3g}, spread {errors.std():.2g}{unit})"
    return _claim(text, float(np.abs(errors).max()), limit, unit)


def _claim(text: str, value: float, limit: float, unit: str) -> Claim:
    return Claim(text, value, f"<= {limit:g}{unit}", value <= limit)


def _short(index: int) -> str:
    return ("C_sy", "C_spsi", "conicity")[index]
