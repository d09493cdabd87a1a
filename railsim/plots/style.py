"""House style of pictures: palette, settings of Matplotlib, frame of panels, thinned lines, units."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.figure import Figure

BLACK, GREY = "#000000", "#8c8c8c"
BLUE, ORANGE, GREEN, RED, SKY, PURPLE = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7"
"""Palette of Okabe and Ito (2008), for colour-blind readers too."""

COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, RED, BLACK, GREY)
"""Of lines that share a panel, in this order: red, which is like orange, stands far from it."""
OPAQUE: dict[str, Any] = {"frameon": True, "framealpha": 1.0, "edgecolor": "none"}
"""Of a legend that stands on lines, so that they do not show through."""
GRID: dict[str, Any] = {"color": "#dddddd", "linewidth": 0.6}
SETTINGS: dict[Any, Any] = {
    "font.size": 10.0,
    "axes.titlesize": 10.5,
    "axes.labelsize": 10.0,
    "legend.fontsize": 9.0,
    "legend.frameon": False,
    "axes.prop_cycle": cycler(color=COLOURS),
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "lines.linewidth": 1.4,
    "image.cmap": "cividis",
    "svg.hashsalt": "railsim",  # the same picture is the same file
} | {f"grid.{key}": value for key, value in GRID.items()}
"""Of Matplotlib: type that can be read in a page of text, colours that the colour-blind can tell apart."""
SHOWN = {"m": ("mm", 1e3), "m/s": ("km/h", 3.6), "m/m": ("mm/m", 1e3), "1/m": ("1/km", 1e3), "N/m": ("MN/m", 1e-6)}
"""Units of a picture, and the factor to them."""
MOST_PANELS, MOST_LINES = 8, 4
"""Panels of a picture, and lines in a panel; what is beyond is named."""
MOST_POINTS = 6000  # a line; more are drawn as an envelope of lowest and highest


class Picture(Figure):
    """A figure that notebooks show as a picture, whatever the backend; `savefig` writes it to a file."""

    def _repr_png_(self) -> bytes:
        held = io.BytesIO()
        self.savefig(held, format="png", dpi=100)
        return held.getvalue()


@contextmanager
def styled() -> Iterator[None]:
    """Figures that are made and saved inside have the look of all."""
    with mpl.rc_context(SETTINGS):
        yield


def dress(axes: Axes) -> None:
    """Grid and frame of a panel that is drawn, or may be saved, outside of `styled`."""
    axes.grid(True, **GRID)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def thin(x: np.ndarray, y: np.ndarray, most: int = MOST_POINTS) -> tuple[np.ndarray, np.ndarray]:
    """The points of a line, or where there are more than `most`, the lowest and the highest of each stretch."""
    if len(x) <= most:
        return x, y
    width = -(-2 * len(x) // most)
    count = len(x) // width * width
    parts = y[:count].reshape(-1, width)
    lost = np.isnan(parts).all(axis=1)
    low = np.where(np.isnan(parts), np.inf, parts).argmin(axis=1)
    high = np.where(np.isnan(parts), -np.inf, parts).argmax(axis=1)
    first = np.arange(len(parts)) * width
    rows = np.sort(np.column_stack([first + low, np.where(lost, first + low, first + high)]), axis=1).ravel()
    return x[rows], y[rows]


def frame(heights: tuple[float, ...], title: str, columns: int = 1) -> tuple[Picture, np.ndarray]:
    """Figure and its panels, shape (rows, columns); the panels of a column share their horizontal axis."""
    figure = Picture(
        figsize=(10.0 if columns == 1 else 12.0, 1.0 + 1.4 * sum(heights) * (0.75 if columns == 1 else 1.0)),
        layout="constrained",
    )
    widths = (1.0,) if columns == 1 else (1.6, 1.0)
    panels = figure.subplots(
        len(heights), columns, sharex="col", sharey="row", height_ratios=heights, width_ratios=widths, squeeze=False
    )
    figure.suptitle(title, fontsize=11)
    for panel in panels.ravel():
        dress(panel)
        panel.margins(x=0.0)
    figure.align_ylabels(panels[:, 0])
    return figure, panels


def legend(axes: Axes, wanted: bool = True) -> None:
    """Above the panel, so that it covers nothing."""
    count = len(axes.get_legend_handles_labels()[1])
    if wanted and count:
        axes.legend(
            loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=count, frameon=False, fontsize=9, borderaxespad=0.1
        )
