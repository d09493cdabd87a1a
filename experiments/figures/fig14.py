"""Figure 14: (r_L + r_R) over the lateral shift, spread by the gauge's variation."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture

from experiments.figures.interface import Figure
from experiments.reporting.claims import Claim, at_least, between
from experiments.reporting.plots import BLACK, SKY
from experiments.reporting.size import Size
from experiments.runs.rolling_radii import WIDTH, contact, run, true_geometry

EVERY = 32  # samples of the run that are drawn
SEED, DURATION, FAST_DURATION = 14, 120.0, 20.0
FEWEST = 20  # samples of a section


class Fig14(Figure):
    """New S1002 on 60E1, equations (11) to (15), 30 m/s, lateral and gauge irregularity of 2 mm."""

    def compute(self, size: Size) -> pd.DataFrame:
        wheels = contact()
        signals, _ = run(wheels, SEED, True, FAST_DURATION if size.reduced else DURATION)
        shift, gauge = signals.shift[::EVERY], signals.gauge[::EVERY]
        true = true_geometry(wheels, shift, gauge)
        level = true_geometry(wheels, shift, np.zeros(len(shift)))
        return pd.DataFrame({
            "shift [m]": shift,
            "gauge [m]": gauge,
            "sum_of_radii [m]": true.sum_of_radii,
            "without_gauge [m]": level.sum_of_radii,
            "sum_of_angles [rad]": true.sum_of_angles,
        })  # fmt: skip

    def draw(self, table: pd.DataFrame) -> Picture:
        picture = Picture(figsize=(8.0, 5.0), layout="constrained")
        axes = picture.subplots()
        u = 1e3 * table["shift [m]"]
        axes.plot(u, 1e3 * table["sum_of_radii [m]"], ".", color=SKY, ms=2.5, label="with 2 mm of gauge variation")
        order = np.argsort(u.to_numpy())
        line = 1e3 * table["without_gauge [m]"].to_numpy()[order]
        axes.plot(u.to_numpy()[order], line, color=BLACK, lw=1.5, label="without")
        axes.set(xlabel="y - d [mm]", ylabel="$r_L + r_R$ [mm]", title="Sum of the rolling radii, S1002 on 60E1 (1:40)")
        axes.legend()
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        spread = spread_at_shift(table["shift [m]"].to_numpy(), table["sum_of_radii [m]"].to_numpy())
        extent = float(np.ptp(table["without_gauge [m]"]))
        alone = spread_at_shift(table["shift [m]"].to_numpy(), table["without_gauge [m]"].to_numpy())
        gauge = float(np.std(table["gauge [m]"].to_numpy()))
        many_valued = "spread of (r_L + r_R) at a shift over that without gauge variation: not a single-valued function"
        return [
            Claim.definite("standard deviation of the gauge", gauge, between(0.0015, 0.0025, "m")),
            Claim.definite(many_valued, spread / alone, at_least(5.0)),
            Claim.definite("the same spread over the range of (r_L + r_R)", spread / extent, at_least(0.1)),
        ]


def spread_at_shift(shift: np.ndarray, values: np.ndarray) -> float:
    """Root mean square, over sections, of the standard deviation of `values` about a line within the section."""
    number = np.round(shift / WIDTH).astype(int)
    total = []
    for one in np.unique(number):
        rows = number == one
        if rows.sum() >= FEWEST:
            fitted = np.polyval(np.polyfit(shift[rows], values[rows], 1), shift[rows])
            total.append(np.var(values[rows] - fitted))
    return float(np.sqrt(np.mean(total)))
