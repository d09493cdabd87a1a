"""Figure 4: the bogie's yaw through a crossover."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture

from experiments.figures.crossover import CrossoverFigure, single_panel
from experiments.reporting.claims import Claim, at_least, near
from experiments.reporting.plots import BLUE, ORANGE
from experiments.runs.crossover import SHAPE, X, features, seeds, series, symmetry

PAPER = 0.077  # rad; "nearly 0.077 radians, consistent with a 1 in 13 crossing angle" (Ward et al. 2011, section 3.3)


class Fig04(CrossoverFigure):
    """Integrated yaw rate, from the direction of the plain track before and after."""

    def draw(self, table: pd.DataFrame) -> Picture:
        title = "Bogie yaw through a crossover, 5 m/s, MEMS gyro (the paper's sign is the opposite)"
        picture, axes, rows = single_panel(table, title, "yaw [mrad], left +")
        axes.plot(rows[X], 1e3 * rows["yaw [rad]"], color=BLUE, lw=1.6, label="yaw of the bogie")
        axes.axhline(1e3 / 13, color=ORANGE, lw=1.0, ls="--", label="1 in 13")
        axes.set_ylim(-10, 95)
        axes.legend(loc="center right", frameon=False)
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        runs = [series(table, seed) for seed in seeds(table)]
        largest = np.array([np.nanmax(np.abs(rows["yaw [rad]"])) for rows in runs])
        worst = float(largest[np.abs(largest - PAPER).argmax()])
        even = min(symmetry(rows[X], rows["yaw [rad]"], 1.0) for rows in runs)
        length = _length(table)
        return [
            Claim.definite("largest yaw", worst, near(PAPER, 0.02 * PAPER, "rad"), len(runs)),
            Claim.definite("rotational symmetry about the middle: correlation", even, at_least(0.95), len(runs)),
            Claim.definite("distance from A to F", length, near(SHAPE.length, 0.75, "m"), len(runs)),
        ]


def _length(table: pd.DataFrame) -> float:
    """A to F, m, the worst of all seeds."""
    rows = features(table)
    lengths = rows[X][rows["label"] == "F"] - rows[X][rows["label"] == "A"]
    if lengths.size < len(seeds(table)):
        return float("nan")
    return float(lengths[np.abs(lengths - SHAPE.length).argmax()])
