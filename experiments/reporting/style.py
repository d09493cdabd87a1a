"""What figures share beside the house style of `railsim.plots.style`: lines that leave a panel, dots, tables, files."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

DPI = 130


def line_inside(axes: Axes, x: np.ndarray, y: np.ndarray, limits: tuple[float, float], **style: Any) -> None:
    """A line with gaps where it leaves the limits of y, and triangles at the edge for its points beyond.

    x, y : of the points, shape (n,). limits : lowest and highest y of the panel, which they are set to.
    """
    low, high = limits
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    axes.plot(x, np.where((y >= low) & (y <= high), y, np.nan), **style)
    for beyond, edge, marker in ((y > high, high, "^"), (y < low, low, "v")):
        if beyond.any():
            places = np.full(int(beyond.sum()), edge)
            axes.plot(x[beyond], places, marker, color=style.get("color"), ms=6, mfc="none", clip_on=False)
    axes.set_ylim(low, high)


def dots(axes: Axes, x: np.ndarray, y: np.ndarray, colour: str, label: str | None, every: int = 10) -> None:
    """Of a signal that jumps between levels, a dot for every so-many-th sample: a line would fill what is between.

    x, y : of the samples, shape (n,).
    """
    axes.plot(x[::every], y[::every], ".", color=colour, ms=2.5, mew=0, zorder=1, label=label, rasterized=True)


def as_table(axes: Axes) -> None:
    """A panel of cells: no grid, no frame, no ticks."""
    axes.grid(False)
    axes.spines[:].set_visible(False)
    axes.tick_params(which="both", length=0)


def save_picture(picture: Figure, path: Path, kind: str) -> None:
    """Write a picture; kind : png or svg."""
    metadata = {"Date": None} if kind == "svg" else None
    picture.savefig(path, dpi=DPI, format=kind, metadata=metadata)
