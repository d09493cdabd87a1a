"""Figure 8: creep curves for dry, wet, low and very low adhesion (wheel load of 4000 kg, 20 m/s)."""

import pandas as pd
from matplotlib.figure import Figure as Picture

from experiments.figures.interface import Figure
from experiments.reporting.claims import Claim
from experiments.reporting.size import Size
from experiments.validation.adhesion_curves import comparisons, creep_curves, draw_curves


class Fig08(Figure):
    """Longitudinal creep force over creepage at a fixed contact patch, by Polach's law and by FASTSIM."""

    def compute(self, size: Size) -> pd.DataFrame:
        del size
        return creep_curves()

    def draw(self, table: pd.DataFrame) -> Picture:
        picture = Picture(figsize=(11.0, 5.4), layout="constrained")
        draw_curves(table, picture)
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        return [Claim.definite(*comparison) for comparison in comparisons(table)]
