"""Small things that the pictures of the report share."""

from matplotlib.axes import Axes

from experiments.reporting.plots import RED


def limit_lines(axes: Axes, *values: float, label: str | None = None) -> None:
    """Horizontal lines where a limit is."""
    for value in values:
        axes.axhline(value, color=RED, lw=1.0, ls=":", label=label)
        label = None
