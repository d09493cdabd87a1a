"""Figure 5: vertical and lateral curvature and the tachometer through a crossover."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture

from experiments.figures.crossover import CrossoverFigure, mark
from experiments.figures.interface import Claim
from experiments.reporting.plots import BLUE, GREEN, GREY, RED
from experiments.runs.crossover import LETTERS, X, features, seeds, series

CLOSE = 0.5  # m


class Fig05(CrossoverFigure):
    """What the curvatures tell of the switches: toes A, F, heels B, E, crossings C, D.

    Distances count from the middle of the crossover, where they are not spoilt by how far the odometer had run before.
    "Corrected": divided by the odometer's scale, which the wheelbase in the vertical curvature gives.
    """

    def draw(self, table: pd.DataFrame) -> Picture:
        picture = Picture(figsize=(10.0, 8.4), layout="constrained")
        panels = picture.subplots(3, 1, sharex=True, height_ratios=(3, 3, 1.4))
        rows = series(table)
        lines = (
            ("vertical_curvature [1/m]", 1e3, RED, "vertical curvature [1/km]"),
            ("lateral_curvature [1/m]", 1e3, BLUE, "lateral curvature [1/km], left +"),
            ("speed [m/s]", 1.0, GREEN, "tachometer [m/s]"),
        )
        for axes, (name, factor, colour, label) in zip(panels, lines, strict=True):
            axes.plot(rows[X], factor * rows[name], color=colour, lw=1.1)
            axes.axhline(0.0 if name != "speed [m/s]" else 5.0, color=GREY, lw=0.7)
            axes.set_ylabel(label)
            axes.spines[["top", "right"]].set_visible(False)
        for axes, height in zip(panels, (0.94, 0.94, 2.0), strict=True):
            mark(axes, table, height) if height < 1 else None
        panels[2].set(xlim=(-60.0, 140.0), ylim=(4.8, 5.3), xlabel="distance from the middle [m]")
        panels[0].set_title("Curvature of a crossover seen from the bogie, 5 m/s; the tachometer reads 1 % too much")
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        rows, count = features(table), len(seeds(table))
        found = [int(np.sum(rows["label"] == letter)) == count for letter in LETTERS]
        corrected = _error(rows[X] - rows["feature [m]"])
        alone = _error(rows["odometer [m]"] - rows["feature [m]"])
        seen = _error(rows["true from middle [m]"] - rows["feature [m]"])
        left, right = (_mean(series(table), *ends) for ends in ((-24.0, -12.0), (12.0, 24.0)))
        within = float(np.mean(np.abs(rows[X] - rows["feature [m]"]) <= 2 * rows["from_middle_std [m]"]))
        return [
            Claim("features found, all seeds", float(np.mean(found)), "1 of A to F", all(found)),
            _close("from the middle, odometer corrected: largest error", corrected, all(found)),
            _close("from the middle, tachometer as it is (1 % too much): largest error", alone, all(found)),
            _close("where the bogie truly was when a feature was recognised: largest error", seen, all(found)),
            Claim(
                "corrected distances within two of their standard deviations: share", within, ">= 0.9", within >= 0.9
            ),
            Claim("curving to the left between B and C: lateral curvature", left, "> 0.002 1/m", left > 0.002),
            Claim("curving to the right between D and E: lateral curvature", right, "< -0.002 1/m", right < -0.002),
        ]


def _close(what: str, error: float, complete: bool) -> Claim:
    return Claim(f"A to F {what}", error, f"<= {CLOSE} m", complete and error <= CLOSE)


def _error(values: np.ndarray) -> float:
    return float(np.abs(values).max()) if values.size else float("nan")


def _mean(rows: dict[str, np.ndarray], low: float, high: float) -> float:
    """Mean lateral curvature between two distances from the middle, 1/m."""
    return float(np.mean(rows["lateral_curvature [1/m]"][(rows[X] > low) & (rows[X] < high)]))
