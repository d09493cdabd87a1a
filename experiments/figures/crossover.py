"""What figures 3 to 5 share: the same runs, drawn over the distance from the crossover's middle."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

from experiments.figures.interface import Figure
from experiments.reporting.size import Size
from experiments.runs.crossover import SEED, X, crossover_table, features, series


class CrossoverFigure(Figure):
    """Base of figures 3 to 5."""

    def compute(self, size: Size) -> pd.DataFrame:
        """See `crossover_table`."""
        return crossover_table(size.reduced)


def single_panel(table: pd.DataFrame, title: str, label: str) -> tuple[Picture, Axes, dict[str, np.ndarray]]:
    """A picture with one pair of axes, the features marked, and the rows to draw in it."""
    picture = Picture(figsize=(10.0, 4.8), layout="constrained")
    axes = picture.subplots()
    mark(axes, table, 0.94)
    axes.set(xlim=(-60.0, 140.0), xlabel="distance from the middle [m]", ylabel=label, title=title)
    return picture, axes, series(table)


def mark(axes: Any, table: pd.DataFrame, height: float, seed: int = 1) -> None:
    """Vertical lines at the features of one seed, with their letters at `height` of the axes."""
    rows = features(table)
    for label, distance, number in zip(rows["label"], rows[X], rows[SEED], strict=True):
        if number == seed:
            axes.axvline(distance, color="#8c8c8c", lw=0.7, ls=":")
            axes.text(distance, height, label, transform=axes.get_xaxis_transform(), ha="center", fontweight="bold")
