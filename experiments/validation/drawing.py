"""Small things that the pictures of the report share."""

from matplotlib.axes import Axes

from experiments.reporting.plots import RED


def grid(axes: Axes) -> None:
    """Thin grid behind the lines, no frame above and to the right."""
    axes.grid(True, color="#dddddd", lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def limit_lines(axes: Axes, *values: float, label: str | None = None) -> None:
    """Horizontal lines where a limit is."""
    for value in values:
        axes.axhline(value, color=RED, lw=1.0, ls=":", label=label)
        label = None
