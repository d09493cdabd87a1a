"""Item 2, second part: the values of FASTSIM that Kalker printed in 1982."""

import pandas as pd
from matplotlib.figure import FigureBase

from experiments.reporting.plots import BLUE, GREY
from experiments.reporting.size import Size
from experiments.validation.interface import Row, Section
from railsim.contact.fastsim import kalker_1982

HALF_A_DIGIT = 5e-5
PRINTED = (
    ((0.0, -2.0, 2.0, 4.0), (0.0, 0.0), (0.1843, 0.1843)),
    ((1.0, -2.0, 2.0, 4.0), (0.5684, 0.5720), (0.1838, 0.1857)),
    ((1.0, -2.0, 2.0, 1.0), (0.4530, 0.4530), (0.8299, 0.8299)),
)
"""(ux, uy, fx, fy), then the lowest and highest printed value of |Tx| and of Ty, 5 x 5 grid."""


class Kalker1982(Section):
    """Three cases; two numbers of the second differ with the computer that Kalker used."""

    item = 2
    part = "b"
    title = "FASTSIM's five printed values"
    about = (
        "Kalker's three cases on his grid of 5 x 5 (strips end at the pole of the spin): creep force over mu N in "
        "each direction. Where he prints two values (of two computers), ours must lie between them, else agree to "
        "half a digit of the fourth decimal. Tx is 0 by symmetry in the first case; the five others are his "
        "numbers."
    )
    source = "Kalker (1982), A fast algorithm for the simplified theory of rolling contact, Vehicle System Dynamics 11"
    size = (8.0, 3.2)

    def compute(self, size: Size) -> pd.DataFrame:
        del size
        cases = []
        for given, *printed in PRINTED:
            force = kalker_1982(*given, 5, 5)
            for name, ours, (low, high) in zip(("|Tx|", "Ty"), (abs(force[0]), force[1]), printed, strict=True):
                case = ", ".join(f"{value:g}" for value in given)
                cases.append({"case": f"{name} of ({case})", "ours": ours, "lowest": low, "highest": high})
        return pd.DataFrame(cases)

    def rows(self, table: pd.DataFrame) -> list[Row]:
        rows = []
        for row in table.to_dict("records"):
            low, high = row["lowest"], row["highest"]
            if low == high:
                rows.append(self.agrees(row["case"], row["ours"], low, 1.02 * HALF_A_DIGIT, "mu N"))
            else:
                rows.append(self.bounded(row["case"], row["ours"], low - HALF_A_DIGIT, high + HALF_A_DIGIT, "mu N"))
        return rows

    def draw(self, table: pd.DataFrame, picture: FigureBase) -> None:
        axes = picture.subplots()
        middle = 0.5 * (table["lowest"] + table["highest"])
        half = 0.5 * (table["highest"] - table["lowest"]) + HALF_A_DIGIT
        columns = list(range(len(table)))
        axes.vlines(columns, -1e4 * half, 1e4 * half, color=GREY, lw=12.0, alpha=0.4, label="Kalker (1982)")
        axes.plot(columns, 1e4 * (table["ours"] - middle), "o", color=BLUE, ms=5, label="railsim")
        titles = [f"{case}\n{value:.4f}" for case, value in zip(table["case"], middle, strict=True)]
        axes.set_xticks(columns, [title.replace(" of ", "\n") for title in titles], fontsize=8)
        axes.set(ylabel="from the middle of what is\nprinted, 10⁻⁴ mu N", xlim=(-0.5, len(table) - 0.5))
        axes.legend(frameon=False, loc="upper left")
