"""The matrix as a picture: estimators by circumstances, a colour and a letter a verdict."""

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from experiments.circumstances.circumstance import Circumstance
from experiments.circumstances.report import LETTERS, Merged
from experiments.circumstances.verdicts import FAILED, NOT_APPLICABLE, RIGHT, SAYS_SO, SILENT
from experiments.reporting.plots import BLACK, BLUE, GREY, ORANGE, PURPLE

COLOURS = {RIGHT: BLUE, SAYS_SO: "#F0E0A0", SILENT: ORANGE, FAILED: PURPLE}
INK = {RIGHT: "white", SAYS_SO: BLACK, SILENT: BLACK, FAILED: "white"}
CELL = 0.27  # inches
FEW = 5  # columns, too narrow for a legend in one row


def draw(circumstances: Mapping[str, Circumstance], estimators: Sequence[str], by_place: Merged) -> Figure:
    """The picture: a row a circumstance, a column an estimator; groups of circumstances are parted by lines."""
    rows = [name for name in circumstances if any((name, one) in by_place for one in estimators)]
    groups = list(dict.fromkeys(one.group for one in circumstances.values()))
    rows.sort(key=lambda name: groups.index(circumstances[name].group))
    columns = [one for one in estimators if any(_counts(by_place, name, one) for name in rows)]
    figure = Figure(figsize=(4.2 + CELL * 1.6 * len(columns), 2.9 + CELL * len(rows)), layout="constrained")
    axes = figure.subplots()
    for y, name in enumerate(rows):
        for x, one in enumerate(columns):
            if _counts(by_place, name, one):
                _mark(axes, x, y, by_place[name, one].verdict)
    for y in range(1, len(rows)):
        if circumstances[rows[y]].group != circumstances[rows[y - 1]].group:
            axes.axhline(y - 0.5, color=BLACK, lw=0.8)
    axes.set(xlim=(-0.5, len(columns) - 0.5), ylim=(len(rows) - 0.5, -0.5))
    axes.set_xticks(range(len(columns)), columns, rotation=60, ha="left", rotation_mode="anchor", fontsize=8)
    axes.set_yticks(range(len(rows)), [f"{circumstances[name].group}: {name}" for name in rows], fontsize=8)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.set_facecolor("#f4f4f4")
    axes.spines[:].set_color(GREY)
    shown = {by_place[place].verdict for place in by_place} - {NOT_APPLICABLE}
    handles = [Patch(color=COLOURS[v], label=f"{LETTERS[v]}  {v}") for v in COLOURS if v in shown]
    handles.append(Patch(color="#f4f4f4", label="does not apply"))
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=len(handles) if len(columns) > FEW else 1,
        frameon=False,
        fontsize=9,
    )
    return figure


def _counts(by_place: Merged, circumstance: str, estimator: str) -> bool:
    cell = by_place.get((circumstance, estimator))
    return cell is not None and cell.verdict != NOT_APPLICABLE


def _mark(axes: Axes, x: int, y: int, verdict: str) -> None:
    axes.add_patch(Rectangle((x - 0.48, y - 0.46), 0.96, 0.92, color=COLOURS[verdict], lw=0))
    axes.text(x, y, LETTERS[verdict], ha="center", va="center", fontsize=8, color=INK[verdict])
