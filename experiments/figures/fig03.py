"""Figure 3: 35 m lateral alignment through a crossover and over plain track beyond."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture

from experiments.figures.crossover import CrossoverFigure, single_panel
from experiments.reporting.claims import Claim, at_least, between
from experiments.reporting.plots import BLUE, GREY, ORANGE
from experiments.runs.crossover import PLAIN, X, seeds, series, symmetry
from railsim.analysis.statistics import root_mean_square


class Fig03(CrossoverFigure):
    """From the bogie's yaw gyro and the tachometer; distance from midway between C and D."""

    def draw(self, table: pd.DataFrame) -> Picture:
        title = "Lateral alignment through a crossover, 5 m/s, MEMS sensors"
        picture, axes, rows = single_panel(table, title, "35 m lateral alignment [mm], left +")
        axes.plot(rows[X], 1e3 * rows["true alignment [m]"], color=GREY, lw=1.2, label="the track's own")
        axes.plot(rows[X], 1e3 * rows["alignment [m]"], color=BLUE, lw=1.5, label="from yaw rate, as in the paper")
        axes.plot(rows[X], 1e3 * rows["compensated [m]"], color=ORANGE, lw=1.2, label="the bogie's own motion undone")
        axes.legend(loc="lower right", frameon=False)
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        runs = [series(table, seed) for seed in seeds(table)]
        centres = [_zero(rows) for rows in runs]
        centre = max(centres, key=abs)
        pairs = zip(runs, centres, strict=True)
        rotated = min(symmetry(rows[X], rows["alignment [m]"], -1.0, place) for rows, place in pairs)
        sharp = min(symmetry(rows[X], rows["compensated [m]"], -1.0) for rows in runs)
        rough = min(_rms(rows, 0.0, PLAIN[0] - 10.0) / _rms(rows, *PLAIN) for rows in runs)
        alike, c_to_d = at_least(0.95), between(-3.5, 3.5, "m")
        return [
            Claim.definite("rotational symmetry about the zero point: correlation", rotated, alike, len(runs)),
            Claim.definite("that zero point from midway between C and D", centre, c_to_d, len(runs)),
            Claim.definite("compensated: rotational symmetry about midway: correlation", sharp, alike, len(runs)),
            Claim.definite("alignment in the crossover over that on plain track", rough, at_least(3.0), len(runs)),
        ]


def _rms(rows: dict[str, np.ndarray], near: float, far: float) -> float:
    part = (rows[X] >= near) & (rows[X] <= far)
    return root_mean_square(rows["alignment [m]"][part])


def _zero(rows: dict[str, np.ndarray]) -> float:
    """Where the alignment crosses zero nearest to the middle, m: the bogie lags behind the track."""
    x, y = np.asarray(rows[X], dtype=float), np.asarray(rows["alignment [m]"], dtype=float)
    at = np.flatnonzero(np.diff(np.sign(y)) != 0)
    nearest = int(at[np.abs(x[at]).argmin()])
    return float(x[nearest] - y[nearest] * (x[nearest + 1] - x[nearest]) / (y[nearest + 1] - y[nearest]))
