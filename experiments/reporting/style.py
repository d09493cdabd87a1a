"""One look of all pictures: type that can be read in a page of text, colours that the colour-blind can tell apart."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from railsim.plots.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, RED, SKY

DPI = 130
SETTINGS: dict[Any, Any] = {
    "font.size": 10.0,
    "axes.titlesize": 10.5,
    "axes.labelsize": 10.0,
    "legend.fontsize": 9.0,
    "legend.frameon": False,
    "axes.prop_cycle": cycler(color=[BLUE, RED, GREEN, ORANGE, PURPLE, SKY, BLACK]),
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.4,
    "image.cmap": "cividis",
    "svg.hashsalt": "railsim",  # the same picture is the same file
}


@contextmanager
def styled() -> Iterator[None]:
    """Figures that are made and saved inside have the look of all."""
    with mpl.rc_context(SETTINGS):
        yield


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
