"""Figure 5: vertical and lateral curvature and the tachometer through a crossover."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture

from experiments.figures.crossover import CrossoverFigure, mark
from experiments.reporting import intervals
from experiments.reporting.claims import Claim, above, at_least, at_most, below, exactly
from experiments.reporting.plots import BLUE, GREEN, GREY, RED
from experiments.runs.crossover import LETTERS, SEED, X, features, seeds, series

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
        curves = (
            ("vertical_curvature [1/m]", 1e3, RED, "vertical curvature [1/km]"),
            ("lateral_curvature [1/m]", 1e3, BLUE, "lateral curvature [1/km], left +"),
            ("speed [m/s]", 1.0, GREEN, "tachometer [m/s]"),
        )
        for axes, (name, factor, colour, label) in zip(panels, curves, strict=True):
            axes.plot(rows[X], factor * rows[name], color=colour, lw=1.1)
            axes.axhline(0.0 if name != "speed [m/s]" else 5.0, color=GREY, lw=0.7)
            axes.set_ylabel(label)
        for axes, height in zip(panels, (0.94, 0.94, 2.0), strict=True):
            mark(axes, table, height) if height < 1 else None
        panels[2].set(xlim=(-60.0, 140.0), ylim=(4.8, 5.3), xlabel="distance from the middle [m]")
        panels[0].set_title("Curvature of a crossover seen from the bogie, 5 m/s; the tachometer reads 1 % too much")
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        rows, count = features(table), len(seeds(table))
        complete = [int(np.sum(rows["label"] == letter)) == count for letter in LETTERS]

        def close(what: str, distance: np.ndarray) -> Claim:
            error = float(np.abs(distance - rows["feature [m]"]).max()) if all(complete) else None
            return Claim.definite(f"A to F {what}: largest error", error, at_most(CLOSE, "m"), count)

        left, right = (_mean(series(table), *ends) for ends in ((-24.0, -12.0), (12.0, 24.0)))
        return [
            Claim.definite("features found, all seeds", float(np.mean(complete)), exactly(1.0), count),
            close("from the middle, odometer corrected", rows[X]),
            close("from the middle, tachometer as it is (1 % too much)", rows["odometer [m]"]),
            close("where the bogie truly was when a feature was recognised", rows["true from middle [m]"]),
            _covered(rows),
            Claim.definite("curving to the left between B and C: lateral curvature", left, above(0.002, "1/m")),
            Claim.definite("curving to the right between D and E: lateral curvature", right, below(-0.002, "1/m")),
        ]


def _covered(rows: dict[str, np.ndarray]) -> Claim:
    """A case is a seed: the errors of one odometer are alike."""
    inside = np.abs(rows[X] - rows["feature [m]"]) <= 2 * rows["from_middle_std [m]"]
    shares = np.array([inside[rows[SEED] == seed].mean() for seed in np.unique(rows[SEED])])
    text = "corrected distances within two of their standard deviations: share"
    return Claim.sampled(text, float(np.mean(inside)), at_least(0.9), intervals.of_mean_share(shares))


def _mean(rows: dict[str, np.ndarray], low: float, high: float) -> float:
    """Mean lateral curvature between two distances from the middle, 1/m."""
    return float(np.mean(rows["lateral_curvature [1/m]"][(rows[X] > low) & (rows[X] < high)]))
