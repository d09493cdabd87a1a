"""Item 6: figure 8 of the paper, by number."""

import pandas as pd
from matplotlib.figure import FigureBase

from experiments.figures.fig08 import Fig08, draw_curves
from experiments.validation.interface import Row, Section


class AdhesionCurves(Section):
    """The claims of `railsim figure fig08`."""

    item = 6
    title = "Creep curves for dry, wet, low and very low adhesion"
    about = (
        "Figure 8 of the paper: wheel load 4000 kg, 20 m/s. Maxima and initial slopes must be ordered as in the "
        "paper. The paper prints no numbers; the other rows check the curves against the parameters that they "
        "were drawn from."
    )
    source = "Ward et al. (2011), fig. 8; parameters Polach (2005), for the two low ones illustrative"
    size = (11.0, 5.4)

    def compute(self, fast: bool) -> pd.DataFrame:
        return Fig08().compute(fast)

    def rows(self, table: pd.DataFrame) -> list[Row]:
        return [self.claimed(claim) for claim in Fig08().check(table)]

    def draw(self, table: pd.DataFrame, picture: FigureBase) -> None:
        draw_curves(table, picture)
